#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <random>
#include <utility>

#include "server/core/field/field.h"
#include "server/core/field/testing/random_field.h"
#include "server/core/field/testing/trail_field.h"

namespace pheromone::field {
namespace {

using testing::At;
using testing::Between;
using testing::BytesOf;
using testing::HashFromADump;
using testing::OneIn;
using testing::Random;
using testing::RandomPoint;
using testing::TrailConfig;
using testing::TrailLaw;

TEST(Reconfigure, AChangedTauGoesOnFromThePresentValues) {
  Field field(TrailConfig());
  field.Deposit(1, {5'000'000, 5'200'000}, 8, 0);
  FieldConfig next = TrailConfig();
  next.pheromones[0].tau_ms = 1'000;
  ASSERT_TRUE(field.CheckReconfigure(next, 65'000).ok());
  field.Reconfigure(next, 65'000);  // two of eight quanta are gone
  const PoseUm pose{{5'000'000, 5'000'000}, 0};
  EXPECT_EQ(At(field, pose, 65'000).left, 4096 * 6 / 8);
  EXPECT_EQ(At(field, pose, 66'000).left, 4096 * 5 / 8);
  EXPECT_EQ(HashFromADump(field), field.hash());
}

TEST(Reconfigure, AChangedQuantumKeepsTheValue) {
  Field field(TrailConfig());
  field.Deposit(1, {5'000'000, 5'200'000}, 4, 0);
  FieldConfig next = TrailConfig();
  next.pheromones[0].quantum_micro = 250'000;
  next.pheromones[0].max_count = 4;
  field.Reconfigure(next, 0);
  EXPECT_EQ(At(field, {{5'000'000, 5'000'000}, 0}, 0).left, 2048);
  EXPECT_EQ(HashFromADump(field), field.hash());
}

TEST(Reconfigure, RefusesAnotherGeometryAndAPheromoneStillOnTheMap) {
  Field field(TrailConfig());
  FieldConfig wider = TrailConfig();
  wider.map.width_um += 1;
  const Status refused = field.CheckReconfigure(wider, 0);  // though nothing lies on it
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().find("the state is of the map"), std::string::npos) << refused.error();
  FieldConfig without = TrailConfig();
  without.pheromones.clear();
  EXPECT_TRUE(field.CheckReconfigure(without, 0).ok());
  field.Deposit(1, {0, 0}, 1, 0);
  EXPECT_FALSE(field.CheckReconfigure(without, 29'999).ok());
  EXPECT_TRUE(field.CheckReconfigure(without, 30'000).ok());
}

TEST(Reconfigure, APheromoneThatLeavesTakesItsRemainsAlong) {
  Field field(TrailConfig());
  field.Deposit(1, {0, 0}, 1, 0);
  FieldConfig without = TrailConfig();
  without.pheromones.clear();
  field.Reconfigure(without, 30'000);
  EXPECT_EQ(field.hash(), HashFromADump(field));
  EXPECT_EQ(field.node_count(), 0u);
  field.Reconfigure(TrailConfig(), 30'000);
  EXPECT_EQ(field.node_count(), 0u);
}

TEST(Reconfigure, RefusesPathsForWhichThereIsNoMemory) {
  FieldConfig config = TrailConfig();
  config.memory_bytes = BytesOf(config.map, 12, 1);
  Field field(config);
  FieldConfig next = config;
  next.paths = {{.type = 1, .count = 1, .points = {{0, 0}, {9'500'000, 0}}}};  // 96 nodes, 12 tiles
  const auto all = [](const auto&) { return true; };
  EXPECT_EQ(BytesOfLaid(next, all, all), BytesOf(config.map, 12, 1));
  EXPECT_TRUE(field.CheckReconfigure(next, 0).ok());
  field.Deposit(1, {0, 5'000'000}, 1, 0);
  EXPECT_FALSE(field.CheckReconfigure(next, 0).ok());
}

TEST(Reconfigure, PathsComeAndGoWithTheConfiguration) {
  FieldConfig config = TrailConfig();
  config.pheromones[0].tau_ms = 0;
  const Path across{.type = 1, .count = 8, .points = {{0, 5'000'000}, {10'000'000, 5'000'000}}};
  const Path up{.type = 1, .count = 8, .points = {{5'000'000, 0}, {5'000'000, 10'000'000}}};
  config.paths = {across, up};
  Field field(config);
  EXPECT_EQ(field.node_count(), 201u);
  FieldConfig next = config;
  next.paths = {up};
  field.Reconfigure(next, 0);
  EXPECT_EQ(field.node_count(), 101u);  // the crossing stays
  field.Reconfigure(config, 0);
  EXPECT_EQ(field.node_count(), 201u);
  EXPECT_EQ(HashFromADump(field), field.hash());
}

TEST(Reconfigure, APrintIsLaidAndErasedAsAPathIs) {
  FieldConfig config = TrailConfig();
  FieldConfig next = config;
  next.initial_rasters = {
      {.type = 1, .nodes = Shared<std::vector<InitialNode>>({{{3, 4}, 100}, {{5, 6}, 9'999}})}};
  Field field(config);
  field.Reconfigure(next, 7);
  EXPECT_EQ(field.LevelOf(1, {3, 4}, 7), 100u);
  EXPECT_EQ(field.LevelOf(1, {5, 6}, 7), config.pheromones[0].max_level());
  field.Reconfigure(config, 8);
  EXPECT_EQ(field.node_count(), 0u);
}

TEST(Reconfigure, WhatIsLaidIsTheLeastThatANodeHolds) {
  FieldConfig config = TrailConfig();
  Field field(config);
  field.Deposit(1, {300'000, 0}, 6, 0);
  field.Deposit(1, {400'000, 0}, 2, 0);
  FieldConfig next = config;
  next.paths = {{.type = 1, .count = 4, .points = {{300'000, 0}, {500'000, 0}}}};
  field.Reconfigure(next, 10);
  EXPECT_EQ(field.LevelOf(1, {3, 0}, 10), 6 * kLevelsPerQuantum);
  EXPECT_EQ(field.LevelOf(1, {4, 0}, 10), 4 * kLevelsPerQuantum);
  EXPECT_EQ(field.LevelOf(1, {5, 0}, 10), 4 * kLevelsPerQuantum);
}

TEST(Reconfigure, RefusesABlendInThePlaceOfAPheromoneOnTheMap) {
  FieldConfig config = TrailConfig();
  PheromoneLaw other = TrailLaw();
  other.type = 2;
  config.pheromones.push_back(other);
  Field field(config);
  field.Deposit(1, {0, 0}, 1, 0);
  FieldConfig next = config;
  next.pheromones[0] = {};
  next.pheromones[0].type = 1;
  next.pheromones[0].blend = {{2, 1000}};
  EXPECT_FALSE(field.CheckReconfigure(next, 29'999).ok());
  EXPECT_TRUE(field.CheckReconfigure(next, 30'000).ok());
}

TEST(Reconfigure, ALowerLimitIsKeptByWhatComesLater) {
  FieldConfig config = TrailConfig();
  Field field(config);
  field.Deposit(1, {0, 0}, 8, 0);
  field.Deposit(1, {800'000, 0}, 8, 0);
  FieldConfig next = config;
  next.memory_bytes = BytesOf(config.map, 1, 1);
  field.Reconfigure(next, 0);
  EXPECT_EQ(field.Deposit(1, {1'600'000, 0}, 1, 0), DepositResult::kMapFull);
  EXPECT_EQ(field.Deposit(1, {0, 0}, 1, 0), DepositResult::kDone);
  EXPECT_EQ(field.LevelOf(1, {8, 0}, 0), 8 * kLevelsPerQuantum);
}

TEST(Reconfigure, AChangedLawLosesNothingUnderALimitBelowWhatIsThere) {
  FieldConfig config = TrailConfig();
  Field field(config);
  field.Deposit(1, {0, 0}, 8, 0);
  field.Deposit(1, {800'000, 0}, 8, 0);
  config.memory_bytes = BytesOf(config.map, 1, 1);
  field.Reconfigure(config, 0);
  config.pheromones[0].tau_ms = 1'000;
  ASSERT_TRUE(field.CheckReconfigure(config, 0).ok());
  field.Reconfigure(config, 0);
  EXPECT_EQ(field.LevelOf(1, {0, 0}, 0), 8 * kLevelsPerQuantum);
  EXPECT_EQ(field.LevelOf(1, {8, 0}, 0), 8 * kLevelsPerQuantum);
  EXPECT_EQ(field.limit_bytes(), config.memory_bytes);
}

TEST(Reconfigure, WhatBeginsToDiffuseLosesNothingOnAFullMap) {
  FieldConfig config = TrailConfig();
  config.pheromones[0].tau_ms = 0;
  config.memory_bytes = BytesOf(config.map, 2, 1);
  Field field(config);
  field.Deposit(1, {0, 0}, 8, 0);
  field.Deposit(1, {800'000, 0}, 8, 0);
  config.pheromones[0].diffusion = {.exchange_q16 = 1'000};
  ASSERT_TRUE(field.CheckReconfigure(config, 0).ok());
  field.Reconfigure(config, 0);
  EXPECT_EQ(field.LevelOf(1, {0, 0}, 0), 8 * kLevelsPerQuantum);
  EXPECT_EQ(field.LevelOf(1, {8, 0}, 0), 8 * kLevelsPerQuantum);
}

// As much as it says, and not a byte less, holds all of a path of a diffusing type.
TEST(Reconfigure, RefusesAPathThatDiffusesForWhichThereIsNoMemory) {
  FieldConfig config = TrailConfig();
  config.pheromones[0].tau_ms = 0;
  config.pheromones[0].diffusion = {.exchange_q16 = 1'000};
  FieldConfig next = config;
  next.paths = {{.type = 1, .count = 1, .points = {{0, 0}, {9'500'000, 0}}}};  // in one leaf
  const auto all = [](const auto&) { return true; };
  for (const uint64_t missing : {uint64_t{0}, uint64_t{1}}) {
    config.memory_bytes = BytesOfLaid(next, all, all) - missing;
    next.memory_bytes = config.memory_bytes;
    Field field(config);
    EXPECT_EQ(field.CheckReconfigure(next, 0).ok(), missing == 0);
    if (missing == 0) {
      field.Reconfigure(next, 0);
      EXPECT_EQ(field.used_bytes(), config.memory_bytes);
      EXPECT_EQ(field.LevelOf(1, {95, 0}, 0), kLevelsPerQuantum);
    }
  }
}

// Any law to any other: what a node is worth is the same before and after, to half of what the new
// law can tell apart, and up to its maximum.
TEST(Reconfigure, AnyChangeOfTheLawKeepsTheValues) {
  Random random(99);
  int telling = 0;
  for (int round = 0; round < 300; ++round) {
    const auto random_law = [&] {
      PheromoneLaw law = TrailLaw();
      law.evaporation = static_cast<Evaporation>(random() % 3);
      law.tau_ms = OneIn(random, 4) ? 0 : Between(random, 1'000, 60'000);
      law.quantum_micro = Between(random, 1'000, 1'000'000);
      law.max_count = static_cast<uint16_t>(Between(random, 1, 200));
      return law;
    };
    FieldConfig config = TrailConfig();
    config.pheromones = {random_law()};
    Field field(config);
    for (int i = 0; i < 50; ++i) {
      field.Deposit(1, RandomPoint(random, config.map),
                    static_cast<uint16_t>(Between(random, 1, 200)),
                    static_cast<uint64_t>(Between(random, 0, 20'000)));
    }
    constexpr uint64_t kNow = 25'000;
    std::map<NodeIndex, int64_t> before;
    field.VisitLevels(1, kNow, [&](NodeIndex node, uint32_t level) {
      before[node] = int64_t{level} * config.pheromones[0].quantum_micro;
    });
    FieldConfig next = config;
    next.pheromones = {random_law()};
    const PheromoneLaw& law = next.pheromones[0];
    ASSERT_TRUE(field.CheckReconfigure(next, kNow).ok());
    field.Reconfigure(next, kNow);
    ASSERT_EQ(HashFromADump(field), field.hash());
    std::map<NodeIndex, int64_t> after;
    field.VisitLevels(1, kNow, [&](NodeIndex node, uint32_t level) {
      ASSERT_TRUE(before.contains(node));
      ASSERT_LE(level, law.max_level());
      if (law.evaporation == Evaporation::kCounter) {
        ASSERT_EQ(level % kLevelsPerQuantum, 0u);
      }
      after[node] = int64_t{level} * law.quantum_micro;
    });
    const int64_t step = law.evaporation == Evaporation::kCounter ? 64 : 1;
    for (const auto& [node, value] : before) {
      const int64_t most = int64_t{law.max_level()} * law.quantum_micro;
      const int64_t error = std::abs(after[node] - std::min(value, most));
      ASSERT_LE(2 * error, step * law.quantum_micro);
      telling += value < most && after[node] != 0 ? 1 : 0;
    }
  }
  EXPECT_GE(telling, 3'000);
}

}  // namespace
}  // namespace pheromone::field
