// HTTP/1.1 on a Unix socket and a TCP port: parses requests and writes responses. The API is
// elsewhere (api.h).
//
//   Server server(io, options, [&](Request request, Respond respond) {
//     api.Handle(std::move(request), std::move(respond));
//   });
//   const Status listening = server.ListenOnPort();
//   io.run();               // on any number of threads
//   ...
//   server.Stop();          // io runs dry
//
// The handler is called on the threads of `io`, concurrently for different connections. It must not
// block: requests that take long are answered later, from any thread.
//
// With a certificate, the port speaks TLS, and only that. A handshake may take
// `handshake_patience`; at most `max_handshakes` are under way, of which the oldest makes room for
// a new one; only then the connection is one of the port's. A client that speaks plain HTTP is told
// so, with status 400.
//
// Limits: headers have at most 8 KiB and a body 1 MiB; receiving a request, answering it and
// sending the answer, or each portion of a long one, may take `patience` each; a missing answer is
// 504. The socket and the port have `max_connections` each. When these are in use, the connection
// that has been idle for longest is closed for a new one; a request that has not come in whole
// counts as idle. If none is idle, the new one is answered with 503 and closed, unless its request
// is urgent. A long answer is sent in portions, with other requests in between; beyond what
// `long_answers` permits it is 503. A client that violates a limit gets 400, 413, 431 or 503 if
// possible, and is disconnected. When the server stops, what was handed over is answered; sending
// that may take 2 s.
//
// One client of the port that connects too often waits (connection_pace.h): other clients, the
// socket and the robots do not notice.
//
// If the socket's file is removed or replaced, or the port fails, both listen again, at the same
// place; that is told once, and when it has succeeded. Attempts are `listen_again` apart.
//
// If a handler is registered, a client may request a WebSocket; then the connection is handed over,
// with the bytes already read (upgrade.h). Elsewhere such a request is treated like any other, and
// the upgrade is ignored.
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
#include "server/net/certificate.h"
#include "server/net/endpoint.h"
#include "server/operators/web/connection_pace.h"
#include "server/operators/web/http.h"
#include "server/operators/web/long_answers.h"
#include "server/operators/web/tls_counters.h"
#include "server/operators/web/upgrade.h"

namespace pheromone::web {

constexpr size_t kMaxHeaderBytes = size_t{8} << 10;
constexpr size_t kMaxBodyBytes = size_t{1} << 20;

struct ServerOptions {
  std::string socket_path;      ///< of the Unix socket, made with mode 0660; empty: none
  Endpoint listen;              ///< see port(); without an address: no TCP
  size_t max_connections = 64;  ///< of each; and as many more that are answered with 503
  std::chrono::milliseconds patience{15'000};
  std::chrono::milliseconds listen_again{1'000};
  ConnectionPace::Limits pace = {};       ///< of each client of the port
  size_t max_handshakes = 64;             ///< of TLS
  LongAnswers::Limits long_answers = {};  ///< of the port, and of the Unix socket
  std::chrono::milliseconds handshake_patience{10'000};
  /// Of requests that are served however many others there are: those to which the handler has an
  /// answer in no time. Empty: none.
  std::function<bool(const Request&)> is_urgent = {};
  /// Receives messages about internal errors, and about a socket or port that is lost or back, on
  /// any thread of `io`.
  std::function<void(const std::string&)> tell = {};
};

class Server {
 public:
  using Handle = std::function<void(Request, Respond)>;

  Server(boost::asio::io_context& io, ServerOptions options, Handle handle);
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  ~Server();

  /// Passes connections that ask for a WebSocket at `path`, and are not refused by `handler.check`,
  /// to `handler.take`; beyond `max_connections` they are answered with 503. A path such as
  /// "/replay/", other than "/", also stands for what is in that folder. To be called before the
  /// server listens.
  void OnUpgrade(std::string path, UpgradeHandler handler);

  /// Each starts listening on what it is named after, or returns an error; they are independent.
  Status ListenOnSocket();
  Status ListenOnPort();

  /// Not null. Before ListenOnPort: the port speaks TLS; later: for new connections. Any thread.
  void SetCertificate(TlsContext context);

  /// Closes all connections, after answering the requests passed to the handler, and removes the
  /// Unix socket if it is still ours. Owners of upgraded connections are notified (Place::OnStop).
  void Stop();

  /// The TCP port that is listened on; 0: none.
  uint16_t port() const;
  const TlsCounters& tls_counters() const;

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace pheromone::web
