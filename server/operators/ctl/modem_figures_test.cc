#include "server/operators/ctl/modem_figures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pheromone::ctl {
namespace {

using testing::HasSubstr;

TEST(ModemFigures, DelayCountsFromWhenTheByteLeftTheUart) {
  // 12 bytes at 9600 baud take 12.5 ms.
  EXPECT_DOUBLE_EQ(DelayMs({14.5, 12}, 9600), 2.0);
  EXPECT_DOUBLE_EQ(DelayMs({102.0, 12}, 1200), 2.0);
  EXPECT_DOUBLE_EQ(DelayMs({12.0, 12}, 9600), 0.0);  // a UART that is a little fast
}

TEST(ModemFigures, AdapterIsWhatVaries) {
  std::vector<double> delays;
  for (int i = 0; i <= 100; ++i) {
    delays.push_back(3 + 0.16 * i);  // 3 to 19 ms
  }
  delays.push_back(400);  // once the machine was busy
  const Delays found = DelaysOf(delays);
  EXPECT_DOUBLE_EQ(found.least_ms, 3.0);
  EXPECT_NEAR(found.varies_ms, 15.84, 0.2);
  EXPECT_DOUBLE_EQ(DelaysOf({5}).varies_ms, 0.0);
}

TEST(ModemFigures, DamageOfBytesIsThatOfFramesOfThem) {
  EXPECT_NEAR(DamagedBytes(785, 1000, 24), 0.01, 0.0001);  // 0.99^24 = 0.786
  EXPECT_DOUBLE_EQ(DamagedBytes(10, 10, 24), 0.0);
  EXPECT_DOUBLE_EQ(DamagedBytes(0, 10, 24), 1.0);
  EXPECT_NEAR(UnnoticedDamage(125, 24), 3.0 / 3000, 0.00001);  // the rule of three
}

TEST(ModemFigures, SettingsAreWholeMilliseconds) {
  EXPECT_EQ(RoundedUpMs(2.0), 2u);
  EXPECT_EQ(RoundedUpMs(2.1), 3u);
  EXPECT_EQ(RoundedUpMs(0.0), 0u);
}

// W = T_t + T_t + 16 + 10 + 2 B has to fit 255 ms: up to 113 ms of T_t at 9600 baud.
TEST(ModemFigures, LinkIsOneThatAServerTakes) {
  EXPECT_EQ(LinkProblems(LinkText("/dev/ttyUSB0", 9600, 113, 16)), "");
  EXPECT_THAT(LinkProblems(LinkText("/dev/ttyUSB0", 9600, 114, 16)),
              HasSubstr("response_window_ms: missing, and its default 257"));
  EXPECT_THAT(LinkProblems(LinkText("/dev/ttyUSB0", 9600, 2, 201)),
              HasSubstr("adapter_latency_ms: found 201, expected a whole number from 0 to 200"));
}

}  // namespace
}  // namespace pheromone::ctl
