// TLS 1.3 between the daemons of a cluster, with keys that are derived from the secret that all of
// them have, and without certificates: who does not know the secret gets no further, on either
// side.
//
//   const PeerTls tls(secret, "lab", {"a", "b", "c"}, "b");
//   PeerTls::Side side{.tls = &tls, .dials = "c"};     // or none: it accepts
//   ssl::stream<tcp::socket> stream(std::move(socket), tls.Make(&side));
//   ... handshake ...
//   if (PeerTls::IsAuthenticated(stream.native_handle())) ...
//
// A key is for one cluster, and for one direction of dialing between two nodes:
//
//   identity = CLUSTER "/" DIALER "/" LISTENER
//   key      = HKDF-SHA256(salt = "pheromone cluster", secret, info = identity), 32 bytes (RFC
//   5869)
//
// so that nobody can send a node's own handshake back to it (Drucker, Gueron 2019, "Selfie"), and
// the listener knows which node dials (RFC 9257, section 6). The key exchange is ephemeral, on top
// of the key (psk_dhe_ke): a secret that is lost later does not tell what was said before.
//
// Any thread.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/net/certificate.h"

struct ssl_st;  // OpenSSL's SSL

namespace pheromone::cluster {

class PeerTls {
 public:
  /// `nodes` may dial `node`, if they come before it.
  PeerTls(std::string secret, std::string cluster, std::vector<std::string> nodes,
          std::string node);

  /// One end of a connection.
  struct Side {
    const PeerTls* tls = nullptr;
    std::string dials{};     ///< the node that it asks for; empty: it waits to be asked
    std::string identity{};  ///< of the key that is asked for; of a stranger, any bytes
    std::string from{};      ///< the node that dials, if that is known
  };

  /// For a stream of Asio, which owns it; `side` outlives it.
  ssl_st* Make(Side* side) const;

  /// After the handshake: whether the key was used.
  static bool IsAuthenticated(ssl_st* ssl);

  std::string IdentityOf(std::string_view dialer, std::string_view listener) const;
  /// Of an identity.
  std::string KeyOf(const std::string& identity) const;

  const std::string& node() const { return node_; }
  const std::vector<std::string>& nodes() const { return nodes_; }

 private:
  std::string secret_;
  std::string cluster_;
  std::vector<std::string> nodes_;
  std::string node_;
  TlsContext context_;
};

}  // namespace pheromone::cluster
