// Cleaning robots in virtual time: the real firmware, radio and engine.
#include <gtest/gtest.h>

#include <map>
#include <string>

#include "client_fw/core/tasks/cleaner.h"
#include "client_fw/swarm/path_experiment.h"
#include "client_fw/swarm/simulation.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kMeter = 1'000'000;

// Zones of 1 m in a row, the tag of each in its middle and in range of its neighbours.
SimulationConfig Row(int zones, int robots) {
  SimulationConfig config;
  config.engine = EngineConfigOf(PathExperiment());
  tags::Settings& tags = config.engine.tags;
  for (int i = 0; i < zones; ++i) {
    tags.tags.push_back({.name = "zone-" + std::to_string(i + 1),
                         .x_um = kMeter / 2 + i * kMeter,
                         .y_um = kMeter,
                         .range_um = kMeter * 12 / 10});
  }
  for (int i = 0; i < robots; ++i) {
    RobotConfig robot;
    robot.client.id = static_cast<uint8_t>(i + 1);
    robot.client.boot_counter = static_cast<uint16_t>(100 + i);
    robot.client.type = 2;
    client::PrepareForCleaning(&robot.client);
    robot.start = {0.5 + i * (zones > 1 ? 1.0 : 0.0), 1, 0};
    robot.cleaner = client::CleanerParameters{.cleaning_ms = 3000, .lease_s = 8};
    config.robots.push_back(robot);
  }
  return config;
}

struct Watched {
  int64_t together_ms = 0;  ///< two cleaned one zone
  std::map<uint16_t, int> begun;
};

Watched Watch(Simulation* simulation, int64_t ms) {
  Watched watched;
  std::map<size_t, bool> before;
  for (const int64_t end_ms = simulation->now_ms() + ms; simulation->now_ms() < end_ms;) {
    simulation->RunTo(simulation->now_ms() + 1);
    std::map<uint16_t, int> cleaning;
    for (size_t i = 0; i < simulation->robot_count(); ++i) {
      const client::Cleaner& cleaner = *simulation->robot(i).cleaner();
      if (cleaner.is_cleaning() && ++cleaning[cleaner.target()] > 1) {
        ++watched.together_ms;
      }
      if (cleaner.is_cleaning() && !before[i]) {
        ++watched.begun[cleaner.target()];
      }
      before[i] = cleaner.is_cleaning();
    }
  }
  return watched;
}

TEST(CleaningRobotTest, OneRobotCleansAllZonesOfARow) {
  Simulation simulation(Row(4, 1));
  const Watched watched = Watch(&simulation, 180'000);
  EXPECT_EQ(watched.begun.size(), 4u);
  for (const auto& [tag, times] : watched.begun) {
    EXPECT_GE(times, 2) << tag;
  }
  EXPECT_GE(simulation.robot().cleaner()->cleaned(), 10u);
  EXPECT_EQ(simulation.robot().cleaner()->lost_claims(), 0u);
  EXPECT_EQ(simulation.robot().counters().fail_safe_stops, 0u);
}

TEST(CleaningRobotTest, TwoRobotsShareARowAndNeverMeet) {
  Simulation simulation(Row(5, 2));
  const Watched watched = Watch(&simulation, 180'000);
  EXPECT_EQ(watched.together_ms, 0);
  EXPECT_EQ(watched.begun.size(), 5u);
}

// From 1 m/s a robot needs more than a metre to stop: without braking on the way it circled round
// the tag for ever.
TEST(CleaningRobotTest, AFastRobotStopsAtTheTag) {
  SimulationConfig config = Row(3, 1);
  config.robots[0].client.speed_mm_s = 1000;
  Simulation simulation(config);
  Watch(&simulation, 120'000);
  EXPECT_GE(simulation.robot().cleaner()->cleaned(), 6u);
}

// Eight robots on a channel that is full: each has a turn in every round, too short for a claim.
TEST(CleaningRobotTest, OnAFullChannelClaimsGetThroughToo) {
  SimulationConfig config = Row(8, 8);
  config.engine.links = {{"radio-a", 2, 20}};
  Simulation simulation(config);
  const Watched watched = Watch(&simulation, 60'000);
  EXPECT_EQ(watched.together_ms, 0);
  uint32_t cleaned = 0;
  for (size_t i = 0; i < 8; ++i) {
    cleaned += simulation.robot(i).cleaner()->cleaned();
  }
  EXPECT_GE(cleaned, 4u);
}

TEST(CleaningRobotTest, OnALossyChannelTwoRobotsClaimOneZoneInTurn) {
  SimulationConfig config = Row(1, 2);
  config.radio.block_loss = 0.1;
  config.radio.byte_error = 0.005;
  Simulation simulation(config);
  const Watched watched = Watch(&simulation, 300'000);
  EXPECT_EQ(watched.together_ms, 0);
  EXPECT_GE(simulation.robot(0).cleaner()->cleaned(), 10u);
  EXPECT_GE(simulation.robot(1).cleaner()->cleaned(), 10u);
}

}  // namespace
}  // namespace pheromone::swarm
