#include "client_fw/swarm/collision.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <tuple>
#include <utility>

namespace pheromone::swarm {
namespace {

constexpr int64_t kM = 1'000'000;

field::FieldConfig Arena(int64_t cell_um, field::PointUm origin = {0, 0}) {
  field::FieldConfig config;
  config.map = {.origin = origin, .width_um = 4 * kM, .height_um = 3 * kM, .cell_um = cell_um};
  return config;
}

field::ObstacleMask MaskOf(const field::FieldConfig& config) {
  return {config.map.columns(), config.map.rows()};
}

TEST(BlockedBy, WithoutObstaclesNothingIs) {
  field::FieldConfig config = Arena(kM / 10);
  EXPECT_FALSE(BlockedBy(config, 0.25));
  config.obstacles = field::Shared(MaskOf(config));
  EXPECT_FALSE(BlockedBy(config, 0.25));
}

// One square from (0.95, 0.95) to (1.05, 1.05).
TEST(BlockedBy, ADiscTouchesSidesAndCorners) {
  field::FieldConfig config = Arena(kM / 10);
  field::ObstacleMask mask = MaskOf(config);
  mask.Set({10, 10});
  config.obstacles = field::Shared(std::move(mask));
  const sim::Blocked blocked = BlockedBy(config, 0.2);
  EXPECT_TRUE(blocked({1.25, 1, 0}));
  EXPECT_FALSE(blocked({1.250001, 1, 0}));
  EXPECT_TRUE(blocked({1, 0.75, 3}));
  EXPECT_FALSE(blocked({1, 0.749999, 3}));
  const double corner = 1.05 + 0.2 / std::sqrt(2);
  EXPECT_TRUE(blocked({corner - 1e-6, corner - 1e-6, 0}));
  EXPECT_FALSE(blocked({corner + 1e-6, corner + 1e-6, 0}));
}

TEST(BlockedBy, APointIsBlockedInsideASquareOnly) {
  field::FieldConfig config = Arena(kM / 10);
  field::ObstacleMask mask = MaskOf(config);
  mask.Set({10, 10});
  config.obstacles = field::Shared(std::move(mask));
  const sim::Blocked blocked = BlockedBy(config, 0);
  EXPECT_TRUE(blocked({1.04, 0.96, 0}));
  EXPECT_FALSE(blocked({1.06, 1, 0}));
}

// Every blocked square is looked at, in floating point, and the nearest point of it is taken.
TEST(BlockedBy, IsWhatLookingAtEverySquareSays) {
  std::mt19937_64 random(11);
  const auto uniform = [&random](double least, double most) {
    return least + (most - least) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  int hits = 0;
  for (int world = 0; world < 30; ++world) {
    const int64_t cell_um = 20'000 + static_cast<int64_t>(random() % 200'001);
    field::FieldConfig config = Arena(cell_um, {-kM, static_cast<int64_t>(random() % 777'777)});
    field::ObstacleMask mask = MaskOf(config);
    for (int i = 0; i < 12; ++i) {
      mask.Set({static_cast<int32_t>(random() % static_cast<uint64_t>(config.map.columns())),
                static_cast<int32_t>(random() % static_cast<uint64_t>(config.map.rows()))});
    }
    config.obstacles = field::Shared(std::move(mask));
    const double radius_m = uniform(0, 0.6);
    const sim::Blocked blocked = BlockedBy(config, radius_m);
    for (int i = 0; i < 300; ++i) {
      const sim::PlanePose pose{uniform(-1.5, 3.5), uniform(-0.5, 4.5), 0};
      double nearest_m = 1e9;
      config.obstacles->ForEach([&](field::NodeIndex node) {
        const field::PointUm centre = config.map.PositionOf(node);
        const double half_m = static_cast<double>(cell_um) / 2e6;
        const double x = static_cast<double>(centre.x) / 1e6;
        const double y = static_cast<double>(centre.y) / 1e6;
        nearest_m = std::min(nearest_m,
                             std::hypot(pose.x_m - std::clamp(pose.x_m, x - half_m, x + half_m),
                                        pose.y_m - std::clamp(pose.y_m, y - half_m, y + half_m)));
      });
      if (std::abs(nearest_m - radius_m) > 2e-6) {
        ASSERT_EQ(nearest_m < radius_m, blocked(pose)) << pose.x_m << ' ' << pose.y_m;
        hits += nearest_m < radius_m ? 1 : 0;
      }
    }
  }
  EXPECT_GT(hits, 500);
}

TEST(RangeTo, WithoutObstaclesIsNothing) {
  field::FieldConfig config = Arena(kM / 10);
  EXPECT_FALSE(RangeTo(config));
  config.obstacles = field::Shared(MaskOf(config));
  EXPECT_FALSE(RangeTo(config));
}

// One square from (0.95, 0.95) to (1.05, 1.05).
TEST(RangeTo, ASquareIsSeenFromItsSidesAndFromInside) {
  field::FieldConfig config = Arena(kM / 10);
  field::ObstacleMask mask = MaskOf(config);
  mask.Set({10, 10});
  config.obstacles = field::Shared(std::move(mask));
  const sim::RangeFinder range = RangeTo(config);
  EXPECT_NEAR(range({0, 1, 0}, 5), 0.95, 1e-9);
  EXPECT_NEAR(range({3, 1, std::numbers::pi}, 5), 1.95, 1e-9);
  EXPECT_NEAR(range({1, 3, -std::numbers::pi / 2}, 5), 1.95, 1e-9);
  EXPECT_NEAR(range({0.5, 0.55, std::numbers::pi / 4}, 5), 0.45 * std::numbers::sqrt2, 1e-9);
  EXPECT_EQ(range({1, 1, 2}, 5), 0);
  EXPECT_GT(range({0, 1, std::numbers::pi}, 5), 5);
  EXPECT_GT(range({0, 1.06, 0}, 5), 5);
  EXPECT_GT(range({0, 1, 0}, 0.9), 0.9);
  EXPECT_NEAR(range({-20, 1, 0}, 50), 20.95, 1e-9);  // from beyond the map
}

// The slab method on every blocked square.
TEST(RangeTo, IsWhatLookingAtEverySquareSays) {
  std::mt19937_64 random(12);
  const auto uniform = [&random](double least, double most) {
    return least + (most - least) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  int hits = 0;
  for (int world = 0; world < 30; ++world) {
    const int64_t cell_um = 20'000 + static_cast<int64_t>(random() % 200'001);
    field::FieldConfig config = Arena(cell_um, {-kM, static_cast<int64_t>(random() % 777'777)});
    field::ObstacleMask mask = MaskOf(config);
    for (int i = 0; i < 40; ++i) {
      mask.Set({static_cast<int32_t>(random() % static_cast<uint64_t>(config.map.columns())),
                static_cast<int32_t>(random() % static_cast<uint64_t>(config.map.rows()))});
    }
    config.obstacles = field::Shared(std::move(mask));
    const sim::RangeFinder range = RangeTo(config);
    for (int i = 0; i < 300; ++i) {
      const sim::PlanePose from{uniform(-1.5, 3.5), uniform(-0.5, 4.5), uniform(-7, 7)};
      double nearest_m = 1e9;
      config.obstacles->ForEach([&](field::NodeIndex node) {
        const field::PointUm centre = config.map.PositionOf(node);
        const double half_m = static_cast<double>(cell_um) / 2e6;
        double enters_m = 0;
        double leaves_m = 1e9;
        for (const auto& [at, middle, direction] :
             {std::tuple{from.x_m, static_cast<double>(centre.x) / 1e6, std::cos(from.heading_rad)},
              std::tuple{from.y_m, static_cast<double>(centre.y) / 1e6,
                         std::sin(from.heading_rad)}}) {
          const double one_m = (middle - half_m - at) / direction;
          const double other_m = (middle + half_m - at) / direction;
          enters_m = std::max(enters_m, std::min(one_m, other_m));
          leaves_m = std::min(leaves_m, std::max(one_m, other_m));
        }
        if (enters_m <= leaves_m) {
          nearest_m = std::min(nearest_m, enters_m);
        }
      });
      const double found_m = range(from, 3);
      if (nearest_m < 3) {
        ASSERT_NEAR(found_m, nearest_m, 1e-6) << from.x_m << ' ' << from.y_m;
        ++hits;
      } else {
        ASSERT_GT(found_m, 3);
      }
    }
  }
  EXPECT_GT(hits, 2000);
}

}  // namespace
}  // namespace pheromone::swarm
