// HTTP/1.1 on a Unix socket and a TCP port: bytes to requests and responses to bytes. What is
// answered is decided elsewhere (api.h).
//
//   Server server(io, options, [&](Request request, Respond respond) {
//     api.Handle(std::move(request), std::move(respond));
//   });
//   const Status listening = server.ListenOnPort();
//   io.run();               // on as many threads as you like
//   ...
//   server.Stop();          // io runs dry
//
// The handler is called on the threads of `io`, for different connections at once. It must not take
// long: it answers later, from any thread, what would hold up other requests.
//
// Strangers: a header may have 8 KiB and a body 1 MiB; a request must have come in, and its answer
// be there and be taken, within `patience` each; an answer that does not come is 504. The socket
// and the port have `max_connections` each. When one is full, the connection that has waited for a
// request the longest gives way to a new one; where all are in the middle of a request, the new one
// is told 503 and closed, unless what it asks for is urgent. Whoever breaks a rule gets 400, 413,
// 431 or 503 if he can still be told, and is hung up on.
//
// Listen before the run or during it, Stop once, from any thread. SIGPIPE must be ignored.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include <boost/asio/io_context.hpp>

#include "server/base/result.h"
#include "server/web/http.h"

namespace pheromone::web {

constexpr size_t kMaxHeaderBytes = size_t{8} << 10;
constexpr size_t kMaxBodyBytes = size_t{1} << 20;

struct ServerOptions {
  std::string socket_path;      ///< of the Unix socket, made with mode 0660; empty: none
  std::string listen_address;   ///< numeric; empty: no TCP
  uint16_t listen_port = 0;     ///< 0: the system chooses, see port()
  size_t max_connections = 64;  ///< of each; and as many that are told that there are too many
  std::chrono::milliseconds patience{15'000};
  /// Of requests that are served however many others there are: those to which the handler has an
  /// answer in no time. Empty: none.
  std::function<bool(const Request&)> is_urgent = {};
  /// Gets what goes wrong inside, in words, on any thread of `io`.
  std::function<void(const std::string&)> tell = {};
};

class Server {
 public:
  using Handle = std::function<void(Request, Respond)>;

  Server(boost::asio::io_context& io, ServerOptions options, Handle handle);
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  ~Server();

  /// Each opens what it is named after, or says why that failed; the other works without it.
  Status ListenOnSocket();
  Status ListenOnPort();

  /// Ends all conversations, after the answer to what has been handed to the handler, and removes
  /// the Unix socket if it is still ours.
  void Stop();

  /// The TCP port that is listened on; 0: none.
  uint16_t port() const;

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace pheromone::web
