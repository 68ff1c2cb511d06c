// Settings sent over the radio reach the EEPROM of the image that one flashes, outlive a loss of
// power, and then rule; what is damaged there does not.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "proto_tests/avr_firmware/firmware_world.h"

namespace pheromone::firmware {
namespace {

using sim::AvrMachine;

constexpr uint8_t kSenseOne = protocol::kSense | 1;
constexpr int64_t kDefaultPeriodMs = 200;

// client_fw/boards/nonvolatile.h: version, settings and check, in one of four slots by turns.
constexpr size_t kRecordSize = 2 + client::kSettingsSize + 2;
constexpr size_t kSlots = 4;

// From one question to the next, heard on the channel; 0 if there were none. To be asked for when
// the robot has just been started or told.
// A frame's end is heard, and stuffing makes frames of one length differ by a byte.
int64_t BeginOf(const HeardFrame& heard) {
  uint8_t frame[protocol::kMaxFrame];
  const size_t bytes = protocol::EncodeFrame(heard.message, frame, sizeof(frame));
  return heard.end_ms - static_cast<int64_t>(bytes * 10'000 / 9'600);
}

int64_t PeriodOf(FirmwareWorld* world) {
  const size_t before = world->heard().size();
  if (!world->RunUntil([&] { return world->CountHeard(kSenseOne, before) >= 3; }, 8'000)) {
    return 0;
  }
  const int64_t last_ms = BeginOf(world->heard().back());
  const size_t after = world->heard().size();
  if (!world->RunUntil([&] { return world->CountHeard(kSenseOne, after) != 0; }, 8'000)) {
    return 0;
  }
  return BeginOf(world->heard().back()) - last_ms;
}

// Moments are heard in whole ms, and a request waits for a slot of 3 ms and a turn of the loop.
bool Matches(int64_t period_ms, int64_t expected_ms) {
  return period_ms >= expected_ms - 1 && period_ms <= expected_ms + 4;
}

void ExpectPeriod(int64_t expected_ms, FirmwareWorld* world) {
  const int64_t period_ms = PeriodOf(world);
  EXPECT_TRUE(Matches(period_ms, expected_ms)) << period_ms << ", not " << expected_ms;
}

// The EEPROM of a robot that was told a period of 300 ms, and then one of 400.
std::vector<uint8_t> EepromOfARobotThatWasTold() {
  FirmwareWorld world;
  EXPECT_TRUE(world.RunUntil([&] { return world.CountHeard(0x81) >= 2; }, 10'000));
  for (const int32_t period_ms : {300, 400}) {
    EXPECT_TRUE(world.Set(client::kPeriodSetting, period_ms));
    world.RunFor(300);  // 34 bytes of 3.4 ms
  }
  return world.robot().machine().eeprom();
}

TEST(AvrSettingsTest, RuleAfterALossOfPower) {
  FirmwareWorld world;
  ASSERT_TRUE(world.RunUntil([&] { return world.CountHeard(0x81) >= 2; }, 10'000));
  ExpectPeriod(kDefaultPeriodMs, &world);
  EXPECT_GT(world.WhereIsTheRobot().along_m, 0.01) << "it drives";
  ASSERT_TRUE(world.Set(client::kPeriodSetting, 350));
  ASSERT_TRUE(world.Set(client::kSpeedSetting, 0));
  world.RunFor(1'000);
  world.ResetAfter(0, AvrMachine::Cause::kPowerOn);
  ExpectPeriod(350, &world);
  const sim::PlanePose before = world.robot().true_pose();
  world.RunFor(2'000);
  const sim::PlanePose& after = world.robot().true_pose();
  EXPECT_LT(std::hypot(after.x_m - before.x_m, after.y_m - before.y_m), 0.001) << "it stands";
}

TEST(AvrSettingsTest, AreFoundInTheEepromByAnotherChipOfTheSameFirmware) {
  FirmwareWorld world(2, {}, EepromOfARobotThatWasTold());
  ExpectPeriod(400, &world);
}

TEST(AvrSettingsTest, ADamagedRecordIsIgnoredAndTheOneBeforeItRules) {
  const std::vector<uint8_t> good = EepromOfARobotThatWasTold();
  // The fourth that was saved, in slot 4 mod 4: the first was there, the second made at power-up.
  const size_t newest = 0;
  for (const size_t offset : {size_t{0}, size_t{2}, size_t{9}, kRecordSize - 1}) {
    std::vector<uint8_t> damaged = good;
    damaged[newest + offset] ^= 0x04;
    FirmwareWorld world(3, {}, damaged);
    SCOPED_TRACE(offset);
    ExpectPeriod(300, &world);
  }
}

TEST(AvrSettingsTest, DefaultsRuleIfEveryRecordIsDamaged) {
  std::vector<uint8_t> damaged = EepromOfARobotThatWasTold();
  for (size_t slot = 0; slot < kSlots; ++slot) {
    damaged[slot * kRecordSize + 5] ^= 0x80;
  }
  for (const std::vector<uint8_t>& eeprom :
       {damaged, std::vector<uint8_t>(4096, 0x00), std::vector<uint8_t>(4096, 0xFF)}) {
    FirmwareWorld world(4, {}, eeprom);
    ExpectPeriod(kDefaultPeriodMs, &world);
  }
}

TEST(AvrSettingsTest, ALossOfPowerWhileTheyAreWrittenLeavesTheOldOrTheNew) {
  FirmwareWorld world;
  ASSERT_TRUE(world.RunUntil([&] { return world.CountHeard(0x81) >= 2; }, 10'000));
  int64_t rules_ms = kDefaultPeriodMs;
  int kept = 0;
  int changed = 0;
  for (int64_t loss_ms = 0; loss_ms < 60; loss_ms += 5) {
    const int64_t told_ms = rules_ms == 300 ? 250 : 300;
    ASSERT_TRUE(world.Set(client::kPeriodSetting, static_cast<int32_t>(told_ms)));
    world.RunFor(loss_ms);
    world.ResetAfter(777'000, AvrMachine::Cause::kPowerOn);
    const int64_t period_ms = PeriodOf(&world);
    const bool is_new = Matches(period_ms, told_ms);
    ASSERT_TRUE(is_new || Matches(period_ms, rules_ms)) << period_ms << " after " << loss_ms;
    ++(is_new ? changed : kept);
    rules_ms = is_new ? told_ms : rules_ms;
  }
  EXPECT_GT(changed, 0);
  EXPECT_GT(kept, 0) << "the moments matter";
}

}  // namespace
}  // namespace pheromone::firmware
