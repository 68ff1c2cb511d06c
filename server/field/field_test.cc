#include "server/field/field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <set>

namespace pheromone::field {
namespace {

PheromoneLaw Trail() {
  PheromoneLaw law;
  law.type = 1;
  law.name = "trail";
  law.core_um = 100'000;
  law.sigma_um = 400'000;
  law.tau_ms = 30'000;
  law.quantum_micro = 125'000;
  law.max_count = 8;
  return law;
}

FieldConfig Config() {
  FieldConfig config;
  config.map = {
      .origin = {0, 0}, .width_um = 10'000'000, .height_um = 10'000'000, .cell_um = 100'000};
  config.antenna_distance_um = 330'000;
  config.pheromones = {Trail()};
  config.memory_bytes = 64 << 20;
  return config;
}

uint64_t HashFromADump(const Field& field) {
  uint64_t sum = 0;
  field.ForEach([&](uint8_t type, NodeIndex node, NodeState state) {
    sum += Field::NodeHash(*field.FindLaw(type), node, state);
  });
  return sum;
}

Intensities At(const Field& field, PoseUm pose, uint64_t now_ms) {
  return field.Sense(1, pose, now_ms).value_or(Intensities{-1, -1});
}

TEST(AntennasOf, AreLeftAndRightOfTheHeading) {
  const Antennas east = AntennasOf({{0, 0}, 0}, DirectionOf(0), 330'000);
  EXPECT_EQ(east.left, (PointUm{0, 165'000}));
  EXPECT_EQ(east.right, (PointUm{0, -165'000}));
  const Antennas north = AntennasOf({{0, 0}, 16384}, DirectionOf(16384), 330'000);
  EXPECT_EQ(north.left, (PointUm{-165'000, 0}));
  EXPECT_EQ(north.right, (PointUm{165'000, 0}));
}

// Eq. (5) as printed: x_R = x - b/2 sin phi, y_R = y - b/2 cos phi, x_L, y_L with plus. It is right
// for headings counted clockwise, that is, it equals ours at -phi.
TEST(AntennasOf, EquationFiveAsPrintedEqualsOursAtMinusPhi) {
  std::mt19937 random(5);
  for (int i = 0; i < 65536; ++i) {
    const auto phi = static_cast<uint16_t>(i);
    const auto minus_phi = static_cast<uint16_t>(-i);
    const PointUm p{static_cast<int64_t>(random() % 1'000'000), 42};
    const int64_t b = 1 + static_cast<int64_t>(random() % 1'000'000);
    const DirectionQ14 h = DirectionOf(phi);
    const int64_t half_b_sin = RoundDiv(b * h.sin, 32768);
    const int64_t half_b_cos = RoundDiv(b * h.cos, 32768);
    const Antennas ours = AntennasOf({p, minus_phi}, DirectionOf(minus_phi), b);
    ASSERT_EQ(ours.left, (PointUm{p.x + half_b_sin, p.y + half_b_cos})) << i;
    ASSERT_EQ(ours.right, (PointUm{p.x - half_b_sin, p.y - half_b_cos})) << i;
  }
}

TEST(SpreadQ16, IsTheZShapeOfEquationOne) {
  const PheromoneLaw law = Trail();
  const auto spread = [&](int64_t d) { return SpreadQ16(law, d * d); };
  EXPECT_EQ(spread(0), 65536u);
  EXPECT_EQ(spread(100'000), 65536u);
  EXPECT_EQ(spread(200'000), 65536u * 3 / 4);
  EXPECT_EQ(spread(300'000), 65536u / 2);
  EXPECT_EQ(spread(500'000), 0u);
  EXPECT_EQ(spread(500'001), 0u);
}

TEST(Field, SmellsTheStrongerSideOnTheSideOfTheSource) {
  Field field(Config());
  ASSERT_EQ(field.Deposit(1, {5'200'000, 5'200'000}, 8, 0), DepositResult::kDone);
  const Intensities p = At(field, {{5'000'000, 5'000'000}, 0}, 0);
  EXPECT_GT(p.left, p.right);
}

TEST(Field, OneSourceAtFullStrengthIsOneUnit) {
  Field field(Config());
  field.Deposit(1, {5'000'000, 5'200'000}, 8, 0);
  // The left antenna is 35 mm from the node: within the core, and the node on the axle line counts.
  EXPECT_EQ(At(field, {{5'000'000, 5'000'000}, 0}, 0).left, 4096);
}

TEST(Field, WhatIsBehindTheAxleLineIsInvisibleUnlessTheLawSaysOtherwise) {
  FieldConfig config = Config();
  config.pheromones.push_back(Trail());
  config.pheromones.back().type = 2;
  config.pheromones.back().directional = false;
  Field field(config);
  const PointUm behind{4'900'000, 5'000'000};
  field.Deposit(1, behind, 8, 0);
  field.Deposit(2, behind, 8, 0);
  const PoseUm pose{{5'000'000, 5'000'000}, 0};
  EXPECT_EQ(At(field, pose, 0), (Intensities{0, 0}));
  EXPECT_GT(field.Sense(2, pose, 0)->left, 0);
}

TEST(Field, AnAntennaMayLeaveTheMap) {
  Field field(Config());
  field.Deposit(1, {0, 0}, 8, 0);
  EXPECT_GT(At(field, {{0, 0}, 0}, 0).right, 0);
  const MapGeometry& map = field.config().map;
  const PoseUm corner{{map.width_um, map.height_um}, 8192};
  EXPECT_EQ(At(field, corner, 0), (Intensities{0, 0}));
}

TEST(Field, SaysWhyItCannotSense) {
  const Field field(Config());
  SenseError error = SenseError::kNone;
  EXPECT_FALSE(field.Sense(1, {{10'000'001, 0}, 0}, 0, &error).has_value());
  EXPECT_EQ(error, SenseError::kOffTheMap);
  EXPECT_FALSE(field.Sense(2, {{0, 0}, 0}, 0, &error).has_value());
  EXPECT_EQ(error, SenseError::kUnknownPheromone);
}

TEST(Field, SaysWhyItCannotDeposit) {
  Field field(Config());
  EXPECT_EQ(field.Deposit(1, {-1, 0}, 1, 0), DepositResult::kOffTheMap);
  EXPECT_EQ(field.Deposit(7, {0, 0}, 1, 0), DepositResult::kUnknownPheromone);
  EXPECT_EQ(field.node_count(), 0u);
}

TEST(Field, ATrailEvaporatesQuantumByQuantum) {
  Field field(Config());
  field.Deposit(1, {5'000'000, 5'200'000}, 8, 1'000);
  const PoseUm pose{{5'000'000, 5'000'000}, 0};
  EXPECT_EQ(At(field, pose, 30'999).left, 4096);
  EXPECT_EQ(At(field, pose, 31'000).left, 4096 * 7 / 8);
  EXPECT_EQ(At(field, pose, 1'000 + 8 * 30'000).left, 0);
}

TEST(Field, TimeSteppingBackwardsChangesNoPheromone) {
  Field field(Config());
  field.Deposit(1, {5'000'000, 5'200'000}, 8, 1'000'000);
  const PoseUm pose{{5'000'000, 5'000'000}, 0};
  const Intensities before = At(field, pose, 1'000'000);
  EXPECT_EQ(At(field, pose, 0), before);
  EXPECT_EQ(field.Deposit(1, {5'000'000, 5'200'000}, 1, 0), DepositResult::kDone);
  EXPECT_EQ(At(field, pose, 1'000'000), before);
}

TEST(Field, AFullMapRefusesNewTilesButServesTheOldOnes) {
  FieldConfig config = Config();
  config.memory_bytes = 2 * CellMap::kTileBytes;
  Field field(config);
  EXPECT_EQ(field.Deposit(1, {0, 0}, 1, 0), DepositResult::kDone);
  EXPECT_EQ(field.Deposit(1, {800'000, 0}, 1, 0), DepositResult::kDone);
  EXPECT_EQ(field.Deposit(1, {1'600'000, 0}, 1, 0), DepositResult::kMapFull);
  EXPECT_EQ(field.Deposit(1, {100'000, 0}, 1, 0), DepositResult::kDone);
  EXPECT_EQ(HashFromADump(field), field.hash());
}

TEST(Field, AFullMapTakesBackWhatHasEvaporated) {
  FieldConfig config = Config();
  config.memory_bytes = 2 * CellMap::kTileBytes;
  Field field(config);
  field.Deposit(1, {0, 0}, 1, 0);
  field.Deposit(1, {800'000, 0}, 2, 0);
  EXPECT_EQ(field.Deposit(1, {1'600'000, 0}, 1, 30'000), DepositResult::kDone);
  EXPECT_EQ(field.node_count(), 2u);
  EXPECT_EQ(HashFromADump(field), field.hash());
}

// Deposits of different lifetimes on a map that stays nearly full, against a map without a limit:
// what is refused is only what would not fit beside what is alive.
TEST(Field, AFullMapForgetsTheDeadAndOnlyTheDead) {
  std::mt19937 random(8);
  FieldConfig config = Config();
  config.map.cell_um = 1'000'000;  // 11 x 11 nodes in four tiles
  config.pheromones[0].tau_ms = 100;
  config.memory_bytes = 2 * CellMap::kTileBytes;
  FieldConfig unlimited = config;
  unlimited.memory_bytes = 64 << 20;
  Field small(config);
  Field large(unlimited);
  int refused = 0;
  int taken = 0;
  for (uint64_t now_ms = 0; now_ms < 400'000; now_ms += random() % 200) {
    const PointUm point{static_cast<int64_t>(random() % 11) * 1'000'000,
                        static_cast<int64_t>(random() % 11) * 1'000'000};
    const auto quanta = static_cast<uint16_t>(1 + random() % 8);
    if (small.Deposit(1, point, quanta, now_ms) == DepositResult::kDone) {
      large.Deposit(1, point, quanta, now_ms);
      ++taken;
    } else {
      std::set<std::pair<int32_t, int32_t>> alive;
      large.ForEach([&](uint8_t, NodeIndex node, NodeState state) {
        if (CountAt(config.pheromones[0], state, now_ms) != 0) {
          alive.emplace(node.column / 8, node.row / 8);
        }
      });
      ASSERT_EQ(alive.size(), 2u) << now_ms;
      ++refused;
    }
    const PoseUm pose{point, static_cast<uint16_t>(random())};
    ASSERT_EQ(At(small, pose, now_ms), At(large, pose, now_ms));
    ASSERT_EQ(HashFromADump(small), small.hash());
  }
  EXPECT_GT(refused, 100);
  EXPECT_GT(taken, 100);
}

TEST(Field, TheHashIsTheSumOverADump) {
  std::mt19937 random(3);
  FieldConfig config = Config();
  config.pheromones.push_back(Trail());
  config.pheromones.back().type = 2;
  config.pheromones.back().tau_ms = 0;
  Field field(config);
  for (int i = 0; i < 5'000; ++i) {
    const PointUm point{static_cast<int64_t>(random() % 10'000'000),
                        static_cast<int64_t>(random() % 10'000'000)};
    field.Deposit(static_cast<uint8_t>(1 + random() % 2), point, 1, random() % 1'000'000);
  }
  EXPECT_NE(field.hash(), 0u);
  EXPECT_EQ(HashFromADump(field), field.hash());
}

TEST(Field, TheHashDoesNotKnowInWhichOrderNodesWereMade) {
  Field one(Config());
  Field two(Config());
  one.Deposit(1, {0, 0}, 1, 5);
  one.Deposit(1, {5'000'000, 0}, 2, 5);
  two.Deposit(1, {5'000'000, 0}, 2, 5);
  two.Deposit(1, {0, 0}, 1, 5);
  EXPECT_EQ(one.hash(), two.hash());
}

TEST(Reconfigure, AChangedTauGoesOnFromThePresentValues) {
  Field field(Config());
  field.Deposit(1, {5'000'000, 5'200'000}, 8, 0);
  FieldConfig next = Config();
  next.pheromones[0].tau_ms = 1'000;
  ASSERT_TRUE(field.CheckReconfigure(next, 65'000).ok());
  field.Reconfigure(next, 65'000);  // two of eight quanta are gone
  const PoseUm pose{{5'000'000, 5'000'000}, 0};
  EXPECT_EQ(At(field, pose, 65'000).left, 4096 * 6 / 8);
  EXPECT_EQ(At(field, pose, 66'000).left, 4096 * 5 / 8);
  EXPECT_EQ(HashFromADump(field), field.hash());
}

TEST(Reconfigure, AChangedQuantumKeepsTheValue) {
  Field field(Config());
  field.Deposit(1, {5'000'000, 5'200'000}, 4, 0);
  FieldConfig next = Config();
  next.pheromones[0].quantum_micro = 250'000;
  next.pheromones[0].max_count = 4;
  field.Reconfigure(next, 0);
  EXPECT_EQ(At(field, {{5'000'000, 5'000'000}, 0}, 0).left, 2048);
  EXPECT_EQ(HashFromADump(field), field.hash());
}

TEST(Reconfigure, RefusesAnotherGeometryAndAPheromoneStillOnTheMap) {
  Field field(Config());
  FieldConfig wider = Config();
  wider.map.width_um += 1;
  EXPECT_FALSE(field.CheckReconfigure(wider, 0).ok());
  FieldConfig without = Config();
  without.pheromones.clear();
  EXPECT_TRUE(field.CheckReconfigure(without, 0).ok());
  field.Deposit(1, {0, 0}, 1, 0);
  EXPECT_FALSE(field.CheckReconfigure(without, 29'999).ok());
  EXPECT_TRUE(field.CheckReconfigure(without, 30'000).ok());
}

TEST(Reconfigure, APheromoneThatLeavesTakesItsRemainsAlong) {
  Field field(Config());
  field.Deposit(1, {0, 0}, 1, 0);
  FieldConfig without = Config();
  without.pheromones.clear();
  field.Reconfigure(without, 30'000);
  EXPECT_EQ(field.hash(), 0u);
  EXPECT_EQ(field.node_count(), 0u);
  field.Reconfigure(Config(), 30'000);
  EXPECT_EQ(field.node_count(), 0u);
}

TEST(Reconfigure, RefusesPathsForWhichThereIsNoMemory) {
  FieldConfig config = Config();
  config.memory_bytes = 12 * CellMap::kTileBytes;
  Field field(config);
  FieldConfig next = config;
  next.paths = {{.type = 1, .count = 1, .points = {{0, 0}, {9'500'000, 0}}}};  // 96 nodes, 12 tiles
  EXPECT_EQ(TilesOfPaths(next, [](const Path&) { return true; }), 12u);
  EXPECT_TRUE(field.CheckReconfigure(next, 0).ok());
  field.Deposit(1, {0, 5'000'000}, 1, 0);
  EXPECT_FALSE(field.CheckReconfigure(next, 0).ok());
}

TEST(Reconfigure, PathsComeAndGoWithTheConfiguration) {
  FieldConfig config = Config();
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

}  // namespace
}  // namespace pheromone::field
