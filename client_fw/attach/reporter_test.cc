#include "client_fw/attach/reporter.h"

#include <gtest/gtest.h>

#include <string>

namespace pheromone::attach {
namespace {

TEST(MotionText, GivesEveryReasonToStand) {
  EXPECT_EQ("drives", MotionText(0, false, false));
  EXPECT_EQ("drives, trail lost", MotionText(0, true, false));
  EXPECT_EQ("stops: halted, until it is told to resume", MotionText(client::kHalted, false, false));
  EXPECT_EQ("stands: answers have stopped (fail-safe); off the map",
            MotionText(client::kFailSafe | client::kOffTheMap, false, true));
  for (int flag = 1; flag <= client::kPoseLost; flag *= 2) {
    EXPECT_EQ(0u, MotionText(static_cast<uint8_t>(flag), false, true).find("stands: ")) << flag;
  }
}

TEST(AlarmText, GivesEveryAlarm) {
  EXPECT_EQ("", AlarmText(0));
  EXPECT_EQ(", wheels stalled, bumper pressed",
            AlarmText(client::kStallAlarm | client::kBumperAlarm));
  for (int alarm = 1; alarm <= client::kPoseLostAlarm; alarm *= 2) {
    EXPECT_NE("", AlarmText(static_cast<uint8_t>(alarm))) << alarm;
  }
}

TEST(Silences, TheLongestMayNotHaveEnded) {
  Silences silences;
  EXPECT_EQ(0, silences.longest_ms(5000));  // before the first answer
  EXPECT_EQ(0, silences.OnAnswer(5000));
  EXPECT_EQ(300, silences.OnAnswer(5300));
  EXPECT_EQ(300, silences.longest_ms(5500));
  EXPECT_EQ(900, silences.longest_ms(6200));
  EXPECT_EQ(100, silences.OnAnswer(5400));
  EXPECT_EQ(300, silences.longest_ms(5400));
}

}  // namespace
}  // namespace pheromone::attach
