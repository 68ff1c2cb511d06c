#include "protocol/byte_order.h"

#include <gtest/gtest.h>

#include <array>

namespace pheromone::protocol {
namespace {

TEST(ByteOrder, SixteenBitsAreLittleEndianForEveryValue) {
  for (int value = 0; value <= 0xFFFF; ++value) {
    uint8_t bytes[2] = {};
    PutU16(bytes, static_cast<uint16_t>(value));
    ASSERT_EQ(bytes[0], value % 256);
    ASSERT_EQ(bytes[1], value / 256);
    ASSERT_EQ(GetU16(bytes), value);
  }
}

TEST(ByteOrder, SignedSixteenBitsAreTwosComplementForEveryValue) {
  for (int value = -32768; value <= 32767; ++value) {
    const int raw = value < 0 ? value + 65536 : value;
    uint8_t bytes[2] = {};
    PutI16(bytes, static_cast<int16_t>(value));
    ASSERT_EQ(bytes[0], raw % 256);
    ASSERT_EQ(bytes[1], raw / 256);
    ASSERT_EQ(GetI16(bytes), value);
  }
}

// Value, and its bytes by hand.
struct Wide {
  int64_t value;
  std::array<uint8_t, 4> bytes;
};

constexpr Wide kSigned[] = {
    {0, {0x00, 0x00, 0x00, 0x00}},           {1, {0x01, 0x00, 0x00, 0x00}},
    {-1, {0xFF, 0xFF, 0xFF, 0xFF}},          {-2, {0xFE, 0xFF, 0xFF, 0xFF}},
    {32768, {0x00, 0x80, 0x00, 0x00}},       {-32769, {0xFF, 0x7F, 0xFF, 0xFF}},
    {0x12345678, {0x78, 0x56, 0x34, 0x12}},  {-0x12345678, {0x88, 0xA9, 0xCB, 0xED}},
    {2147483647, {0xFF, 0xFF, 0xFF, 0x7F}},  {-2147483647, {0x01, 0x00, 0x00, 0x80}},
    {-2147483648, {0x00, 0x00, 0x00, 0x80}},
};

TEST(ByteOrder, SignedThirtyTwoBitsMatchBytesByHand) {
  for (const Wide& wide : kSigned) {
    std::array<uint8_t, 4> bytes{};
    PutI32(bytes.data(), static_cast<int32_t>(wide.value));
    EXPECT_EQ(bytes, wide.bytes) << wide.value;
    EXPECT_EQ(GetI32(wide.bytes.data()), wide.value);
  }
}

TEST(ByteOrder, UnsignedThirtyTwoBitsMatchBytesByHand) {
  for (const Wide& wide : kSigned) {
    const int64_t raw = wide.value < 0 ? wide.value + (int64_t{1} << 32) : wide.value;
    std::array<uint8_t, 4> bytes{};
    PutU32(bytes.data(), static_cast<uint32_t>(raw));
    EXPECT_EQ(bytes, wide.bytes) << raw;
    EXPECT_EQ(GetU32(wide.bytes.data()), raw);
  }
}

}  // namespace
}  // namespace pheromone::protocol
