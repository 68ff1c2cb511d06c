#include "server/net/certificate.h"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>

#include <limits>
#include <string_view>

namespace pheromone {
namespace {

template <typename T, auto kFree>
struct Freed {
  void operator()(T* it) const { kFree(it); }
};
using Bio = std::unique_ptr<BIO, Freed<BIO, BIO_free_all>>;
using X509Certificate = std::unique_ptr<X509, Freed<X509, X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY, EVP_PKEY_free>>;

Bio Read(std::string_view text) {
  const auto size = text.size() <= std::numeric_limits<int>::max() ? text.size() : 0;
  return Bio(BIO_new_mem_buf(text.data(), static_cast<int>(size)));
}

// OpenSSL's words for what failed last.
std::string Reason() {
  const char* words = ERR_reason_error_string(ERR_peek_last_error());
  ERR_clear_error();
  return words != nullptr ? words : "unknown error";
}

bool IsEndOfPem() {
  const auto error = ERR_peek_last_error();
  return ERR_GET_LIB(error) == ERR_LIB_PEM && ERR_GET_REASON(error) == PEM_R_NO_START_LINE;
}

std::string ToText(const ASN1_TIME* time) {
  const Bio out(BIO_new(BIO_s_mem()));
  char* text = nullptr;
  const bool printed = ASN1_TIME_print(out.get(), time) == 1;
  const auto size = BIO_get_mem_data(out.get(), &text);
  return printed && size > 0 ? std::string(text, static_cast<size_t>(size)) : "an unknown time";
}

// For the key's PEM: notes that somebody was asked, and knows none.
int NoPassphrase(char* /*buffer*/, int /*size*/, int /*writing*/, void* was_asked) {
  *static_cast<bool*>(was_asked) = true;
  return -1;
}

std::string TakeChain(SSL_CTX* context, const std::string& text, CheckedCertificate* checked) {
  const Bio in = Read(text);
  const X509Certificate own(PEM_read_bio_X509_AUX(in.get(), nullptr, NoPassphrase, nullptr));
  if (own == nullptr) {
    const bool none = IsEndOfPem();
    const std::string reason = Reason();
    return none ? "found no certificate in PEM, expected -----BEGIN CERTIFICATE-----"
                : "the certificate is damaged: " + reason;
  }
  if (SSL_CTX_use_certificate(context, own.get()) != 1) {
    return "the certificate is refused by OpenSSL: " + Reason();
  }
  for (;;) {
    X509Certificate next(PEM_read_bio_X509(in.get(), nullptr, NoPassphrase, nullptr));
    if (next == nullptr) {
      const bool end = IsEndOfPem();
      const std::string reason = Reason();
      if (!end) {
        return "a certificate after the first is damaged: " + reason;
      }
      break;
    }
    if (SSL_CTX_add0_chain_cert(context, next.get()) != 1) {
      return "a certificate after the first is refused by OpenSSL: " + Reason();
    }
    (void)next.release();  // the context has it now
  }
  checked->valid_until = ToText(X509_get0_notAfter(own.get()));
  if (X509_cmp_current_time(X509_get0_notAfter(own.get())) < 0) {
    checked->warning = "expired on " + checked->valid_until;
  } else if (X509_cmp_current_time(X509_get0_notBefore(own.get())) > 0) {
    checked->warning = "not valid before " + ToText(X509_get0_notBefore(own.get()));
  }
  return "";
}

std::string TakeKey(SSL_CTX* context, const std::string& text) {
  bool has_passphrase = false;
  const Key key(PEM_read_bio_PrivateKey(Read(text).get(), nullptr, NoPassphrase, &has_passphrase));
  if (has_passphrase) {
    ERR_clear_error();
    return "the key has a passphrase, expected one without, such as the output of `openssl pkey`";
  }
  if (key == nullptr) {
    const bool none = text.find("PRIVATE KEY-----") == std::string::npos;
    const std::string reason = Reason();
    return none ? "found no private key in PEM, expected -----BEGIN PRIVATE KEY-----"
                : "the private key is damaged: " + reason;
  }
  if (SSL_CTX_use_PrivateKey(context, key.get()) != 1 || SSL_CTX_check_private_key(context) != 1) {
    ERR_clear_error();
    return "the key does not belong to the certificate";
  }
  return "";
}

}  // namespace

CheckedCertificate CheckCertificate(const Certificate& certificate) {
  ERR_clear_error();
  CheckedCertificate checked;
  TlsContext context(SSL_CTX_new(TLS_server_method()), SSL_CTX_free);
  if (context == nullptr || SSL_CTX_set_min_proto_version(context.get(), TLS1_2_VERSION) != 1) {
    checked.chain_error = "OpenSSL does not start: " + Reason();
    return checked;
  }
  // TLS 1.2 with forward secrecy and authenticated encryption only; TLS 1.3 has nothing else.
  if (SSL_CTX_set_cipher_list(context.get(), "ECDHE+AESGCM:ECDHE+CHACHA20") != 1) {
    checked.chain_error = "OpenSSL does not start: " + Reason();
    return checked;
  }
  SSL_CTX_set_session_cache_mode(context.get(), SSL_SESS_CACHE_OFF);  // clients keep tickets
  // A client could otherwise make the server negotiate as often as it likes.
  SSL_CTX_set_options(context.get(), SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION);
  checked.chain_error = TakeChain(context.get(), certificate.chain, &checked);
  if (checked.chain_error.empty()) {
    checked.key_error = TakeKey(context.get(), certificate.key);
  }
  if (checked.chain_error.empty() && checked.key_error.empty()) {
    checked.context = std::move(context);
  }
  return checked;
}

}  // namespace pheromone
