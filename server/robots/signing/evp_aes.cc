#include "server/robots/signing/evp_aes.h"

#include <new>
#include <stdexcept>

namespace pheromone::signing {

EvpAes& EvpAes::operator=(const EvpAes& other) {
  if (this == &other) {
    return *this;
  }
  context_.reset(other.context_ != nullptr ? EVP_CIPHER_CTX_new() : nullptr);
  if (other.context_ != nullptr &&
      (context_ == nullptr || EVP_CIPHER_CTX_copy(context_.get(), other.context_.get()) != 1)) {
    throw std::bad_alloc();
  }
  return *this;
}

void EvpAes::Set(const uint8_t* key) {
  context_.reset(EVP_CIPHER_CTX_new());
  if (context_ == nullptr) {
    throw std::bad_alloc();
  }
  if (EVP_EncryptInit_ex(context_.get(), EVP_aes_128_ecb(), nullptr, key, nullptr) != 1 ||
      EVP_CIPHER_CTX_set_padding(context_.get(), 0) != 1) {
    throw std::runtime_error("OpenSSL has no AES-128");
  }
}

void EvpAes::Encrypt(uint8_t* block) const {
  int size = 0;
  if (EVP_EncryptUpdate(context_.get(), block, &size, block, protocol::kAesBlock) != 1) {
    throw std::runtime_error("OpenSSL cannot encrypt");
  }
}

}  // namespace pheromone::signing
