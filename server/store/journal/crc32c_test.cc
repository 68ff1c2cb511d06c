#include "server/store/journal/crc32c.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace pheromone::journal {
namespace {

// Bit by bit, from the definition.
uint32_t Naive(const std::string& bytes) {
  uint32_t crc = 0xFFFFFFFF;
  for (const char c : bytes) {
    crc ^= static_cast<uint8_t>(c);
    for (int bit = 0; bit < 8; ++bit) {
      crc = (crc & 1) != 0 ? (crc >> 1) ^ 0x82F63B78 : crc >> 1;
    }
  }
  return ~crc;
}

TEST(Crc32c, TheVectorsOfRfc3720) {
  std::string ascending;
  std::string descending;
  for (int i = 0; i < 32; ++i) {
    ascending += static_cast<char>(i);
    descending += static_cast<char>(31 - i);
  }
  EXPECT_EQ(Crc32c(std::string(32, '\0')), 0x8A9136AAu);
  EXPECT_EQ(Crc32c(std::string(32, '\xFF')), 0x62A8AB43u);
  EXPECT_EQ(Crc32c(ascending), 0x46DD794Eu);
  EXPECT_EQ(Crc32c(descending), 0x113FDB5Cu);
  EXPECT_EQ(Crc32c("123456789"), 0xE3069283u);
  EXPECT_EQ(Crc32c(""), 0u);
}

TEST(Crc32c, EveryLengthAndEverySplitGiveTheSame) {
  std::mt19937_64 random(1);
  std::string bytes;
  for (size_t length = 0; length < 40; ++length) {
    ASSERT_EQ(Crc32c(bytes), Naive(bytes));
    for (size_t split = 0; split <= length; ++split) {
      ASSERT_EQ(Crc32c(bytes.substr(split), Crc32c(bytes.substr(0, split))), Naive(bytes));
    }
    bytes += static_cast<char>(random());
  }
}

}  // namespace
}  // namespace pheromone::journal
