// AES-128 by OpenSSL, with the functions of protocol::Aes.
#pragma once

#include <openssl/evp.h>

#include <cstdint>
#include <memory>

#include "protocol/aes.h"

namespace pheromone::signing {

class EvpAes {
 public:
  EvpAes() = default;
  EvpAes(const EvpAes& other) { *this = other; }
  EvpAes(EvpAes&&) noexcept = default;
  EvpAes& operator=(const EvpAes& other);
  EvpAes& operator=(EvpAes&&) noexcept = default;
  ~EvpAes() = default;

  /// `key`: 16 bytes.
  void Set(const uint8_t* key);
  /// In place.
  void Encrypt(uint8_t* block) const;

 private:
  struct Free {
    void operator()(EVP_CIPHER_CTX* context) const { EVP_CIPHER_CTX_free(context); }
  };
  std::unique_ptr<EVP_CIPHER_CTX, Free> context_;
};

using MacKey = protocol::MacKey<EvpAes>;

}  // namespace pheromone::signing
