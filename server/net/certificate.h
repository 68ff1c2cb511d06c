// A server's TLS certificate and its private key: checked, and made into what OpenSSL serves with.
//
//   const CheckedCertificate checked = CheckCertificate({.chain = pem, .key = key_pem});
//   if (checked.context == nullptr) { complain about checked.key_error or checked.chain_error; }
//
// TLS 1.2 and above; ciphers and curves are OpenSSL's, as the system configures them. Whether the
// certificate is valid today is a warning only: that is for clients to judge, by their own clocks.
// Any thread.
#pragma once

#include <memory>
#include <string>

struct ssl_ctx_st;  // OpenSSL's SSL_CTX

namespace pheromone {

/// In PEM.
struct Certificate {
  std::string chain;  ///< the server's certificate, followed by those of intermediate authorities
  std::string key;    ///< without a passphrase
  bool operator==(const Certificate&) const = default;
};

using TlsContext = std::shared_ptr<ssl_ctx_st>;

struct CheckedCertificate {
  TlsContext context;       ///< null if there is an error
  std::string chain_error;  ///< "found no certificate in PEM, expected ..."; empty: none
  std::string key_error;    ///< likewise
  std::string warning;      ///< "expired on Jan  2 00:00:00 2026 GMT"
  std::string valid_until;  ///< "Jan  2 00:00:00 2028 GMT"
};

CheckedCertificate CheckCertificate(const Certificate& certificate);

}  // namespace pheromone
