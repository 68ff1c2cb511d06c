// AES-128 (FIPS 197), encryption only, and CMAC (NIST SP 800-38B, RFC 4493): with what frames are
// signed (signing.h). No branch and no address outside of one table of 256 bytes depends on a key
// or on data, so that on a processor without a cache the time says nothing.
//
//   MacKey<Aes> key;
//   key.Set(bytes);                         // 16
//   Cmac<Aes> mac(&key);
//   mac.Add(byte); ...
//   mac.Finish(tag);                        // 16
//
// A server may use another cipher with the same functions as Aes. Freestanding C++11.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace pheromone {
namespace protocol {

constexpr uint8_t kAesBlock = 16;  ///< bytes, of a key too

class Aes {
 public:
  void Set(const uint8_t* key);
  /// In place.
  void Encrypt(uint8_t* block) const;

  /// The key that was set: the first bytes of what it was expanded to.
  const uint8_t* key() const { return keys_; }

 private:
  enum : uint8_t { kRounds = 10 };
  uint8_t keys_[kAesBlock * (kRounds + 1)];
};

/// Times x in GF(2^128), as CMAC makes its subkeys.
void DoubleBlock(uint8_t* block);

template <typename Cipher>
struct MacKey {
  Cipher cipher;
  uint8_t subkey[kAesBlock];  ///< K1

  void Set(const uint8_t* key) {
    cipher.Set(key);
    for (uint8_t& byte : subkey) {
      byte = 0;
    }
    cipher.Encrypt(subkey);
    DoubleBlock(subkey);
  }
};

template <typename Cipher>
class Cmac {
 public:
  /// `key` outlives it.
  explicit Cmac(const MacKey<Cipher>* key) : key_(key) {
    for (uint8_t& byte : block_) {
      byte = 0;
    }
  }

  void Add(uint8_t byte) {
    if (filled_ == kAesBlock) {
      key_->cipher.Encrypt(block_);
      filled_ = 0;
    }
    block_[filled_++] ^= byte;
  }

  /// Nothing may follow.
  void Finish(uint8_t* tag) {
    uint8_t subkey[kAesBlock];
    for (uint8_t i = 0; i < kAesBlock; ++i) {
      subkey[i] = key_->subkey[i];
    }
    if (filled_ != kAesBlock) {
      block_[filled_] ^= 0x80u;
      DoubleBlock(subkey);
    }
    for (uint8_t i = 0; i < kAesBlock; ++i) {
      tag[i] = block_[i] ^ subkey[i];
    }
    key_->cipher.Encrypt(tag);
  }

 private:
  const MacKey<Cipher>* key_;
  uint8_t filled_ = 0;
  uint8_t block_[kAesBlock];
};

}  // namespace protocol
}  // namespace pheromone
