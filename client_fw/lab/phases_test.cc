#include "client_fw/lab/phases.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "client_fw/lab/chance.h"
#include "client_fw/lab/testing/worlds.h"
#include "server/base/hash.h"

namespace pheromone::lab {
namespace {

using testing::Alone;
using testing::Made;
using testing::SmallWorld;

TEST(Chance, IsTheHashOfAllOtherRooms) {
  for (uint64_t i = 0; i < 100; ++i) {
    ASSERT_EQ(PheromoneHash(i, 7 * i, i * i, 3), Hash64({i, 7 * i, i * i, 3}));
  }
}

TEST(Chance, HasTheMomentsOfItsDistributions) {
  constexpr int kDraws = 40'000;
  double uniform = 0;
  double normal = 0;
  double square = 0;
  for (uint64_t i = 0; i < kDraws; ++i) {
    const double u = PheromoneUniform(1, i, 5, kFixX);
    const double n = PheromoneNormal(1, i, 5, kFixX);
    ASSERT_TRUE(u >= 0 && u < 1);
    uniform += u;
    normal += n;
    square += n * n;
  }
  // Four standard errors.
  EXPECT_NEAR(uniform / kDraws, 0.5, 4 * std::sqrt(1 / 12.0 / kDraws));
  EXPECT_NEAR(normal / kDraws, 0, 4 / std::sqrt(kDraws));
  EXPECT_NEAR(square / kDraws, 1, 4 * std::sqrt(2.0 / kDraws));
}

// Drives a robot with these errors in bends, and calls `check` after each step.
template <typename Check>
void Drive(const OdometryErrors& errors, const PositionFixes& fixes, Check&& check) {
  WorldConfig config = SmallWorld();
  config.groups = {Alone({5, 5, 1})};
  config.groups[0].odometry = errors;
  config.groups[0].fixes = fixes;
  const auto world = Made(std::move(config));
  for (int step = 0; step < 40; ++step) {
    world->mutable_robots().want_left_m_s[0] = 0.2 + 0.1 * std::sin(step);
    world->mutable_robots().want_right_m_s[0] = 0.3;
    ASSERT_TRUE(world->Step().ok());
    check(*world, step);
  }
}

TEST(Odometry, WithoutErrorsItIsWhatIsSo) {
  Drive({}, {.period_ms = 1000, .sigma_m = 0}, [](const World& world, int /*step*/) {
    ASSERT_EQ(world.robots().believed_x_m[0], world.robots().x_m[0]);
    ASSERT_EQ(world.robots().believed_heading_rad[0], world.robots().heading_rad[0]);
  });
}

TEST(Odometry, ABiasIsTheSameInEachStep) {
  sim::PlanePose believed{5, 5, 1};
  const double left = 1 + 0.1 * PheromoneNormal(1, 0, 0, kLeftBias);
  const double right = 1 + 0.1 * PheromoneNormal(1, 0, 0, kRightBias);
  EXPECT_GT(std::abs(left - right), 0.01);
  Drive({.bias = 0.1}, {}, [&](const World& world, int /*step*/) {
    const Robots& robots = world.robots();
    believed = sim::MoveOnArc(believed, robots.roll_left_m[0] * left,
                              robots.roll_right_m[0] * right, 0.33);
    ASSERT_NEAR(robots.believed_x_m[0], believed.x_m, 1e-12);
    ASSERT_NEAR(robots.believed_y_m[0], believed.y_m, 1e-12);
    ASSERT_NEAR(robots.believed_heading_rad[0], believed.heading_rad, 1e-12);
  });
}

TEST(Odometry, AFixReplacesThePositionAndKeepsTheHeading) {
  Drive({.bias = 0.2}, {.period_ms = 1000, .sigma_m = 0}, [](const World& world, int step) {
    const Robots& robots = world.robots();
    const bool fixed = (step + 1) % 5 == 0;
    if (step > 10) {
      ASSERT_EQ(robots.believed_x_m[0] == robots.x_m[0], fixed) << step;
      ASSERT_NE(robots.believed_heading_rad[0], robots.heading_rad[0]);
    }
  });
}

TEST(Odometry, ASlippingRobotIsBehindWhatItCounts) {
  double counted = 0;
  double moved = 0;
  double x = 5;
  double y = 5;
  Drive({.slip = 0.3}, {}, [&](const World& world, int /*step*/) {
    const Robots& robots = world.robots();
    counted += (robots.roll_left_m[0] + robots.roll_right_m[0]) / 2;
    moved += std::hypot(robots.x_m[0] - x, robots.y_m[0] - y);
    x = robots.x_m[0];
    y = robots.y_m[0];
  });
  // Between 0 and 30 % less, in each step.
  EXPECT_NEAR(moved / counted, 0.85, 0.05);
}

// Fixes that are 5 m off put half of what it believes off the map, where there are no intensities.
TEST(Sense, AnswersAreThoseWithIntensities) {
  for (const auto& radio : {std::optional<RadioModel>(), std::optional(RadioModel())}) {
    WorldConfig config = SmallWorld();
    config.step_ms = 20;
    config.radio = radio;
    config.groups = {Alone({5, 5, 1})};
    config.groups[0].fixes = {.period_ms = 100, .sigma_m = 5};
    const auto world = Made(std::move(config));
    uint64_t on_map = 0;
    uint64_t answered = 0;
    for (int step = 0; step < 2000; ++step) {
      ASSERT_TRUE(world->Sense().ok());
      answered += world->robots().answered[0];
      on_map += world->robots().answered[0] != 0 && world->robots().on_map[0] != 0 ? 1u : 0u;
      ASSERT_TRUE(world->Act().ok());
    }
    EXPECT_EQ(world->tally().heard.answers, on_map);
    EXPECT_GT(on_map, answered / 10);
    EXPECT_LT(on_map, answered * 9 / 10);
  }
}

}  // namespace
}  // namespace pheromone::lab
