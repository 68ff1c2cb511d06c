// AES-128 and CMAC against FIPS 197, NIST SP 800-38A and 38B, RFC 4493, and OpenSSL.
#include "protocol/aes.h"

#include <gtest/gtest.h>
#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "protocol/signing.h"

namespace pheromone::protocol {
namespace {

using Bytes = std::vector<uint8_t>;

Bytes FromHex(const std::string& text) {
  Bytes bytes;
  for (size_t i = 0; i + 1 < text.size(); i += 2) {
    bytes.push_back(static_cast<uint8_t>(std::stoul(text.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

Bytes Encrypted(const Bytes& key, Bytes block) {
  Aes aes;
  aes.Set(key.data());
  aes.Encrypt(block.data());
  return block;
}

Bytes CmacOf(const Bytes& key, const Bytes& text) {
  MacKey<Aes> mac_key;
  mac_key.Set(key.data());
  Cmac<Aes> mac(&mac_key);
  for (const uint8_t byte : text) {
    mac.Add(byte);
  }
  Bytes tag(kAesBlock);
  mac.Finish(tag.data());
  return tag;
}

Bytes OpenSslCmac(const Bytes& key, const Bytes& text) {
  Bytes tag(kAesBlock);
  size_t size = 0;
  EXPECT_NE(EVP_Q_mac(nullptr, "CMAC", nullptr, "AES-128-CBC", nullptr, key.data(), key.size(),
                      text.data(), text.size(), tag.data(), tag.size(), &size),
            nullptr);
  return tag;
}

// Of NIST SP 800-38A and B, and RFC 4493.
const Bytes kKey = FromHex("2b7e151628aed2a6abf7158809cf4f3c");
const Bytes kText = FromHex(
    "6bc1bee22e409f96e93d7e117393172aae2d8a571e03ac9c9eb76fac45af8e51"
    "30c81c46a35ce411e5fbc1191a0a52eff69f2445df4f9b17ad2b417be66c3710");

TEST(Aes, Fips197) {
  EXPECT_EQ(Encrypted(FromHex("2b7e151628aed2a6abf7158809cf4f3c"),
                      FromHex("3243f6a8885a308d313198a2e0370734")),
            FromHex("3925841d02dc09fbdc118597196a0b32"));
  EXPECT_EQ(Encrypted(FromHex("000102030405060708090a0b0c0d0e0f"),
                      FromHex("00112233445566778899aabbccddeeff")),
            FromHex("69c4e0d86a7b0430d8cdb78070b4c55a"));
}

TEST(Aes, Sp80038aEcb) {
  const char* const expected[] = {
      "3ad77bb40d7a3660a89ecaf32466ef97", "f5d3d58503b9699de785895a96fdbaaf",
      "43b1cd7f598ece23881b00e3ed030688", "7b0c785e27e8ad3f8223207104725dd4"};
  for (std::ptrdiff_t i = 0; i < 4; ++i) {
    const Bytes block(kText.begin() + 16 * i, kText.begin() + 16 * (i + 1));
    EXPECT_EQ(Encrypted(kKey, block), FromHex(expected[i])) << i;
  }
}

TEST(Cmac, Rfc4493) {
  MacKey<Aes> key;
  key.Set(kKey.data());
  EXPECT_TRUE(std::equal(key.subkey, key.subkey + kAesBlock,
                         FromHex("fbeed618357133667c85e08f7236a8de").begin()));
  const auto of_first = [](std::ptrdiff_t size) {
    return CmacOf(kKey, Bytes(kText.begin(), kText.begin() + size));
  };
  EXPECT_EQ(of_first(0), FromHex("bb1d6929e95937287fa37d129b756746"));
  EXPECT_EQ(of_first(16), FromHex("070a16b46b4d4144f79bdd9dd04a287c"));
  EXPECT_EQ(of_first(40), FromHex("dfa66747de9ae63030ca32611497c827"));
  EXPECT_EQ(of_first(64), FromHex("51f0bebf7e3b9d92fc49741779363cfe"));
}

TEST(Cmac, Sp80038bOfTwentyBytes) {
  EXPECT_EQ(CmacOf(kKey, Bytes(kText.begin(), kText.begin() + 20)),
            FromHex("7d85449ea6ea19c823a7bf78837dfade"));
}

TEST(Cmac, IsOpenSslsOfWhateverIsSigned) {
  std::mt19937 random(20260101);
  const auto bytes = [&random](size_t size) {
    Bytes made(size);
    std::generate(made.begin(), made.end(), [&] { return static_cast<uint8_t>(random()); });
    return made;
  };
  for (int i = 0; i < 2000; ++i) {
    const Bytes key = bytes(16);
    const Bytes text = bytes(random() % 80);
    ASSERT_EQ(CmacOf(key, text), OpenSslCmac(key, text)) << i;
  }
}

TEST(ComputeMac, CoversUseCounterIdAndOpcodeBeforeData) {
  const Bytes data = {9, 8, 7};
  const Bytes text = {2, 0x78, 0x56, 0x34, 0x12, 7, 0x83, 9, 8, 7};
  MacKey<Aes> key;
  key.Set(kKey.data());
  Bytes mac(kAesBlock);
  ComputeMac(key, {MacUse::kServerFrame, 0x12345678, 7, 0x83}, data.data(), 3, mac.data());
  EXPECT_EQ(mac, OpenSslCmac(kKey, text));
}

TEST(NextCounter, IsTheSmallestAbove) {
  for (const uint32_t last : {0u, 1u, 254u, 255u, 256u, 1000u, 0xFFFFu, 0x1FFFFu}) {
    for (uint32_t more = 1; more <= 256; ++more) {
      ASSERT_EQ(NextCounter(last, (last + more) & 0xFFu, 0xFF), last + more);
    }
    EXPECT_EQ(NextCounter(last, (last + 65536) & 0xFFFFu, 0xFFFF), last + 65536);
  }
}

TEST(SameTag, EachBitCounts) {
  const uint8_t tag[kTagSize] = {1, 2, 3, 4};
  EXPECT_TRUE(SameTag(tag, tag));
  for (int bit = 0; bit < 8 * kTagSize; ++bit) {
    uint8_t other[kTagSize] = {1, 2, 3, 4};
    other[bit / 8] = static_cast<uint8_t>(other[bit / 8] ^ (1u << (bit % 8)));
    EXPECT_FALSE(SameTag(tag, other)) << bit;
  }
}

}  // namespace
}  // namespace pheromone::protocol
