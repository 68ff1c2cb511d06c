// The client with its ARCOS client, a cable and a simulated Pioneer, against a scripted server.
#include "client_fw/sim/pioneer/host_pioneer_robot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "client_fw/sim/testing/fake_server.h"

namespace pheromone::sim {
namespace {

constexpr int64_t kMs = 1'000'000;

struct World {
  explicit World(const HostPioneerRobotConfig& config)
      : medium({}), server(&medium), robot(config, &medium) {}

  void Run(int ms) {
    for (int i = 0; i < ms; ++i) {
      medium.AdvanceTo(medium.now_ns() + kMs);
      server.Step();
      robot.Step();
    }
  }

  RadioMedium medium;
  FakeServer server;
  HostPioneerRobot robot;
};

HostPioneerRobotConfig Config(const PioneerModel& model = PioneerModels().front()) {
  HostPioneerRobotConfig config;
  config.client.boot_counter = 1;
  config.pioneer.model = model;
  config.client.drive_scale = static_cast<uint16_t>(std::lround(model.distance_mm * 10'000));
  return config;
}

class EveryPioneer : public testing::TestWithParam<size_t> {};

TEST_P(EveryPioneer, DrivesAndTellsWhereItIs) {
  HostPioneerRobotConfig config = Config(PioneerModels()[GetParam()]);
  config.start = {2, 1, std::numbers::pi / 2};
  World world(config);
  world.Run(10'000);
  EXPECT_EQ((client::WheelSpeeds{200, 200}), world.robot.wheels());
  EXPECT_TRUE(world.robot.pioneer().motors_enabled());
  EXPECT_NEAR(2, world.robot.true_pose().x_m, 1e-9);
  EXPECT_GT(world.robot.true_pose().y_m, 1 + 0.2 * 8);
  EXPECT_LT(world.robot.true_pose().y_m, 1 + 0.2 * 10);
  // What the server was told is at most a period and a report old: 60 mm.
  EXPECT_EQ(2000, world.server.last_pose.x);
  EXPECT_LT(world.server.last_pose.y, world.robot.true_pose().y_m * 1000 + 1);
  EXPECT_GT(world.server.last_pose.y, world.robot.true_pose().y_m * 1000 - 85);
  EXPECT_EQ(0x4000, world.server.last_pose.heading);
  EXPECT_EQ(0u, world.robot.counters().timeouts);
  EXPECT_EQ(0u, world.robot.pioneer().counters().bad_checksums);
}

std::string NameOfModel(const testing::TestParamInfo<size_t>& info) {
  std::string name;
  for (const char c : PioneerModels()[info.param].subclass) {
    name += c == '-' ? '_' : c;
  }
  return name;
}

INSTANTIATE_TEST_SUITE_P(Models, EveryPioneer, testing::Range<size_t>(0, 7), NameOfModel);

TEST(HostPioneerRobot, StandsWhenAnswersStop) {
  World world(Config());
  world.Run(5'000);
  ASSERT_GT(world.robot.pioneer().drive().left_m_s(), 0.1);
  world.server.silent = true;
  world.Run(2'000);
  EXPECT_EQ(Motion{}, world.robot.pioneer().drive().motion());
  EXPECT_EQ(1u, world.robot.counters().fail_safe_stops);
  EXPECT_NE(0, world.robot.flags());
}

TEST(HostPioneerRobot, DoesNotEnterAnObstacleAndKnowsWhereItStands) {
  HostPioneerRobotConfig config = Config();
  config.pioneer.blocked = [](const PlanePose& pose) { return pose.x_m > 0.5; };
  World world(config);
  world.Run(10'000);
  EXPECT_LE(world.robot.true_pose().x_m, 0.5);
  EXPECT_NEAR(0.5, world.robot.true_pose().x_m, 0.001);
  EXPECT_EQ(1u, world.robot.bumps());
  EXPECT_NEAR(500, world.server.last_pose.x, 1);  // wheels that stall do not count
}

TEST(HostPioneerRobot, WalksTheSameWayAgain) {
  PioneerErrors errors;
  errors.slip = 0.1;
  HostPioneerRobotConfig config = Config();
  config.pioneer.errors = errors;
  World a(config);
  World b(config);
  a.Run(8'000);
  b.Run(8'000);
  EXPECT_EQ(a.robot.true_pose().x_m, b.robot.true_pose().x_m);
  EXPECT_EQ(a.robot.true_pose().heading_rad, b.robot.true_pose().heading_rad);
  EXPECT_EQ(a.medium.counters().bytes, b.medium.counters().bytes);
  EXPECT_NE(0, a.robot.true_pose().y_m);  // slip there was
}

}  // namespace
}  // namespace pheromone::sim
