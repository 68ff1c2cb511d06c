#include "server/core/field/field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <set>
#include <vector>

#include "server/core/field/testing/random_field.h"
#include "server/core/field/testing/trail_field.h"

namespace pheromone::field {
namespace {

using testing::At;
using testing::BytesOf;
using testing::HashFromADump;
using testing::TrailConfig;
using testing::TrailLaw;

constexpr uint16_t kLeftOfAxle = 16384;

TEST(AntennasOf, AreLeftAndRightOfTheHeading) {
  const AntennaGeometry geometry{.distance_um = 330'000};
  const Antennas east = AntennasOf({{0, 0}, 0}, geometry);
  EXPECT_EQ(east.left, (PointUm{0, 165'000}));
  EXPECT_EQ(east.right, (PointUm{0, -165'000}));
  const Antennas north = AntennasOf({{0, 0}, kLeftOfAxle}, geometry);
  EXPECT_EQ(north.left, (PointUm{-165'000, 0}));
  EXPECT_EQ(north.right, (PointUm{165'000, 0}));
}

TEST(AntennasOf, MayStandForwardAndAtAnyAngle) {
  const AntennaGeometry geometry{.distance_um = 200'000, .forward_um = 50'000, .angle = 8192};
  const Antennas east = AntennasOf({{1'000, 0}, 0}, geometry);
  EXPECT_EQ(east.left, (PointUm{121'709, 70'709}));  // 100 000 * 11 585 / 16 384 = 70 709.2
  EXPECT_EQ(east.right, (PointUm{121'709, -70'709}));
  const AntennaGeometry ahead{.distance_um = 200'000, .forward_um = -30'000, .angle = 0};
  const Antennas west = AntennasOf({{0, 7}, 32768}, ahead);
  EXPECT_EQ(west.left, (PointUm{-70'000, 7}));
  EXPECT_EQ(west.right, west.left);
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
    const Antennas ours = AntennasOf({p, minus_phi}, {.distance_um = b});
    ASSERT_EQ(ours.left, (PointUm{p.x + half_b_sin, p.y + half_b_cos})) << i;
    ASSERT_EQ(ours.right, (PointUm{p.x - half_b_sin, p.y - half_b_cos})) << i;
  }
}

TEST(Field, SmellsTheStrongerSideOnTheSideOfTheSource) {
  Field field(TrailConfig());
  ASSERT_EQ(field.Deposit(1, {5'200'000, 5'200'000}, 8, 0), DepositResult::kDone);
  const Intensities p = At(field, {{5'000'000, 5'000'000}, 0}, 0);
  EXPECT_GT(p.left, p.right);
}

TEST(Field, OneSourceAtFullStrengthIsOneUnit) {
  Field field(TrailConfig());
  field.Deposit(1, {5'000'000, 5'200'000}, 8, 0);
  // The left antenna is 35 mm from the node: within the core, and the node on the axle line counts.
  EXPECT_EQ(At(field, {{5'000'000, 5'000'000}, 0}, 0).left, 4096);
}

TEST(Field, ARepellentSmellsTheOtherWayRound) {
  FieldConfig config = TrailConfig();
  config.pheromones[0].weight_milli = -500;
  Field field(config);
  field.Deposit(1, {5'000'000, 5'200'000}, 8, 0);
  EXPECT_EQ(At(field, {{5'000'000, 5'000'000}, 0}, 0).left, -2048);
}

TEST(Field, ABlendSmellsOfItsPartsAndTakesNoDeposit) {
  FieldConfig config = TrailConfig();
  PheromoneLaw alarm = TrailLaw();
  alarm.type = 2;
  alarm.weight_milli = 100;  // a blend has weights of its own
  PheromoneLaw blend;
  blend.type = 3;
  blend.blend = {{1, 1000}, {2, -250}};
  config.pheromones = {TrailLaw(), alarm, blend};
  Field field(config);
  const PointUm point{5'000'000, 5'200'000};
  const PoseUm pose{{5'000'000, 5'000'000}, 0};
  field.Deposit(1, point, 8, 0);
  field.Deposit(2, point, 8, 0);
  EXPECT_EQ(field.Sense(3, pose, 0)->left, 4096 * 3 / 4);
  EXPECT_EQ(field.Deposit(3, point, 8, 0), DepositResult::kNotPermitted);
}

TEST(Field, WhatIsBehindTheAxleLineIsInvisibleUnlessTheLawSaysOtherwise) {
  FieldConfig config = TrailConfig();
  config.pheromones.push_back(TrailLaw());
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
  Field field(TrailConfig());
  field.Deposit(1, {0, 0}, 8, 0);
  EXPECT_GT(At(field, {{0, 0}, 0}, 0).right, 0);
  const MapGeometry& map = field.config().map;
  const PoseUm corner{{map.width_um, map.height_um}, 8192};
  EXPECT_EQ(At(field, corner, 0), (Intensities{0, 0}));
}

TEST(Field, SaysWhyItCannotSense) {
  const Field field(TrailConfig());
  SenseError error = SenseError::kNone;
  EXPECT_FALSE(field.Sense(1, {{10'000'001, 0}, 0}, 0, &error).has_value());
  EXPECT_EQ(error, SenseError::kOffTheMap);
  for (const uint8_t type : std::vector<uint8_t>{0, 2, 15, 16, 255}) {
    EXPECT_FALSE(field.Sense(type, {{0, 0}, 0}, 0, &error).has_value());
    EXPECT_EQ(error, SenseError::kUnknownPheromone);
  }
}

TEST(Field, ManyAntennasAreRefusedAllTogether) {
  const Field field(TrailConfig());
  const std::vector<PointUm> antennas(3);
  std::vector<int64_t> p(3, 77);
  EXPECT_EQ(field.SenseAll(1, {{-1, 0}, 0}, antennas, 0, p), SenseError::kOffTheMap);
  EXPECT_EQ(field.SenseAll(9, {{0, 0}, 0}, antennas, 0, p), SenseError::kUnknownPheromone);
  EXPECT_EQ(p, std::vector<int64_t>(3, 77));
}

TEST(Field, SaysWhyItCannotDeposit) {
  FieldConfig config = TrailConfig();
  ObstacleMask mask(config.map.columns(), config.map.rows());
  mask.Set({3, 4});
  config.obstacles = Shared<ObstacleMask>(std::move(mask));
  Field field(config);
  EXPECT_EQ(field.Deposit(1, {-1, 0}, 1, 0), DepositResult::kOffTheMap);
  EXPECT_EQ(field.Deposit(7, {0, 0}, 1, 0), DepositResult::kUnknownPheromone);
  EXPECT_EQ(field.Deposit(255, {0, 0}, 1, 0), DepositResult::kUnknownPheromone);
  EXPECT_EQ(field.Deposit(1, {300'000, 400'000}, 1, 0), DepositResult::kBlocked);
  EXPECT_EQ(field.node_count(), 0u);
  EXPECT_EQ(field.used_bytes(), 0u);
}

// As deposits and edits do.
TEST(Field, PathsAndPrintsLeaveBlockedNodesFree) {
  for (const bool diffuses : {false, true}) {
    FieldConfig config = TrailConfig();
    config.pheromones[0].evaporation = Evaporation::kExponential;
    config.pheromones[0].diffusion.exchange_q16 = diffuses ? 1'000 : 0;
    ObstacleMask mask(config.map.columns(), config.map.rows());
    mask.BlockRow(3, 4, 5);
    mask.Set({7, 8});
    config.obstacles = Shared<ObstacleMask>(std::move(mask));
    const Path path{1, 2, false, {{300'000, 300'000}, {700'000, 300'000}}};
    const InitialRaster print{1, Shared(std::vector<InitialNode>{{{6, 8}, 64}, {{7, 8}, 64}})};
    const auto expect_laid = [](const Field& field, uint64_t now_ms) {
      for (int32_t column = 0; column < 12; ++column) {
        const bool is_path = column == 3 || column == 6 || column == 7;
        EXPECT_EQ(field.LevelOf(1, {column, 3}, now_ms), is_path ? 128u : 0u) << column;
        EXPECT_EQ(field.LevelOf(1, {column, 8}, now_ms), column == 6 ? 64u : 0u) << column;
      }
    };
    FieldConfig laid = config;
    laid.paths = {path};
    laid.initial_rasters = {print};
    const Field from_the_beginning(laid);
    expect_laid(from_the_beginning, 0);
    Field later(config);
    ASSERT_TRUE(later.CheckReconfigure(laid, 10).ok());
    later.Reconfigure(laid, 10);
    expect_laid(later, 10);
  }
}

TEST(Field, ATrailEvaporatesQuantumByQuantum) {
  Field field(TrailConfig());
  field.Deposit(1, {5'000'000, 5'200'000}, 8, 1'000);
  const PoseUm pose{{5'000'000, 5'000'000}, 0};
  EXPECT_EQ(At(field, pose, 30'999).left, 4096);
  EXPECT_EQ(At(field, pose, 31'000).left, 4096 * 7 / 8);
  EXPECT_EQ(At(field, pose, 1'000 + 8 * 30'000).left, 0);
}

TEST(Field, TimeSteppingBackwardsChangesNoPheromone) {
  Field field(TrailConfig());
  field.Deposit(1, {5'000'000, 5'200'000}, 8, 1'000'000);
  const PoseUm pose{{5'000'000, 5'000'000}, 0};
  const Intensities before = At(field, pose, 1'000'000);
  EXPECT_EQ(At(field, pose, 0), before);
  EXPECT_EQ(field.Deposit(1, {5'000'000, 5'200'000}, 1, 0), DepositResult::kDone);
  EXPECT_EQ(At(field, pose, 1'000'000), before);
}

TEST(Field, AFullMapRefusesNewTilesButServesTheOldOnes) {
  FieldConfig config = TrailConfig();
  config.memory_bytes = BytesOf(config.map, 2, 1);
  Field field(config);
  EXPECT_EQ(field.Deposit(1, {0, 0}, 1, 0), DepositResult::kDone);
  EXPECT_EQ(field.Deposit(1, {800'000, 0}, 1, 0), DepositResult::kDone);
  EXPECT_EQ(field.Deposit(1, {1'600'000, 0}, 1, 0), DepositResult::kMapFull);
  EXPECT_EQ(field.Deposit(1, {100'000, 0}, 1, 0), DepositResult::kDone);
  EXPECT_EQ(HashFromADump(field), field.hash());
}

TEST(Field, AFullMapTakesBackWhatHasEvaporated) {
  FieldConfig config = TrailConfig();
  config.memory_bytes = BytesOf(config.map, 2, 1);
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
  FieldConfig config = TrailConfig();
  config.map.cell_um = 1'000'000;  // 11 x 11 nodes in four tiles
  config.pheromones[0].tau_ms = 100;
  config.memory_bytes = BytesOf(config.map, 2, 1);
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
      large.VisitLevels(1, now_ms, [&](NodeIndex node, uint32_t) {
        alive.emplace(node.column / 8, node.row / 8);
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
  FieldConfig config = TrailConfig();
  config.pheromones.push_back(TrailLaw());
  config.pheromones.back().type = 2;
  config.pheromones.back().tau_ms = 0;
  Field field(config);
  const uint64_t empty = field.hash();
  for (int i = 0; i < 5'000; ++i) {
    const PointUm point{static_cast<int64_t>(random() % 10'000'000),
                        static_cast<int64_t>(random() % 10'000'000)};
    field.Deposit(static_cast<uint8_t>(1 + random() % 2), point, 1, random() % 1'000'000);
  }
  EXPECT_NE(field.hash(), empty);
  EXPECT_EQ(HashFromADump(field), field.hash());
}

TEST(Field, TheHashDoesNotKnowInWhichOrderNodesWereMade) {
  Field one(TrailConfig());
  Field two(TrailConfig());
  one.Deposit(1, {0, 0}, 1, 5);
  one.Deposit(1, {5'000'000, 0}, 2, 5);
  two.Deposit(1, {5'000'000, 0}, 2, 5);
  two.Deposit(1, {0, 0}, 1, 5);
  EXPECT_EQ(one.hash(), two.hash());
}

TEST(Field, SensingLeavesNoTrace) {
  std::mt19937_64 random(12);
  Field field(TrailConfig());
  for (int i = 0; i < 200; ++i) {
    field.Deposit(1, testing::RandomPoint(random, field.config().map), 4, 1'000);
  }
  const uint64_t before = field.hash();
  const uint64_t bytes = field.used_bytes();
  for (int i = 0; i < 20'000; ++i) {
    field.Sense(static_cast<uint8_t>(random() % 20),
                testing::RandomPose(random, field.config().map), random() % 1'000'000);
  }
  EXPECT_EQ(field.hash(), before);
  EXPECT_EQ(field.used_bytes(), bytes);
}

// Where states must be told apart, their bytes are compared: they depend on what is there, not on
// how it came about.
TEST(Field, EqualStatesHaveEqualBytes) {
  const auto saved = [](const Field& field) {
    ByteWriter writer;
    field.Save(&writer);
    return writer.Take();
  };
  std::mt19937_64 random(13);
  for (int round = 0; round < 20; ++round) {
    Field one(TrailConfig());
    std::vector<PointUm> points;
    for (int i = 0; i < 60; ++i) {
      points.push_back(testing::RandomPoint(random, one.config().map));
      ASSERT_EQ(one.Deposit(1, points.back(), 1, 5'000), DepositResult::kDone);
    }
    std::shuffle(points.begin(), points.end(), random);
    Field other(TrailConfig());
    for (const PointUm& point : points) {
      ASSERT_EQ(other.Deposit(1, point, 1, 5'000), DepositResult::kDone);
    }
    EXPECT_EQ(saved(one), saved(other));
    const std::unique_ptr<Field> copy = one.Clone();
    EXPECT_EQ(saved(*copy), saved(one));
    EXPECT_EQ(copy->hash(), one.hash());
    other.Deposit(1, points[0], 1, 5'000);
    EXPECT_NE(saved(one), saved(other));
    one.Deposit(1, points[0], 1, 5'000);
    EXPECT_NE(saved(*copy), saved(one)) << "a copy has a life of its own";
  }
}

}  // namespace
}  // namespace pheromone::field
