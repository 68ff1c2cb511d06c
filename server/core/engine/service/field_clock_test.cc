#include "server/core/engine/service/field_clock.h"

#include <gtest/gtest.h>

#include "server/core/engine/testing/bench.h"

namespace pheromone::engine {
namespace {

constexpr int64_t kDayMs = 86'400'000;

TEST(FieldClock, AdvancesWithBootTime) {
  FieldClock clock(500);
  EXPECT_EQ(clock.Read({10'000, 0}).field_time_ms, 500u);
  EXPECT_EQ(clock.Read({10'250, 0}).field_time_ms, 750u);
}

TEST(FieldClock, NeverDecreasesAndGoesOnAfterAStepBackwards) {
  FieldClock clock;
  clock.Read({10'000, 0});
  EXPECT_EQ(clock.Read({11'000, 0}).field_time_ms, 1'000u);
  EXPECT_EQ(clock.Read({3'000, 0}).field_time_ms, 1'000u);
  EXPECT_EQ(clock.Read({3'100, 0}).field_time_ms, 1'100u);
}

TEST(FieldClock, ResumesWithTheTimeTheServerWasDown) {
  EXPECT_EQ(FieldClock::ResumeAt({5'000, 1'000'000}, 1'060'000, true), 65'000u);
}

TEST(FieldClock, ResumesWhereItWasWhenNothingEvaporatesWhileDown) {
  EXPECT_EQ(FieldClock::ResumeAt({5'000, 1'000'000}, 1'060'000, false), 5'000u);
}

TEST(FieldClock, AMachineThatWakesUpIn1970ResumesWhereItWas) {
  EXPECT_EQ(FieldClock::ResumeAt({5'000, 1'700'000'000'000}, 0, true), 5'000u);
}

TEST(FieldClock, TimeEndsWhereTheFieldCannotCountFurther) {
  const uint64_t end = kMaxFieldTimeMs;
  EXPECT_EQ(FieldClock::ResumeAt({5'000, INT64_MIN}, INT64_MAX, true), end);
  FieldClock clock(end - 1);
  clock.Read({0, 0});
  EXPECT_EQ(clock.Read({5'000, 0}).field_time_ms, end);
}

TEST(FieldClock, FollowsAnotherServersStampsAndGoesOnByItself) {
  FieldClock clock(500);
  EXPECT_EQ(clock.Read({10'000, 0}).field_time_ms, 500u);
  clock.Follow({60'000, 0}, {10'100, 0});
  EXPECT_EQ(clock.Read({10'100, 0}).field_time_ms, 60'000u);
  EXPECT_EQ(clock.Read({10'350, 0}).field_time_ms, 60'250u);
}

TEST(FieldClock, WaitsForAServerWhoseClockIsBehind) {
  FieldClock clock(10'000);
  clock.Read({0, 0});
  EXPECT_EQ(clock.Read({100, 0}).field_time_ms, 10'100u);
  clock.Follow({10'040, 0}, {100, 0});
  EXPECT_EQ(clock.Read({130, 0}).field_time_ms, 10'100u);
  EXPECT_EQ(clock.Read({190, 0}).field_time_ms, 10'130u);
}

// A trail, then a reading of the clocks as described, then the trail again: it must not have
// changed.
int16_t LeftAfter(const ClockReading& before, const ClockReading& after) {
  testing::Bench bench;
  FieldClock clock(bench.now_ms);
  bench.now_ms = clock.Read(before).field_time_ms;
  bench.Handle(testing::Hello(1, 1));
  bench.Handle(testing::Deposit(1, 1, 5000, 5200, 8));
  bench.now_ms = clock.Read(after).field_time_ms;
  protocol::SenseAnswer answer;
  const auto message = bench.Handle(testing::Sense(1));
  return message && protocol::Decode(*message, &answer) ? answer.left : int16_t{-1};
}

TEST(FieldTime, UtcJumpsOfADayEitherWayChangeNoPheromone) {
  const int64_t utc = 1'700'000'000'000;
  EXPECT_EQ(LeftAfter({1'000, utc}, {2'000, utc}), 4096);
  EXPECT_EQ(LeftAfter({1'000, utc}, {2'000, utc + kDayMs}), 4096);
  EXPECT_EQ(LeftAfter({1'000, utc}, {2'000, utc - kDayMs}), 4096);
}

TEST(FieldTime, AStartIn1970AndALaterCorrectionChangeNoPheromone) {
  EXPECT_EQ(LeftAfter({1'000, 0}, {2'000, 1'700'000'000'000}), 4096);
}

TEST(FieldTime, BootTimeSteppingBackwardsChangesNoPheromone) {
  EXPECT_EQ(LeftAfter({1'000'000, 0}, {0, 0}), 4096);
}

TEST(FieldTime, NoJumpOfTheBootTimeTurnsItBack) {
  FieldClock clock(10'000);
  clock.Read({0, 0});
  EXPECT_EQ(clock.Read({UINT64_MAX - 5'000, 0}).field_time_ms, kMaxFieldTimeMs);
}

TEST(FieldTime, PassingDoesEvaporate) {
  EXPECT_EQ(LeftAfter({1'000, 0}, {61'000, 0}), 4096 * 6 / 8);
}

}  // namespace
}  // namespace pheromone::engine
