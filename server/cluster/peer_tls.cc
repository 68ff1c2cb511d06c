#include "server/cluster/peer_tls.h"

#include <openssl/core_names.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/kdf.h>
#include <openssl/params.h>
#include <openssl/ssl.h>

#include <array>
#include <memory>
#include <new>
#include <utility>

namespace pheromone::cluster {
namespace {

constexpr size_t kKeyBytes = 32;
constexpr size_t kMaxIdentityBytes = 128;  // names have at most 32

template <typename T, auto kFree>
struct FreedBy {
  void operator()(T* it) const { kFree(it); }
};
using Kdf = std::unique_ptr<EVP_KDF, FreedBy<EVP_KDF, EVP_KDF_free>>;
using KdfContext = std::unique_ptr<EVP_KDF_CTX, FreedBy<EVP_KDF_CTX, EVP_KDF_CTX_free>>;
using TlsSession = std::unique_ptr<SSL_SESSION, FreedBy<SSL_SESSION, SSL_SESSION_free>>;

// What OpenSSL takes for a session that is resumed; null if it has no memory.
SSL_SESSION* MakeSession(SSL* ssl, const std::string& key) {
  static constexpr unsigned char kAes128GcmSha256[] = {0x13, 0x01};  // RFC 8446, B.4
  TlsSession session(SSL_SESSION_new());
  const SSL_CIPHER* const cipher = SSL_CIPHER_find(ssl, kAes128GcmSha256);
  const bool is_made =
      session != nullptr && cipher != nullptr && key.size() == kKeyBytes &&
      SSL_SESSION_set1_master_key(session.get(), reinterpret_cast<const unsigned char*>(key.data()),
                                  key.size()) == 1 &&
      SSL_SESSION_set_cipher(session.get(), cipher) == 1 &&
      SSL_SESSION_set_protocol_version(session.get(), TLS1_3_VERSION) == 1;
  return is_made ? session.release() : nullptr;
}

// Not the application's data, which Asio uses.
int SideIndex() {
  static const int index = SSL_get_ex_new_index(0, nullptr, nullptr, nullptr, nullptr);
  return index;
}

PeerTls::Side* SideOf(SSL* ssl) {
  return static_cast<PeerTls::Side*>(SSL_get_ex_data(ssl, SideIndex()));
}

// Who dials offers the key of the node that it asks for.
int OfferKey(SSL* ssl, const EVP_MD* /*digest*/, const unsigned char** identity, size_t* length,
             SSL_SESSION** session) {
  PeerTls::Side* const side = SideOf(ssl);
  if (side->dials.empty()) {
    return 0;
  }
  side->identity = side->tls->IdentityOf(side->tls->node(), side->dials);
  *session = MakeSession(ssl, side->tls->KeyOf(side->identity));
  *identity = reinterpret_cast<const unsigned char*>(side->identity.data());
  *length = side->identity.size();
  return *session != nullptr ? 1 : 0;
}

// Who listens has the keys of the nodes that may dial it; any other identity ends the handshake.
int FindKey(SSL* ssl, const unsigned char* identity, size_t length, SSL_SESSION** session) {
  PeerTls::Side* const side = SideOf(ssl);
  *session = nullptr;
  if (length > kMaxIdentityBytes) {
    return 0;
  }
  side->identity.assign(reinterpret_cast<const char*>(identity), length);
  for (const std::string& node : side->tls->nodes()) {
    if (node < side->tls->node() &&
        side->identity == side->tls->IdentityOf(node, side->tls->node())) {
      side->from = node;
      *session = MakeSession(ssl, side->tls->KeyOf(side->identity));
    }
  }
  return *session != nullptr ? 1 : 0;
}

}  // namespace

PeerTls::PeerTls(std::string secret, std::string cluster, std::vector<std::string> nodes,
                 std::string node)
    : secret_(std::move(secret)),
      cluster_(std::move(cluster)),
      nodes_(std::move(nodes)),
      node_(std::move(node)),
      context_(SSL_CTX_new(TLS_method()), SSL_CTX_free) {
  SSL_CTX* const context = context_.get();
  if (context == nullptr || SSL_CTX_set_min_proto_version(context, TLS1_3_VERSION) != 1 ||
      SSL_CTX_set_ciphersuites(context, "TLS_AES_128_GCM_SHA256") != 1 ||
      SSL_CTX_set_num_tickets(context, 0) != 1) {
    throw std::bad_alloc();
  }
  SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_OFF);
  SSL_CTX_set_options(context, SSL_OP_NO_COMPRESSION | SSL_OP_NO_TICKET);
  SSL_CTX_set_psk_use_session_callback(context, OfferKey);
  SSL_CTX_set_psk_find_session_callback(context, FindKey);
}

ssl_st* PeerTls::Make(Side* side) const {
  SSL* const ssl = SSL_new(context_.get());
  if (ssl == nullptr) {
    throw std::bad_alloc();
  }
  if (SSL_set_ex_data(ssl, SideIndex(), side) != 1) {
    SSL_free(ssl);
    throw std::bad_alloc();
  }
  if (!side->dials.empty()) {
    // A listener without the secret could show a certificate instead of using the key: no authority
    // is trusted, so each of them is refused.
    SSL_set_verify(ssl, SSL_VERIFY_PEER, nullptr);
  }
  return ssl;
}

bool PeerTls::IsAuthenticated(ssl_st* ssl) {
  return SSL_is_init_finished(ssl) == 1 && SSL_session_reused(ssl) == 1 &&
         SSL_version(ssl) == TLS1_3_VERSION;
}

std::string PeerTls::IdentityOf(std::string_view dialer, std::string_view listener) const {
  std::string identity = cluster_ + '/';
  identity.append(dialer).append("/").append(listener);
  return identity;
}

std::string PeerTls::KeyOf(const std::string& identity) const {
  std::string digest = "SHA256";
  std::string secret = secret_;
  std::string salt = "pheromone cluster";
  std::string info = identity;
  std::array<unsigned char, kKeyBytes> key{};
  const Kdf kdf(EVP_KDF_fetch(nullptr, "HKDF", nullptr));
  const KdfContext context(kdf != nullptr ? EVP_KDF_CTX_new(kdf.get()) : nullptr);
  const std::array<OSSL_PARAM, 5> parameters = {
      OSSL_PARAM_construct_utf8_string(OSSL_KDF_PARAM_DIGEST, digest.data(), digest.size()),
      OSSL_PARAM_construct_octet_string(OSSL_KDF_PARAM_KEY, secret.data(), secret.size()),
      OSSL_PARAM_construct_octet_string(OSSL_KDF_PARAM_SALT, salt.data(), salt.size()),
      OSSL_PARAM_construct_octet_string(OSSL_KDF_PARAM_INFO, info.data(), info.size()),
      OSSL_PARAM_construct_end()};
  const bool derived = context != nullptr && EVP_KDF_derive(context.get(), key.data(), key.size(),
                                                            parameters.data()) == 1;
  OPENSSL_cleanse(secret.data(), secret.size());
  return derived ? std::string(key.begin(), key.end()) : std::string();
}

}  // namespace pheromone::cluster
