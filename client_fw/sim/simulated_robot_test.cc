// The real client against a scripted server, over a radio channel in virtual time.
#include "client_fw/sim/simulated_robot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "client_fw/sim/testing/fake_server.h"

namespace pheromone::sim {
namespace {

constexpr int64_t kMs = 1'000'000;

struct World {
  explicit World(const RadioConfig& radio = {}) : medium(radio), server(&medium) {}

  SimulatedRobot* Add(const SimulatedRobotConfig& config) {
    robots.push_back(std::make_unique<SimulatedRobot>(config, &medium));
    return robots.back().get();
  }

  void Run(int ms) {
    for (int i = 0; i < ms; ++i) {
      medium.AdvanceTo(medium.now_ns() + kMs);
      server.Step();
      for (const auto& robot : robots) {
        robot->Step();
      }
    }
  }

  RadioMedium medium;
  FakeServer server;
  std::vector<std::unique_ptr<SimulatedRobot>> robots;
};

SimulatedRobotConfig RobotConfig(uint8_t id = 1) {
  SimulatedRobotConfig config;
  config.client.id = id;
  config.client.boot_counter = 1;
  return config;
}

constexpr client::WheelSpeeds kStill = {0, 0};

TEST(SimulatedRobotTest, DrivesStraightOnBalancedPheromone) {
  World world;
  SimulatedRobotConfig config = RobotConfig();
  config.start = {2, 1, std::numbers::pi / 2};
  SimulatedRobot* robot = world.Add(config);
  world.Run(10000);
  EXPECT_EQ((client::WheelSpeeds{200, 200}), robot->wheels());
  EXPECT_NEAR(2, robot->true_pose().x_m, 1e-9);
  EXPECT_GT(robot->true_pose().y_m, 1 + 0.2 * 9);
  EXPECT_LT(robot->true_pose().y_m, 1 + 0.2 * 10);
  // What the server was told: the place on the map, at most a period old.
  EXPECT_EQ(2000, world.server.last_pose.x);
  EXPECT_NEAR(robot->true_pose().y_m * 1000, world.server.last_pose.y, 45);
  EXPECT_EQ(0x4000, world.server.last_pose.heading);
}

TEST(SimulatedRobotTest, TurnsTowardsTheStrongerSide) {
  World world;
  world.server.smell = [](const protocol::WirePose&) {
    return std::pair<int16_t, int16_t>{2048, 0};
  };
  SimulatedRobot* robot = world.Add(RobotConfig());
  world.Run(3000);
  EXPECT_EQ((client::WheelSpeeds{100, 200}), robot->wheels());
  EXPECT_GT(robot->true_pose().heading_rad, 0.3);  // left
  EXPECT_EQ(2048, robot->conversation().state().p_left);
}

// A line of pheromone along y = 0, fading over a metre, smelt by antennas 200 mm apart and, as
// those with directional sensitivity do, somewhat ahead.
TEST(SimulatedRobotTest, FindsAndFollowsALine) {
  World world;
  world.server.smell = [](const protocol::WirePose& pose) {
    const double heading = pose.heading * 2 * std::numbers::pi / 65536;
    const auto at = [&](double side_mm) {
      const double distance_mm =
          std::abs(pose.y + 150 * std::sin(heading) + side_mm * std::cos(heading));
      return static_cast<int16_t>(distance_mm < 1000 ? 4096 - 4.096 * distance_mm : 0);
    };
    return std::pair<int16_t, int16_t>{at(100), at(-100)};
  };
  SimulatedRobotConfig config = RobotConfig();
  config.start = {0, 0.3, 0};
  SimulatedRobot* robot = world.Add(config);
  world.Run(20000);
  EXPECT_GT(robot->true_pose().x_m, 2);
  EXPECT_LT(std::abs(robot->true_pose().y_m), 0.1);
}

TEST(SimulatedRobotTest, FivePerSecondOnACleanChannel) {
  World world;
  const SimulatedRobot* robot = world.Add(RobotConfig());
  world.Run(20000);
  const client::Counters& counters = robot->conversation().counters();
  EXPECT_EQ(1u, counters.hellos);
  EXPECT_EQ(0u, counters.timeouts);
  EXPECT_NEAR(100, counters.answers, 1);
  EXPECT_EQ(counters.requests, counters.answers);
  // 14 + 12 bytes an exchange, a few doubled.
  EXPECT_NEAR(5 * 26 * 10 / 9600.0, world.medium.Utilisation(), 0.01);
}

TEST(SimulatedRobotTest, StandsWithinTheFailSafeTimeOfTheLastAnswerAndRecovers) {
  World world;
  SimulatedRobot* robot = world.Add(RobotConfig());
  world.Run(3000);
  ASSERT_EQ((client::WheelSpeeds{200, 200}), robot->wheels());
  uint32_t answers = robot->conversation().counters().answers;
  while (robot->conversation().counters().answers == answers) {
    world.Run(1);
  }
  world.server.silent = true;
  world.Run(450);
  EXPECT_EQ((client::WheelSpeeds{200, 200}), robot->wheels());
  world.Run(50);
  EXPECT_EQ(kStill, robot->wheels());
  EXPECT_EQ(client::kFailSafe, robot->conversation().state().flags);
  world.Run(1000);
  EXPECT_EQ(0, robot->drive().left_m_s());
  const double stopped_at_m = robot->true_pose().x_m;
  world.Run(5000);
  EXPECT_EQ(stopped_at_m, robot->true_pose().x_m);

  const uint32_t hellos = robot->conversation().counters().hellos;
  world.server.silent = false;
  world.Run(2500);  // HELLO is repeated at least every 1.6 s
  EXPECT_EQ((client::WheelSpeeds{200, 200}), robot->wheels());
  EXPECT_EQ(0, robot->conversation().state().flags);
  EXPECT_GT(robot->conversation().counters().hellos, hellos);
  EXPECT_EQ(1u, robot->conversation().counters().fail_safe_stops);
}

TEST(SimulatedRobotTest, SurvivesALossyChannel) {
  RadioConfig radio;
  radio.block_loss = 0.05;
  World world(radio);
  const SimulatedRobot* robot = world.Add(RobotConfig());
  world.Run(60000);
  const client::Counters& counters = robot->conversation().counters();
  EXPECT_GT(counters.timeouts, 15u);
  EXPECT_GT(counters.answers, 290u);  // of 300 periods
  EXPECT_EQ(0u, counters.fail_safe_stops);
}

TEST(SimulatedRobotTest, LateAnswerOnABufferedLinkIsDiscarded) {
  World world;
  SimulatedRobotConfig config = RobotConfig();
  config.client.buffered_link = true;
  config.client.rounds = false;
  SimulatedRobot* robot = world.Add(config);
  world.Run(3000);
  world.server.smell = [](const protocol::WirePose&) {
    return std::pair<int16_t, int16_t>{4096, 0};
  };
  world.server.delay_ns = 60 * kMs;  // far beyond the window
  uint64_t requests = world.server.requests;
  while (world.server.requests == requests) {
    world.Run(1);
  }
  world.server.delay_ns = 0;
  world.server.smell = [](const protocol::WirePose&) { return kSameEverywhere; };
  for (int ms = 0; ms < 1000; ++ms) {
    world.Run(1);
    ASSERT_NE(4096, robot->conversation().state().p_left);
  }
  EXPECT_GE(robot->conversation().counters().resyncs, 1u);
  EXPECT_EQ((client::WheelSpeeds{200, 200}), robot->wheels());
  EXPECT_EQ(0u, robot->conversation().counters().fail_safe_stops);
}

TEST(SimulatedRobotTest, FourRobotsShareAChannel) {
  for (const bool carrier_detect : {true, false}) {
    RadioConfig radio;
    radio.carrier_detect = carrier_detect;
    World world(radio);
    for (uint8_t id = 1; id <= 4; ++id) {
      world.Add(RobotConfig(id));
    }
    world.Run(60000);
    for (const auto& robot : world.robots) {
      const client::Counters& counters = robot->conversation().counters();
      EXPECT_GT(counters.answers, carrier_detect ? 270u : 200u);  // of 300
      EXPECT_EQ(0u, counters.late_answers);
    }
  }
}

struct Outcome {
  double x_m;
  double y_m;
  uint32_t requests;
  uint64_t collisions;
  bool operator==(const Outcome&) const = default;
};

std::vector<Outcome> RunSwarm(uint64_t seed) {
  RadioConfig radio;
  radio.seed = seed;
  radio.byte_error = 0.002;
  World world(radio);
  for (uint8_t id = 1; id <= 6; ++id) {
    world.Add(RobotConfig(id));
  }
  world.Run(20000);
  std::vector<Outcome> outcomes;
  for (const auto& robot : world.robots) {
    outcomes.push_back({robot->true_pose().x_m, robot->true_pose().y_m,
                        robot->conversation().counters().requests,
                        world.medium.counters().collided_blocks});
  }
  return outcomes;
}

TEST(SimulatedRobotTest, SameSeedSameRun) {
  const std::vector<Outcome> first = RunSwarm(1);
  EXPECT_EQ(first, RunSwarm(1));
  EXPECT_NE(first, RunSwarm(2));
}

}  // namespace
}  // namespace pheromone::sim
