#include "client_fw/sim/serial_line.h"

#include <gtest/gtest.h>

namespace pheromone::sim {
namespace {

constexpr int64_t kByteNs = 1'041'666;  // ten bits at 9600 baud

TEST(SerialLine, AByteArrivesWhenItsStopBitHasEnded) {
  SerialLine line(9600);
  line.Put(0xFA, 5'000'000);
  EXPECT_FALSE(line.Get(5'000'000 + kByteNs - 1));
  const auto arrived = line.Get(5'000'000 + kByteNs);
  ASSERT_TRUE(arrived);
  EXPECT_EQ(0xFA, arrived->byte);
  EXPECT_EQ(5'000'000 + kByteNs, arrived->time_ns);
  EXPECT_FALSE(line.Get(1'000'000'000));
}

TEST(SerialLine, BytesPutInAtOnceFollowEachOtherWithoutGaps) {
  SerialLine line(9600);
  for (uint8_t byte = 1; byte <= 3; ++byte) {
    line.Put(byte, 0);
  }
  for (uint8_t byte = 1; byte <= 3; ++byte) {
    const auto arrived = line.Get(1'000'000'000);
    ASSERT_TRUE(arrived);
    EXPECT_EQ(byte, arrived->byte);
    EXPECT_EQ(byte * kByteNs, arrived->time_ns);
  }
}

TEST(SerialLine, ALineThatWasIdleStartsAtOnce) {
  SerialLine line(9600);
  line.Put(1, 0);
  line.Put(2, 10'000'000);
  EXPECT_TRUE(line.Get(10'000'000));
  EXPECT_EQ(10'000'000 + kByteNs, line.Get(20'000'000)->time_ns);
}

}  // namespace
}  // namespace pheromone::sim
