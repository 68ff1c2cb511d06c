// Two cleaning robots with the AVR's image, on one radio channel with losses, claim one zone again
// and again: never do both clean it. What is looked at are the pins of their brushes.
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>
#include <string>

#include "client_fw/core/tasks/cleaner.h"
#include "client_fw/sim/avr/avr_robot.h"
#include "client_fw/swarm/path_experiment.h"
#include "client_fw/swarm/simulation.h"

namespace pheromone::firmware {
namespace {

constexpr int64_t kMs = 1'000'000;

swarm::SimulationConfig TwoRobots() {
  swarm::SimulationConfig config;
  config.engine = swarm::EngineConfigOf(swarm::PathExperiment());
  // Odometry begins at (0, 0): both robots stand in the one zone.
  config.engine.tags.tags = {
      {.name = "dock", .x_um = 50'000, .y_um = 50'000, .range_um = 1'000'000}};
  config.radio.turnaround_ns = 2 * kMs;
  config.radio.byte_error = 0.004;  // a tenth of the short frames, a fifth of the long ones
  for (uint8_t id = 1; id <= 2; ++id) {
    swarm::RobotConfig robot;
    robot.client.id = id;
    robot.client.boot_counter = static_cast<uint16_t>(300 + id);
    robot.client.type = 2;
    client::PrepareForCleaning(&robot.client);
    robot.pioneer = sim::FindPioneerModel("p3dx-sh");
    robot.image = PHEROMONE_CLEANER_AVR_IMAGE;
    config.robots.push_back(robot);
  }
  return config;
}

struct Claims {
  int of[2] = {0, 0};
  int64_t together_ms = 0;
  int64_t ms = 0;
};

// Until so many claims, or so much time, is over.
Claims Watch(swarm::Simulation* simulation, int claims, int64_t most_ms) {
  Claims seen;
  bool before[2] = {false, false};
  while (seen.of[0] + seen.of[1] < claims && seen.ms < most_ms) {
    simulation->RunTo(simulation->now_ms() + 1);
    ++seen.ms;
    for (size_t i = 0; i < 2; ++i) {
      const bool cleans = simulation->robot(i).HoldsLoad();
      seen.of[i] += cleans && !before[i] ? 1 : 0;
      before[i] = cleans;
    }
    seen.together_ms += before[0] && before[1] ? 1 : 0;
  }
  return seen;
}

int ClaimsWanted() {
  const char* const claims = std::getenv("PHEROMONE_CLAIMS");
  return claims == nullptr ? 24 : std::atoi(claims);
}

TEST(ClaimTest, TwoAvrRobotsNeverCleanOneZoneTogether) {
  const int claims = ClaimsWanted();
  swarm::Simulation simulation(TwoRobots());
  const Claims seen = Watch(&simulation, claims, int64_t{10'000} * claims);
  std::cout << claims << " claims: " << seen.of[0] << " and " << seen.of[1] << " in "
            << seen.ms / 1000 << " s, " << simulation.medium().counters().damaged_bytes
            << " bytes damaged\n";
  for (size_t i = 0; i < 2; ++i) {
    const auto& robot = dynamic_cast<const sim::AvrRobot&>(simulation.robot(i));
    const size_t ram = robot.machine().image_size().static_ram_bytes;
    const size_t stack = robot.machine().stack_bytes();
    std::cout << "robot " << i + 1 << ": " << ram << " bytes of RAM, deepest stack " << stack
              << " bytes\n";
    EXPECT_LE(ram + stack, 3072u);
  }
  EXPECT_EQ(seen.of[0] + seen.of[1], claims);
  EXPECT_EQ(seen.together_ms, 0);
  EXPECT_GT(seen.of[0], claims / 4);
  EXPECT_GT(seen.of[1], claims / 4);
  EXPECT_GT(simulation.medium().counters().damaged_bytes, static_cast<uint64_t>(claims));
}

}  // namespace
}  // namespace pheromone::firmware
