// Ends TLS: accepts connections on a TCP port, decrypts them, and passes on each as one end of a
// pair of sockets, from which the HTTP server reads and writes as from any other (Server::Take).
//
//   TlsListener tls(io, {.address = "0.0.0.0", .port = 8377},
//                   [&](Descriptor decrypted) { server.Take(std::move(decrypted)); });
//   tls.SetCertificate(checked.context);        // again at any time: new connections have the new
//   one const Status listening = tls.Listen(); io.run();
//   ...
//   tls.Stop();            // after Server::Stop; io runs dry
//
// So there is one implementation of sessions, and what encrypts has a thread of its own, which may
// have a low priority. Each side is read only when the other has taken what was read before, so
// that a client that does not read stops the server's writing, whose limits then apply; in between
// there are at most about 300 KiB for a connection. An end of either side is passed on after what
// was sent before it.
//
// Limits: a handshake may take `handshake_patience` from the connection on; a client may take
// nothing for `patience`. Beyond `max_connections`, the oldest connection that is being closed, or
// else whose handshake is not done, makes room for a new one; if there is none, the new one is
// closed. A client that speaks plain HTTP is told so, with status 400.
//
// Any thread; `give` is called on the threads of `io`.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include <boost/asio/io_context.hpp>

#include "server/base/descriptor.h"
#include "server/base/result.h"
#include "server/net/certificate.h"
#include "server/web/tls_counters.h"

namespace pheromone::web {

struct TlsOptions {
  std::string address;  ///< numeric
  uint16_t port = 0;    ///< 0: the system chooses, see port()
  /// More than the server takes, with those above its limit, so that handshakes find room.
  size_t max_connections = 192;
  std::chrono::milliseconds handshake_patience{10'000};
  std::chrono::milliseconds patience{30'000};
  /// Receives messages about internal errors, on any thread of `io`.
  std::function<void(const std::string&)> tell = {};
};

class TlsListener {
 public:
  using Give = std::function<void(Descriptor)>;

  TlsListener(boost::asio::io_context& io, TlsOptions options, Give give);
  TlsListener(const TlsListener&) = delete;
  TlsListener& operator=(const TlsListener&) = delete;
  ~TlsListener();

  /// Not null. To be called before Listen.
  void SetCertificate(TlsContext context);

  Status Listen();

  /// Accepts no more. Handshakes end at once, and other connections once the server has closed its
  /// end; for clients that take nothing they hardly wait.
  void Stop();

  uint16_t port() const;  ///< that is listened on; 0: none
  const TlsCounters& counters() const;

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace pheromone::web
