// The MAC of signed frames, word by word as in section 18 of protocol/README.md, with OpenSSL's
// CMAC.
#pragma once

#include <gtest/gtest.h>
#include <openssl/evp.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace pheromone::protocol {

inline std::vector<uint8_t> NaiveMac(const std::vector<uint8_t>& key, uint8_t use, uint32_t counter,
                                     uint8_t id, uint8_t opcode, const std::vector<uint8_t>& data) {
  std::vector<uint8_t> text = {use};
  for (int shift = 0; shift < 32; shift += 8) {
    text.push_back(static_cast<uint8_t>(counter >> shift));
  }
  text.push_back(id);
  text.push_back(opcode);
  text.insert(text.end(), data.begin(), data.end());
  std::vector<uint8_t> mac(16);
  size_t size = 0;
  EXPECT_NE(EVP_Q_mac(nullptr, "CMAC", nullptr, "AES-128-CBC", nullptr, key.data(), key.size(),
                      text.data(), text.size(), mac.data(), mac.size(), &size),
            nullptr);
  return mac;
}

}  // namespace pheromone::protocol
