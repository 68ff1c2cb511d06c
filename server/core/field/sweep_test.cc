// What has evaporated is given back, and nothing else is: Field::Advance at Field::NextDeadline.

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "server/core/field/field.h"
#include "server/core/field/testing/life.h"
#include "server/core/field/testing/random_field.h"
#include "server/core/field/testing/trail_field.h"
#include "server/core/field/testing/walk.h"

namespace pheromone::field {
namespace {

using testing::AdvanceTo;
using testing::BytesOf;
using testing::Client;
using testing::HashFromADump;
using testing::LiveFor;
using testing::Random;
using testing::RandomPoint;
using testing::TrailConfig;
using testing::TrailLaw;
using testing::WalkAndWatch;

constexpr uint64_t kDayMs = 86'400'000;

TEST(Sweep, TwoDaysOfTrailsLeaveWhatIsAliveAndItsMemory) {
  EXPECT_GE(LiveFor(2 * kDayMs, 1).percent(), 90);
}

TEST(Sweep, NothingIsDueWhereNothingCanDie) {
  FieldConfig config = TrailConfig();
  config.pheromones[0].tau_ms = 0;
  Field field(config);
  EXPECT_FALSE(field.NextDeadline().has_value());
  field.Deposit(1, {0, 0}, 1, 5);
  EXPECT_FALSE(field.NextDeadline().has_value());
}

TEST(Sweep, IsDueWhenTheFirstNodeDies) {
  Field field(TrailConfig());
  field.Deposit(1, {0, 0}, 3, 1'000);
  field.Deposit(1, {5'000'000, 0}, 2, 1'500);
  EXPECT_EQ(field.NextDeadline(), 61'500u);
  field.Advance(61'499);
  EXPECT_EQ(field.node_count(), 2u);
  field.Advance(61'500);
  EXPECT_EQ(field.node_count(), 1u);
  AdvanceTo(field, 90'999);
  EXPECT_EQ(field.node_count(), 1u);
  EXPECT_EQ(field.NextDeadline(), 91'000u);
  field.Advance(91'000);
  EXPECT_EQ(field.node_count(), 0u);
  EXPECT_EQ(field.used_bytes(), BytesOf(field.config().map, 0, 0));
  AdvanceTo(field, 100'000);
  EXPECT_FALSE(field.NextDeadline().has_value());
}

TEST(Sweep, IsNeverDueInThePastOnceItWasDone) {
  Random random(4);
  Field field(TrailConfig());
  uint64_t now_ms = 0;
  for (int i = 0; i < 20'000; ++i) {
    now_ms += random() % 3'000;
    field.Deposit(1, RandomPoint(random, field.config().map), 1 + random() % 8, now_ms);
    field.Advance(now_ms);
    ASSERT_TRUE(field.NextDeadline().has_value());
    ASSERT_GT(*field.NextDeadline(), now_ms);
    ASSERT_EQ(field.hash(), HashFromADump(field));
  }
}

// A year without a robot, or the server switched off for one: a bounded portion at a time.
TEST(Sweep, ALongGapIsMadeUpInPortions) {
  FieldConfig config = TrailConfig();
  config.map.width_um = 250 * int64_t{1'000'000};
  config.map.height_um = config.map.width_um;
  config.memory_bytes = 256 << 20;
  Field field(config);
  constexpr int32_t kSide = 150;
  static_assert(kSide * kSide > 2 * Field::kTilesAtOnce);
  for (int32_t i = 0; i < kSide * kSide; ++i) {
    const PointUm point{int64_t{i % kSide} * 800'000, int64_t{i / kSide} * 800'000};
    ASSERT_EQ(field.Deposit(1, point, 1, 0), DepositResult::kDone);
  }
  uint64_t now_ms = 365 * kDayMs;
  size_t before = field.tile_count();
  while (field.tile_count() != 0) {
    field.Advance(now_ms);
    ASSERT_LT(field.tile_count(), before);
    // A leaf of 256 tiles more, because leaves are looked at whole.
    ASSERT_LE(before - field.tile_count(), size_t{Field::kTilesAtOnce} + 256);
    before = field.tile_count();
    now_ms += Field::kSweepIntervalMs;
  }
  EXPECT_EQ(field.used_bytes(), BytesOf(config.map, 0, 0));
}

// The round that was under way when a type's last tile went ends all the same.
TEST(Sweep, EndsWhenTheTypeInWhichItStoppedIsEmptied) {
  FieldConfig config = TrailConfig();
  config.map.width_um = 250 * int64_t{1'000'000};
  config.map.height_um = config.map.width_um;
  config.memory_bytes = 256 << 20;
  Field field(config);
  for (int32_t i = 0; i < 150 * 150; ++i) {
    field.Deposit(1, {int64_t{i % 150} * 800'000, int64_t{i / 150} * 800'000}, 1, 0);
  }
  field.Advance(30'000);
  ASSERT_NE(field.sweep().leaf, 0) << "the portion was expected to end within the map";
  FieldEdit edit;
  edit.shape = FieldEdit::Shape::kAll;
  edit.action = FieldEdit::Action::kErase;
  ASSERT_TRUE(field.Edit(edit, 30'000).ok());
  AdvanceTo(field, 60'000);
  EXPECT_FALSE(field.NextDeadline().has_value());
}

TEST(Sweep, AMillionQuestionsLeaveItWhereItWas) {
  Random random(10);
  Field field(TrailConfig());
  for (int i = 0; i < 3'000; ++i) {
    field.Deposit(1, RandomPoint(random, field.config().map), 1 + random() % 8,
                  10 * random() % 1'000);
  }
  field.Advance(100'000);
  const SweepState sweep = field.sweep();
  const uint64_t hash = field.hash();
  for (int i = 0; i < 1'000'000; ++i) {
    field.Sense(1, {{static_cast<int64_t>(random() % 10'000'000), 5'000'000}, 0},
                random() % 1'000'000);
  }
  EXPECT_EQ(field.sweep(), sweep);
  EXPECT_EQ(field.hash(), hash);
}

TEST(Sweep, APermanentTypeIsLeftAlone) {
  FieldConfig config = TrailConfig();
  config.pheromones.push_back(TrailLaw());
  config.pheromones.back().type = 15;
  config.pheromones.back().tau_ms = 0;
  Field field(config);
  Random random(9);
  for (int i = 0; i < 500; ++i) {
    const PointUm point = RandomPoint(random, config.map);
    field.Deposit(1, point, 8, 0);
    field.Deposit(15, point, 8, 0);
  }
  const size_t nodes = field.node_count() / 2;
  AdvanceTo(field, kDayMs);
  EXPECT_EQ(field.node_count(), nodes);
  field.ForEach([](uint8_t type, NodeIndex, NodeState) { ASSERT_EQ(type, 15); });
}

TEST(Sweep, KeepsAClientWithinTheLimitThatWalksOnATrail) {
  WalkAndWatch(Client::kWalks, 1, 1'000'000);
}

TEST(Sweep, KeepsAClientWithinTheLimitThatFillsTheMap) {
  WalkAndWatch(Client::kWalks, 2, 1'000'000);
}

TEST(Sweep, KeepsAClientWithinTheLimitThatDepositsAnywhere) {
  WalkAndWatch(Client::kJumps, 1, 31'000);
}

}  // namespace
}  // namespace pheromone::field
