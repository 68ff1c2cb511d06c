#include "protocol/frame.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "protocol/testing/naive_protocol.h"
#include "protocol/testing/vectors.h"

namespace pheromone::protocol {
namespace {

using testing::Bytes;
using testing::FrameVector;
using testing::LoadFrames;
using testing::ToMessage;

constexpr uint8_t kUntouched = 0xA5;

Bytes Encoded(const Message& message) {
  Bytes wire(kMaxFrame);
  wire.resize(EncodeFrame(message, wire.data(), wire.size()));
  return wire;
}

TEST(EncodeFrame, MatchesEveryVectorThatHasABody) {
  int checked = 0;
  for (const FrameVector& vector : LoadFrames()) {
    if (!vector.body) {
      continue;
    }
    EXPECT_EQ(Encoded(ToMessage(*vector.body)), vector.wire) << vector.name;
    ++checked;
  }
  EXPECT_GE(checked, 100);
}

TEST(EncodeFrame, NeverWritesBeyondItsCapacity) {
  for (const FrameVector& vector : LoadFrames()) {
    if (!vector.body) {
      continue;
    }
    const Message message = ToMessage(*vector.body);
    for (size_t capacity = 0; capacity <= vector.wire.size() + 3; ++capacity) {
      Bytes wire(vector.wire.size() + 8, kUntouched);
      const size_t written = EncodeFrame(message, wire.data(), capacity);
      const size_t expected = capacity < vector.wire.size() ? 0 : vector.wire.size();
      ASSERT_EQ(written, expected) << vector.name << ", capacity " << capacity;
      const auto beyond =
          wire.begin() + static_cast<std::ptrdiff_t>(std::min(capacity, vector.wire.size()));
      ASSERT_TRUE(std::all_of(beyond, wire.end(), [](uint8_t b) { return b == kUntouched; }))
          << vector.name << ", capacity " << capacity;
    }
  }
}

TEST(EncodeFrame, RefusesALengthOverTheLimitAndWritesNothing) {
  Message message;
  message.id = 1;
  message.opcode = 1;
  for (unsigned length = kMaxData + 1u; length <= 255; ++length) {
    message.length = static_cast<uint8_t>(length);
    Bytes wire(600, kUntouched);
    EXPECT_EQ(EncodeFrame(message, wire.data(), wire.size()), 0u) << length;
    EXPECT_EQ(wire, Bytes(600, kUntouched)) << length;
  }
}

TEST(EncodeFrame, EqualsTheNaiveEncoderForEveryLengthAndFill) {
  for (unsigned length = 0; length <= kMaxData; ++length) {
    for (unsigned fill = 0; fill <= 0xFF; ++fill) {
      Bytes body(2 + length, static_cast<uint8_t>(fill));
      body[0] = static_cast<uint8_t>(fill + length);
      ASSERT_EQ(Encoded(ToMessage(body)), testing::NaiveEncode(body))
          << length << " bytes of " << fill;
    }
  }
}

TEST(EncodeFrame, NoFrameIsLongerThan140Bytes) {
  static_assert(kMaxFrame == 140);
  static_assert(kMaxBody == 68);
  // A bound: DLE from the ID to the last byte of DATA, which stays two short of it by its CRC.
  const FrameVector longest = testing::LoadFrame("longest_data_all_dle");
  EXPECT_EQ(longest.wire.size(), 138u);
  for (const FrameVector& vector : LoadFrames()) {
    EXPECT_LE(vector.wire.size(), kMaxFrame) << vector.name;
  }
}

TEST(MessageCrc, IsTheCrcOfTheUnstuffedBody) {
  for (const FrameVector& vector : LoadFrames()) {
    if (vector.body) {
      EXPECT_EQ(MessageCrc(ToMessage(*vector.body)), testing::NaiveCrc16(*vector.body))
          << vector.name;
    }
  }
}

}  // namespace
}  // namespace pheromone::protocol
