// Robots that a modelled radio answers, beside the exchanges of the link itself.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "client_fw/lab/testing/worlds.h"

namespace pheromone::lab {
namespace {

using testing::Alone;
using testing::Made;
using testing::SmallWorld;

constexpr int64_t kStepMs = 20;

// One robot that drives straight ahead and deposits whenever it may, as if 20 shared its channel.
WorldConfig OneOfMany(size_t others) {
  WorldConfig config = SmallWorld();
  config.step_ms = kStepMs;
  config.seed = 3;
  config.radio = {.robots_per_channel = 40, .lost_percent = 5};
  config.groups = {Alone({1, 5, 0})};
  config.groups[0].radius_m = 0;
  config.groups[0].deposits = 1;
  for (size_t i = 0; i < others; ++i) {
    config.groups[0].starts.push_back({1, 1 + 0.1 * static_cast<double>(i), 0});
  }
  return config;
}

TEST(ModelledRadio, AnswersInTheFirstStepAfterTheAnswerWithThePoseOfTheRequest) {
  const auto world = Made(OneOfMany(19));
  const RoundsLink link(20, {.robots_per_channel = 40, .lost_percent = 5}, 3);
  LinkExchange next = link.First(0);
  int64_t heard_ms = -1;
  uint64_t stops = 0;
  uint64_t answers = 0;
  bool asked = false;
  int32_t asked_x = 0;
  for (int64_t now_ms = 0; now_ms < 60'000; now_ms += kStepMs) {
    ASSERT_TRUE(world->Sense().ok());
    Robots& robots = world->mutable_robots();
    const bool asks = !asked && next.ask_ms <= now_ms;
    ASSERT_EQ(robots.asked[0] != 0, asks) << now_ms;
    if (asks) {
      asked = true;
      asked_x = static_cast<int32_t>(std::lround(robots.x_m[0] * 1000));
    }
    const bool answered = asked && next.answer_ms <= now_ms;
    ASSERT_EQ(robots.answered[0] != 0, answered) << now_ms;
    if (answered) {
      ASSERT_EQ(robots.sensed_x[0], asked_x);
      stops += heard_ms >= 0 && next.answer_ms - heard_ms > 480 ? 1 : 0;
      heard_ms = next.answer_ms;
      ++answers;
      asked = false;
      next = link.After(0, next);
    }
    ASSERT_EQ(robots.silent[0] != 0, heard_ms < 0 || now_ms - heard_ms >= 480) << now_ms;
    for (size_t i = 0; i < robots.count; ++i) {
      robots.want_left_m_s[i] = robots.want_right_m_s[i] = 0.1;
    }
    ASSERT_TRUE(world->Act().ok());
  }
  EXPECT_GT(stops, 50u);
  EXPECT_GT(answers, 50u);
  EXPECT_GT(world->tally().heard.answers, 19 * answers / 2);
}

TEST(ModelledRadio, ARobotThatIsSilentStandsAndDepositsOnlyWhenItAsks) {
  const auto world = Made(OneOfMany(19));
  uint64_t asked = 0;
  double silent_m_s = 0;
  int silent_steps = 0;
  for (int step = 0; step < 2000; ++step) {
    ASSERT_TRUE(world->Sense().ok());
    Robots& robots = world->mutable_robots();
    for (size_t i = 0; i < robots.count; ++i) {
      robots.want_left_m_s[i] = robots.want_right_m_s[i] = 0.06;
      robots.want_quanta[i] = 1;
      robots.want_type[i] = 1;
      asked += robots.asked[i];
      if (robots.silent[i] != 0) {
        silent_m_s = std::max(silent_m_s, robots.left_m_s[i]);
        ++silent_steps;
      }
    }
    const double before = robots.left_m_s[0];
    const bool silent = robots.silent[0] != 0;
    ASSERT_TRUE(world->Act().ok());
    // 0.3 m/s2
    ASSERT_LE(robots.left_m_s[0], silent ? std::max(before - 0.005, 0.0) : before + 0.007);
  }
  EXPECT_GT(silent_steps, 1000);
  EXPECT_EQ(world->tally().deposited_quanta, asked);
}

// Stops are counted by the milliseconds of the answers, whatever the step.
TEST(ModelledRadio, TheStepDoesNotChangeWhatIsCounted) {
  std::vector<Heard> heard;
  for (const int64_t step_ms : {5, 20, 100}) {
    WorldConfig config = OneOfMany(19);
    config.step_ms = step_ms;
    config.measure_from_ms = 10'000;
    const auto world = Made(std::move(config));
    while (world->time().now_ms() < 60'000) {
      ASSERT_TRUE(world->Step().ok());
    }
    heard.push_back(world->tally().heard);
  }
  // Of those at the two ends, each robot may have one.
  EXPECT_GT(heard[0].fail_safe_stops, 1000u);
  for (const Heard& other : heard) {
    EXPECT_NEAR(static_cast<double>(other.answers), static_cast<double>(heard[0].answers), 20);
    EXPECT_NEAR(static_cast<double>(other.fail_safe_stops),
                static_cast<double>(heard[0].fail_safe_stops), 20);
  }
}

TEST(ModelledRadio, WhatWasNotMeasuredIsRefused) {
  WorldConfig config = OneOfMany(0);
  config.radio->lost_percent = 2;
  EXPECT_EQ(World::Create(config).ErrorOr("none"),
            "found 40 robots a channel with 2 % lost, expected one of the measured rounds: 1 to 40 "
            "robots with 0, 1 or 5 % lost");
  config = OneOfMany(0);
  config.step_ms = 200;
  EXPECT_EQ(World::Create(config).ErrorOr("none"),
            "found a step of 200 ms with a modelled radio, expected at most 100 ms");
}

}  // namespace
}  // namespace pheromone::lab
