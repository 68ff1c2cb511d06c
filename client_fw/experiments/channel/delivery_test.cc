#include "client_fw/experiments/channel/delivery.h"

#include <gtest/gtest.h>

namespace pheromone::swarm {
namespace {

constexpr DeliveryRecord::Rules kTwoSeconds = {
    .period_ms = 200, .deadline_ms = 500, .from_ms = 0, .to_ms = 2000};

// Due at 100, 300 ... 1500 with a deadline within the two seconds: eight requests.
TEST(DeliveryRecord, CountsEachRequestThatIsAnsweredInItsPeriod) {
  DeliveryRecord record(kTwoSeconds);
  record.StartClock(100);
  for (int64_t due_ms = 100; due_ms <= 1900; due_ms += 200) {
    record.OnAnswer(due_ms + 35);
  }
  record.Finish();
  EXPECT_EQ(8, record.due());
  EXPECT_EQ(8, record.delivered());
  EXPECT_EQ(10, record.answers());
  EXPECT_EQ(std::vector<int64_t>(8, 35), record.latencies_ms());
  EXPECT_EQ(200, record.longest_gap_ms());
}

TEST(DeliveryRecord, ARequestNeverAnsweredIsLost) {
  DeliveryRecord record(kTwoSeconds);
  record.StartClock(100);
  record.Finish();
  EXPECT_EQ(8, record.due());
  EXPECT_EQ(0, record.delivered());
  EXPECT_EQ(2000, record.longest_gap_ms());
}

TEST(DeliveryRecord, WhatBecameDueDuringALongExchangeIsLost) {
  DeliveryRecord record(kTwoSeconds);
  record.StartClock(100);
  record.OnAnswer(340);  // of the one due at 100; passes over 300
  record.OnAnswer(530);
  record.Finish();
  EXPECT_EQ((std::vector<int64_t>{240, 30}), record.latencies_ms());
  EXPECT_EQ(2, record.delivered());
  EXPECT_EQ(8, record.due());
}

TEST(DeliveryRecord, AnAnswerAfterTheDeadlineDoesNotCount) {
  DeliveryRecord record(kTwoSeconds);
  record.StartClock(100);
  record.OnAnswer(600);
  record.Finish();
  EXPECT_EQ(1, record.delivered());  // on the deadline
  DeliveryRecord late(kTwoSeconds);
  late.StartClock(100);
  late.OnAnswer(601);
  late.Finish();
  EXPECT_EQ(0, late.delivered());
  EXPECT_EQ(std::vector<int64_t>{501}, late.latencies_ms());
}

// The robot's clock jitters about the observer's: answers at 299 and 301, 499 and 501.
TEST(DeliveryRecord, ClocksThatMeetDoNotLoseEverySecondRequest) {
  DeliveryRecord record(kTwoSeconds);
  record.StartClock(100);
  for (const int64_t ms : {101, 299, 501, 699, 901, 1099, 1301, 1499, 1701}) {
    record.OnAnswer(ms);
  }
  record.Finish();
  EXPECT_EQ(8, record.due());
  EXPECT_GE(record.delivered(), 7);
}

TEST(DeliveryRecord, CatchingUpWithinTheDeadlineCounts) {
  DeliveryRecord record(kTwoSeconds);
  record.StartClock(100);
  record.OnAnswer(340);  // 300 was passed over
  record.OnAnswer(370);  // and made good
  record.OnAnswer(380);  // one too many
  record.Finish();
  EXPECT_EQ(2, record.delivered());
}

TEST(DeliveryRecord, ANewClockLosesWhatTheOldOneOwed) {
  DeliveryRecord record(kTwoSeconds);
  record.StartClock(100);
  record.StartClock(750);  // 100, 300, 500, 700 were due
  record.OnAnswer(760);
  record.Finish();
  EXPECT_EQ(4 + 4, record.due());  // and 750, 950, 1150, 1350
  EXPECT_EQ(1, record.delivered());
}

TEST(DeliveryRecord, OnlyWhatIsDueWithinTheTimeLookedAtCounts) {
  DeliveryRecord record({.period_ms = 200, .deadline_ms = 500, .from_ms = 1000, .to_ms = 2000});
  record.StartClock(100);
  record.OnAnswer(150);
  record.Finish();
  EXPECT_EQ(3, record.due());  // 1100, 1300, 1500
  EXPECT_EQ(0, record.answers());
  EXPECT_EQ(1000, record.longest_gap_ms());
}

}  // namespace
}  // namespace pheromone::swarm
