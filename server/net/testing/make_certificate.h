// Certificates for tests, made in memory.
#pragma once

#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <string>

#include "server/net/certificate.h"

namespace pheromone::testing {

struct CertificateOptions {
  long begins_s = -3600;  ///< from now on
  long ends_s = 3600;
  unsigned rsa_bits = 0;             ///< 0: an elliptic curve, P-256
  const char* passphrase = nullptr;  ///< of the key
};

inline std::string TakeText(BIO* bio) {
  char* text = nullptr;
  const auto size = BIO_get_mem_data(bio, &text);
  std::string taken(text, static_cast<size_t>(size));
  BIO_free(bio);
  return taken;
}

/// A certificate for localhost and 127.0.0.1 that is its own authority.
inline Certificate MakeCertificate(const CertificateOptions& options = {}) {
  EVP_PKEY* const key = options.rsa_bits > 0 ? EVP_RSA_gen(options.rsa_bits) : EVP_EC_gen("P-256");
  X509* const made = X509_new();
  X509_set_version(made, 2);
  ASN1_INTEGER_set(X509_get_serialNumber(made), 1);
  X509_gmtime_adj(X509_getm_notBefore(made), options.begins_s);
  X509_gmtime_adj(X509_getm_notAfter(made), options.ends_s);
  X509_set_pubkey(made, key);
  X509_NAME* const name = X509_get_subject_name(made);
  X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_ASC,
                             reinterpret_cast<const unsigned char*>("localhost"), -1, -1, 0);
  X509_set_issuer_name(made, name);
  X509_EXTENSION* const names =
      X509V3_EXT_conf_nid(nullptr, nullptr, NID_subject_alt_name, "DNS:localhost,IP:127.0.0.1");
  X509_add_ext(made, names, -1);
  X509_sign(made, key, EVP_sha256());

  Certificate certificate;
  BIO* const chain = BIO_new(BIO_s_mem());
  PEM_write_bio_X509(chain, made);
  certificate.chain = TakeText(chain);
  BIO* const secret = BIO_new(BIO_s_mem());
  PEM_write_bio_PKCS8PrivateKey(
      secret, key, options.passphrase != nullptr ? EVP_aes_128_cbc() : nullptr, options.passphrase,
      options.passphrase != nullptr ? static_cast<int>(std::string(options.passphrase).size()) : 0,
      nullptr, nullptr);
  certificate.key = TakeText(secret);
  X509_EXTENSION_free(names);
  X509_free(made);
  EVP_PKEY_free(key);
  return certificate;
}

}  // namespace pheromone::testing
