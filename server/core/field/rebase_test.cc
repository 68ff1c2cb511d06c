#include "server/core/field/rebase.h"

#include <gtest/gtest.h>

#include <map>
#include <memory>

#include "server/core/field/field.h"
#include "server/core/field/testing/random_field.h"
#include "server/core/field/testing/trail_field.h"

namespace pheromone::field {
namespace {

using testing::Between;
using testing::HashFromADump;
using testing::OneIn;
using testing::Random;
using testing::RandomPoint;
using testing::RandomPose;
using testing::Restored;
using testing::TrailConfig;
using testing::TrailLaw;

PheromoneLaw RandomLaw(Random& random) {
  PheromoneLaw law = TrailLaw();
  law.evaporation = static_cast<Evaporation>(random() % 3);
  law.tau_ms = OneIn(random, 4) ? 0 : Between(random, 1'000, 60'000);
  law.quantum_micro = Between(random, 1'000, 1'000'000);
  law.max_count = static_cast<uint16_t>(Between(random, 1, 200));
  return law;
}

void Begin(Field* field, const FieldConfig& next, uint64_t now_ms) {
  auto plan = std::make_shared<const LayPlan>(PlanLaying(field->config(), next));
  field->BeginReconfigure(1, std::make_shared<const FieldConfig>(next), plan, now_ms);
}

TEST(Rebase, AStateOfTheNewLawStaysAsItIs) {
  LawChange change{TrailLaw(), 1'000};
  change.from.quantum_micro *= 2;
  const NodeState stored{640, 1'000};
  EXPECT_EQ(Rebased(&change, TrailLaw(), stored), stored);
  EXPECT_EQ(Rebased(nullptr, TrailLaw(), {640, 1}), (NodeState{640, 1}));
}

TEST(Rebase, TheValueAtTheChangeGoesOnFromThen) {
  LawChange change{TrailLaw(), 61'000};  // one quantum less every 30 s
  change.from.evaporation = Evaporation::kCounter;
  change.from.tau_ms = 30'000;
  PheromoneLaw half = change.from;
  half.quantum_micro = change.from.quantum_micro / 2;
  half.max_count = 100;
  // Eight quanta at 0 s are six at 61 s, or twelve of half the worth.
  EXPECT_EQ(Rebased(&change, half, {8 * kLevelsPerQuantum, 0}),
            (NodeState{12 * kLevelsPerQuantum, 61'000}));
}

// However far the walk over earlier nodes has come, every reader sees what a change made at once
// would have left; and at the end nothing of the earlier law remains.
TEST(Rebase, ReadsAsIfAllHadBeenChangedAtOnce) {
  Random random(7);
  int walked = 0;
  for (int round = 0; round < 60; ++round) {
    FieldConfig config = TrailConfig();
    config.map.cell_um = 20'000;
    config.map.width_um = config.map.height_um = 6'000'000;
    config.pheromones = {RandomLaw(random)};
    Field lazy(config);
    Field eager(config);
    for (int i = 0; i < 400; ++i) {
      const PointUm point = RandomPoint(random, config.map);
      const auto quanta = static_cast<uint16_t>(Between(random, 1, 200));
      const auto at_ms = static_cast<uint64_t>(Between(random, 0, 20'000));
      lazy.Deposit(1, point, quanta, at_ms);
      eager.Deposit(1, point, quanta, at_ms);
    }
    FieldConfig next = config;
    next.pheromones = {RandomLaw(random)};
    uint64_t now_ms = 25'000;
    Begin(&lazy, next, now_ms);
    ++now_ms;  // which is what the change asks for, and counts as its time
    eager.Reconfigure(next, now_ms);
    const auto compare = [&] {
      std::map<NodeIndex, uint32_t> expected;
      std::map<NodeIndex, uint32_t> found;
      eager.VisitLevels(1, now_ms, [&](NodeIndex node, uint32_t it) { expected[node] = it; });
      lazy.VisitLevels(1, now_ms, [&](NodeIndex node, uint32_t it) { found[node] = it; });
      ASSERT_EQ(found, expected);
      for (int i = 0; i < 20; ++i) {
        const PoseUm pose = RandomPose(random, config.map);
        ASSERT_EQ(lazy.Sense(1, pose, now_ms), eager.Sense(1, pose, now_ms));
      }
      ASSERT_EQ(HashFromADump(lazy), lazy.hash());
    };
    constexpr int kMaxPortions = 100;
    for (int portion = 0; lazy.busy() && portion < kMaxPortions; ++portion) {
      ASSERT_NO_FATAL_FAILURE(compare()) << "round " << round;
      const PointUm point = RandomPoint(random, config.map);
      ASSERT_EQ(lazy.Deposit(1, point, 1, now_ms), eager.Deposit(1, point, 1, now_ms));
      lazy.Advance(now_ms);
      now_ms += static_cast<uint64_t>(Between(random, 0, 3'000));
      ++walked;
    }
    ASSERT_FALSE(lazy.busy());
    ASSERT_NO_FATAL_FAILURE(compare()) << "round " << round;
    lazy.ForEach([&](uint8_t, NodeIndex, NodeState state) { ASSERT_GE(state.time_ms, 25'001u); });
  }
  EXPECT_GE(walked, 60);
}

// Robots wait for a portion: however full the map is, it rewrites a row of tiles more than its
// share at most.
TEST(Rebase, APortionRewritesABoundedNumberOfNodes) {
  constexpr int32_t kSide = 512;  // 4 x 4 leaves of tiles, all full
  FieldConfig config = TrailConfig();
  config.map.cell_um = 10'000;
  config.map.width_um = config.map.height_um = (kSide - 1) * config.map.cell_um;
  config.pheromones[0].max_count = 10;
  Field field(config);
  for (int32_t row = 0; row < kSide; ++row) {
    for (int32_t column = 0; column < kSide; ++column) {
      const PointUm point{config.map.origin.x + column * config.map.cell_um,
                          config.map.origin.y + row * config.map.cell_um};
      ASSERT_EQ(field.Deposit(1, point, 5, 1), DepositResult::kDone);
    }
  }
  FieldConfig next = config;
  next.pheromones[0].quantum_micro = config.pheromones[0].quantum_micro + 5;
  Begin(&field, next, 10);
  const auto rewritten = [&] {
    int count = 0;
    field.ForEach(
        [&](uint8_t, NodeIndex, NodeState state) { count += state.time_ms > 10 ? 1 : 0; });
    return count;
  };
  constexpr int kMaxAtOnce = (Field::kTilesRebasedAtOnce + kLeafSide) * kTileSide * kTileSide;
  int before = rewritten();
  int portions = 0;
  for (; field.busy() && portions < kSide * kSide; ++portions) {
    field.Advance(11);
    const int now = rewritten();
    ASSERT_LE(now - before, kMaxAtOnce);
    before = now;
  }
  EXPECT_EQ(before, kSide * kSide);
  EXPECT_GE(portions, kSide * kSide / kMaxAtOnce);
}

TEST(Rebase, AFieldRestoredInTheMiddleGoesOnTheSame) {
  Random random(11);
  FieldConfig config = TrailConfig();
  config.map.cell_um = 10'000;
  config.map.width_um = config.map.height_um = 20'000'000;
  config.pheromones = {RandomLaw(random)};
  Field field(config);
  for (int i = 0; i < 20'000; ++i) {
    field.Deposit(1, RandomPoint(random, config.map), 100, 5);
  }
  FieldConfig next = config;
  next.pheromones[0].tau_ms = config.pheromones[0].tau_ms + 5'000;
  next.pheromones[0].quantum_micro = config.pheromones[0].quantum_micro + 5;
  Begin(&field, next, 10);
  field.Advance(11);
  ASSERT_TRUE(field.busy());
  const auto restored = Restored(field);
  ASSERT_NE(restored, nullptr);
  EXPECT_TRUE(restored->busy());
  EXPECT_EQ(restored->hash(), field.hash());
  constexpr int kMaxPortions = 1'000;
  for (int portion = 0; field.busy() && portion < kMaxPortions; ++portion) {
    field.Advance(20);
    restored->Advance(20);
    ASSERT_EQ(restored->hash(), field.hash());
    ASSERT_EQ(restored->busy(), field.busy());
  }
  EXPECT_FALSE(field.busy());
}

}  // namespace
}  // namespace pheromone::field
