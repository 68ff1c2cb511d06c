// Upgraded connections: the HTTP server hands a connection over when a client requests a WebSocket
// on a path with a registered handler (Server::OnUpgrade).
//
//   server.OnUpgrade("/api/v1/stream", {
//       .check = [&](const Request& request) { return api.CheckStream(request); },
//       .take = [&](Upgrade upgrade) { viewers.Add(std::move(upgrade)); }});
//
// The server has read the request and sent nothing: the handler performs the handshake, and sets
// all further limits and deadlines.
//
// The connection counts towards `max_connections` of its listener until its Place is destroyed, and
// is never closed in favour of a new one. The handler closes it when the server stops
// (`place.OnStop`).
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>

#include "server/operators/web/connection.h"
#include "server/operators/web/http.h"

namespace pheromone::web {

/// The state of a place, shared by server and handler. Internal to this folder; thread-safe.
class PlaceState {
 public:
  void OnStop(std::function<void()> stop) { OnceAfter(&stopped_, &on_stop_, std::move(stop)); }
  void Stop() { Happen(&stopped_, &on_stop_); }

  void OnRelease(std::function<void()> release) {
    OnceAfter(&released_, &on_release_, std::move(release));
  }
  void Release() {
    {
      const std::lock_guard lock(mutex_);
      stopped_ = true;  // there is no handler left to notify
      on_stop_ = nullptr;
    }
    Happen(&released_, &on_release_);
  }

 private:
  // Each callback is called once, without the lock, and destroyed.
  void OnceAfter(const bool* happened, std::function<void()>* kept, std::function<void()> call) {
    {
      const std::lock_guard lock(mutex_);
      if (!*happened) {
        *kept = std::move(call);
        return;
      }
    }
    call();
  }
  void Happen(bool* happened, std::function<void()>* kept) {
    std::function<void()> call;
    {
      const std::lock_guard lock(mutex_);
      *happened = true;
      call.swap(*kept);
    }
    if (call) {
      call();
    }
  }

  std::mutex mutex_;
  bool stopped_ = false;
  bool released_ = false;
  std::function<void()> on_stop_;
  std::function<void()> on_release_;
};

/// The place of a connection among those of its listener. Destroy it after the connection is closed
/// and before the server's io_context is destroyed. Any thread.
class Place {
 public:
  explicit Place(std::shared_ptr<PlaceState> state) : state_(std::move(state)) {}
  Place(Place&&) = default;
  Place& operator=(Place&& other) noexcept {
    state_.swap(other.state_);
    return *this;
  }
  ~Place() {
    if (state_ != nullptr) {
      state_->Release();
    }
  }

  /// `stop` is called once when the server stops, or at once if it has stopped; from any thread. It
  /// must not block: post, and close the connection there. To be set once; not called after the
  /// place was destroyed.
  void OnStop(std::function<void()> stop) { state_->OnStop(std::move(stop)); }

 private:
  std::shared_ptr<PlaceState> state_;
};

struct Upgrade {
  Connection connection;  ///< on a strand of its own, with no operation under way
  boost::beast::http::request<boost::beast::http::string_body> message;  ///< for the handshake
  bool local = false;                                                    ///< over the Unix socket
  std::string rest;  ///< bytes already read after the request
  Place place;
  std::string client = {};  ///< as in Request
};

struct UpgradeHandler {
  /// Returns the refusal, or nothing if the client may connect. Besides the checks of other
  /// requests it must check Origin, since browsers open WebSockets across origins. On the threads
  /// of `io`.
  std::function<std::optional<Response>(const Request&)> check;
  /// Called on the connection's strand. Must not block.
  std::function<void(Upgrade)> take;
};

}  // namespace pheromone::web
