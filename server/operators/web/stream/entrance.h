// How viewers come in: from the HTTP server's threads to the one that serves them, and not too
// many. Internal to this folder.
//
//   Entrance entrance(&io, &api, &counters, {.max_guests = 32, ...});
//   if (auto refused = entrance.Check(request)) return refused;           // the server's threads
//   entrance.Take(std::move(upgrade), weak_from_this(), [this](Entrance::Guest guest) { ... });
//   entrance.Leave();                                                     // when it has gone
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <boost/asio/io_context.hpp>

#include "server/operators/control/stream_counters.h"
#include "server/operators/web/api/api.h"
#include "server/operators/web/http.h"
#include "server/operators/web/stream/viewer.h"
#include "server/operators/web/upgrade.h"

namespace pheromone::web {

struct EntranceOptions {
  size_t max_guests = 0;
  std::string too_many;  ///< "too many viewers"
  std::string limit;     ///< "at most 32, web.max_viewers of the configuration"
};

class Entrance {
 public:
  /// Its connection is of `io`.
  struct Guest {
    Connection connection;
    Place place;
    boost::beast::http::request<boost::beast::http::string_body> message;
    std::string subprotocol;
  };

  Entrance(boost::asio::io_context* io, Api* api, StreamCounters* counters,
           EntranceOptions options);

  /// Access, the subprotocol, and the number of guests; counts refusals. Any thread.
  std::optional<Response> Check(const Request& request);
  /// Counts one more guest, and passes it to `welcome` on the thread of `io`, as long as `owner`,
  /// which owns this, exists. Any thread.
  void Take(Upgrade upgrade, std::weak_ptr<const void> owner, std::function<void(Guest)> welcome);
  void Leave() { --guests_; }
  /// Nobody comes in any more. Any thread.
  void Close() { is_closed_ = true; }
  bool is_closed() const { return is_closed_; }

 private:
  boost::asio::io_context& io_;
  Api& api_;
  StreamCounters& counters_;
  const EntranceOptions options_;
  std::atomic<bool> is_closed_ = false;
  std::atomic<size_t> guests_{0};
};

}  // namespace pheromone::web
