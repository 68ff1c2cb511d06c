#include "protocol/crc16.h"

#include <gtest/gtest.h>

#include "protocol/testing/vectors.h"

namespace pheromone::protocol {
namespace {

// One byte through the shift register, as a textbook draws it: eight times, the bit that falls out
// decides whether the polynomial is subtracted.
uint16_t BitwiseUpdate(uint16_t crc, unsigned byte) {
  unsigned shift_register = crc;
  for (unsigned bit = 0; bit < 8; ++bit) {
    const unsigned out = (shift_register ^ (byte >> bit)) & 1u;
    shift_register >>= 1;
    if (out != 0) {
      shift_register ^= 0xA001u;
    }
  }
  return static_cast<uint16_t>(shift_register);
}

TEST(Crc16, EveryStepEqualsTheShiftRegister) {
  for (unsigned crc = 0; crc <= 0xFFFF; ++crc) {
    for (unsigned byte = 0; byte <= 0xFF; ++byte) {
      const auto before = static_cast<uint16_t>(crc);
      const uint16_t expected = BitwiseUpdate(before, byte);
      if (Crc16Update(before, static_cast<uint8_t>(byte)) != expected) {
        FAIL() << "register " << crc << ", byte " << byte << ": expected " << expected;
      }
    }
  }
}

TEST(Crc16, MatchesTheVectors) {
  const auto vectors = testing::LoadCrcs();
  ASSERT_GE(vectors.size(), 12u);
  for (const testing::CrcVector& vector : vectors) {
    EXPECT_EQ(Crc16(vector.bytes.data(), vector.bytes.size()), vector.crc)
        << vector.bytes.size() << " bytes";
  }
}

TEST(Crc16, ABodyFollowedByItsCrcLeavesZero) {
  for (testing::CrcVector vector : testing::LoadCrcs()) {
    vector.bytes.push_back(static_cast<uint8_t>(vector.crc & 0xFF));
    vector.bytes.push_back(static_cast<uint8_t>(vector.crc >> 8));
    EXPECT_EQ(Crc16(vector.bytes.data(), vector.bytes.size()), 0);
  }
}

TEST(Crc16, ALineOfZeroBytesPasses) {
  const uint8_t zeros[200] = {};
  for (size_t size = 0; size <= sizeof(zeros); ++size) {
    EXPECT_EQ(Crc16(zeros, size), 0) << "this is why ID 0 and opcode 0 are refused";
  }
}

}  // namespace
}  // namespace pheromone::protocol
