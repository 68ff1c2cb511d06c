// Who gets through the handshake, in memory.

#include "server/cluster/peer_tls.h"

#include <gtest/gtest.h>
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/ssl.h>

#include <memory>
#include <string>
#include <string_view>

#include "server/base/hex.h"
#include "server/net/certificate.h"
#include "server/net/testing/make_certificate.h"

namespace pheromone::cluster {
namespace {

struct FreesSsl {
  void operator()(SSL* it) const { SSL_free(it); }
};
using Ssl = std::unique_ptr<SSL, FreesSsl>;

std::string Secret() {
  std::string secret;
  for (int i = 0; i < 32; ++i) {
    secret += static_cast<char>(i);
  }
  return secret;
}

PeerTls TlsOf(const std::string& node, const std::string& secret = Secret(),
              const std::string& cluster = "lab") {
  return PeerTls(secret, cluster, {"a", "b", "c"}, node);
}

// Passes bytes to and fro until nothing more happens.
void ShakeHands(SSL* dialer, SSL* listener) {
  BIO* of_dialer = nullptr;
  BIO* of_listener = nullptr;
  ASSERT_EQ(BIO_new_bio_pair(&of_dialer, 0, &of_listener, 0), 1);
  SSL_set_bio(dialer, of_dialer, of_dialer);
  SSL_set_bio(listener, of_listener, of_listener);
  SSL_set_connect_state(dialer);
  SSL_set_accept_state(listener);
  for (int i = 0; i < 10; ++i) {
    SSL_do_handshake(dialer);
    SSL_do_handshake(listener);
    ERR_clear_error();
  }
}

// 2: both ends take the other for a node of their cluster.
int Authenticated(const PeerTls& dialer, const std::string& dials, const PeerTls& listener,
                  std::string* from = nullptr) {
  PeerTls::Side of_dialer{.tls = &dialer, .dials = dials};
  PeerTls::Side of_listener{.tls = &listener};
  const Ssl one(dialer.Make(&of_dialer));
  const Ssl other(listener.Make(&of_listener));
  ShakeHands(one.get(), other.get());
  if (from != nullptr) {
    *from = of_listener.from;
  }
  return (PeerTls::IsAuthenticated(one.get()) ? 1 : 0) +
         (PeerTls::IsAuthenticated(other.get()) ? 1 : 0);
}

// By Python's hmac and hashlib, as RFC 5869 says.
TEST(PeerTls, KeysAreDerivedAsDescribed) {
  EXPECT_EQ(TlsOf("a").IdentityOf("a", "b"), "lab/a/b");
  EXPECT_EQ(HexText(TlsOf("a").KeyOf("lab/a/b")),
            "eea561900a2b8421d3dc8cef41bb115d487dbe2d9a69296fa090193249d5d86e");
  EXPECT_EQ(HexText(TlsOf("a").KeyOf("lab/b/c")),
            "3bcd3c3ff0458310bf71660c62818d82ad58b7776ec8525fe711de5e5ab5b453");
}

TEST(PeerTls, NodesWithTheSameSecretKnowEachOther) {
  std::string from;
  EXPECT_EQ(Authenticated(TlsOf("a"), "b", TlsOf("b"), &from), 2);
  EXPECT_EQ(from, "a");
  EXPECT_EQ(Authenticated(TlsOf("b"), "c", TlsOf("c"), &from), 2);
  EXPECT_EQ(from, "b");
}

TEST(PeerTls, WhoHasAnotherSecretOrClusterGetsNoFurther) {
  std::string other = Secret();
  other[31] = 0;
  EXPECT_EQ(Authenticated(TlsOf("a", other), "b", TlsOf("b")), 0);
  EXPECT_EQ(Authenticated(TlsOf("a"), "b", TlsOf("b", other)), 0);
  EXPECT_EQ(Authenticated(TlsOf("a", Secret(), "hall"), "b", TlsOf("b")), 0);
}

TEST(PeerTls, AKeyIsForOneDialerAndOneListener) {
  EXPECT_EQ(Authenticated(TlsOf("a"), "c", TlsOf("b")), 0);   // it is another node
  EXPECT_EQ(Authenticated(TlsOf("b"), "a", TlsOf("a")), 0);   // the other one dials
  EXPECT_EQ(Authenticated(TlsOf("a"), "b", TlsOf("a")), 0);   // its own handshake comes back
  EXPECT_EQ(Authenticated(TlsOf("aa"), "b", TlsOf("b")), 0);  // no node of the cluster
}

TEST(PeerTls, AClientWithoutAKeyIsRefused) {
  const std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context(SSL_CTX_new(TLS_client_method()),
                                                                  SSL_CTX_free);
  const PeerTls tls = TlsOf("b");
  PeerTls::Side side{.tls = &tls};
  const Ssl dialer(SSL_new(context.get()));
  const Ssl listener(tls.Make(&side));
  ShakeHands(dialer.get(), listener.get());
  EXPECT_EQ(SSL_is_init_finished(dialer.get()), 0);
  EXPECT_EQ(SSL_is_init_finished(listener.get()), 0);
}

// Who stands between two nodes cannot show a certificate instead of the secret.
TEST(PeerTls, AServerWithACertificateIsRefused) {
  const CheckedCertificate checked = CheckCertificate(pheromone::testing::MakeCertificate());
  ASSERT_NE(checked.context, nullptr);
  const PeerTls tls = TlsOf("a");
  PeerTls::Side side{.tls = &tls, .dials = "b"};
  const Ssl dialer(tls.Make(&side));
  const Ssl listener(SSL_new(checked.context.get()));
  ShakeHands(dialer.get(), listener.get());
  EXPECT_EQ(SSL_is_init_finished(dialer.get()), 0);
  EXPECT_FALSE(PeerTls::IsAuthenticated(dialer.get()));
}

// One of TLS 1.2 is not spoken with.
TEST(PeerTls, AnOlderTlsIsRefused) {
  const std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context(SSL_CTX_new(TLS_client_method()),
                                                                  SSL_CTX_free);
  SSL_CTX_set_max_proto_version(context.get(), TLS1_2_VERSION);
  const PeerTls tls = TlsOf("b");
  PeerTls::Side side{.tls = &tls};
  const Ssl dialer(SSL_new(context.get()));
  const Ssl listener(tls.Make(&side));
  ShakeHands(dialer.get(), listener.get());
  EXPECT_EQ(SSL_is_init_finished(listener.get()), 0);
}

}  // namespace
}  // namespace pheromone::cluster
