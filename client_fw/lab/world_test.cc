#include "client_fw/lab/world.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "client_fw/lab/chance.h"
#include "client_fw/lab/testing/worlds.h"
#include "client_fw/sim/differential_drive.h"
#include "protocol/decoder.h"
#include "server/core/engine/service/service.h"
#include "server/core/engine/testing/scripted_log.h"

namespace pheromone::lab {
namespace {

using testing::Alone;
using testing::Lattice;
using testing::Made;
using testing::SmallWorld;

TEST(World, ARobotAloneMovesAsTheSimulatedDriveDoes) {
  WorldConfig config = SmallWorld();
  config.groups = {Alone({5, 5, 0.3})};
  const auto world = Made(std::move(config));
  sim::DifferentialDrive drive({}, {5, 5, 0.3});
  for (int step = 0; step < 60; ++step) {
    const auto left = static_cast<int16_t>(static_cast<int>(300 * std::sin(0.3 * step)));
    const auto right = static_cast<int16_t>(static_cast<int>(250 * std::cos(0.2 * step)));
    world->mutable_robots().want_left_m_s[0] = left / 1000.0;
    world->mutable_robots().want_right_m_s[0] = right / 1000.0;
    ASSERT_TRUE(world->Step().ok());
    drive.set_wheel_speeds(left, right);
    drive.Advance(0.2);
    const Robots& robots = world->robots();
    ASSERT_EQ(robots.x_m[0], drive.true_pose().x_m) << step;
    ASSERT_EQ(robots.y_m[0], drive.true_pose().y_m) << step;
    ASSERT_EQ(robots.heading_rad[0], drive.true_pose().heading_rad) << step;
  }
  EXPECT_GT(world->robots().way_m[0], 1);
}

// Closed form: wheels 0.33 m apart at 0.2 and 0.266 m/s turn by 0.2 rad/s on a radius of 1.165 m.
TEST(World, AtConstantSpeedsARobotDrivesACircle) {
  WorldConfig config = SmallWorld();
  config.groups = {Alone({5, 5, 0})};
  config.groups[0].wheels.acceleration_m_s2 = 0;
  config.groups[0].wheels.quantum_mm_s = 0;
  const auto world = Made(std::move(config));
  world->mutable_robots().want_left_m_s[0] = 0.2;
  world->mutable_robots().want_right_m_s[0] = 0.266;
  for (int step = 1; step <= 100; ++step) {
    ASSERT_TRUE(world->Step().ok());
    const double turn = 0.04 * step;
    ASSERT_NEAR(world->robots().x_m[0], 5 + 1.165 * std::sin(turn), 1e-9);
    ASSERT_NEAR(world->robots().y_m[0], 5 + 1.165 * (1 - std::cos(turn)), 1e-9);
    ASSERT_NEAR(world->robots().heading_rad[0], turn, 1e-12);
  }
}

// 0.04 m a step; a nest from 5.7 to 5.9 m charges it, if there is one.
TEST(World, AnEmptyBatteryStopsARobot) {
  for (const bool has_nest : {false, true}) {
    WorldConfig config = SmallWorld();
    config.groups = {Alone({5, 5, 0})};
    config.groups[0].wheels.acceleration_m_s2 = 0;
    config.groups[0].range_m = 1.01;
    if (has_nest) {
      config.sites.resize(1);
      config.sites[0].site = {5.8, 5, 0.1, 0, 1, 0};
    }
    const auto world = Made(std::move(config));
    world->mutable_robots().want_left_m_s[0] = 0.2;
    world->mutable_robots().want_right_m_s[0] = 0.2;
    for (int step = 0; step < 100; ++step) {
      ASSERT_TRUE(world->Step().ok());
    }
    EXPECT_NEAR(world->robots().x_m[0], (has_nest ? 5.9 : 5) + 1.01, 2 * 0.04) << has_nest;
    EXPECT_EQ(world->robots().failed[0], 1) << has_nest;
  }
}

// The server, asked by frames.
class Server {
 public:
  explicit Server(const field::FieldConfig& field) : service_(&log_, [this] { return now_; }) {
    engine::EngineConfig config;
    config.field = field;
    config.links = {{"radio-a", 3, 40}};
    EXPECT_TRUE(service_.Configure(config, 7).ok());
  }

  void SetTime(uint64_t now_ms) { now_.boottime_ms = 1'000 + now_ms; }

  template <typename Answer, typename Request>
  Answer Ask(const Request& request) {
    protocol::Message message;
    protocol::Encode(request, &message);
    std::vector<engine::Outgoing> out;
    const std::vector<protocol::Message> heard = {Travelled(message)};
    service_.Handle(0, heard, &out);
    Answer answer;
    EXPECT_EQ(out.size(), 1u);
    EXPECT_TRUE(protocol::Decode(Travelled(out.at(0).message), &answer));
    return answer;
  }

 private:
  // What arrives of a message that was sent as a frame.
  static protocol::Message Travelled(const protocol::Message& message) {
    uint8_t wire[protocol::kMaxFrame];
    const size_t size = protocol::EncodeFrame(message, wire, sizeof wire);
    protocol::FrameDecoder decoder(20);
    size_t frames = 0;
    for (size_t i = 0; i < size; ++i) {
      frames += decoder.Push(wire[i], 0) ? 1u : 0u;
    }
    EXPECT_EQ(frames, 1u);
    return decoder.message();
  }

  engine::testing::ScriptedLog log_;
  engine::ClockReading now_{1'000, 1'700'000'000'000};
  engine::Service service_;
};

TEST(World, SensesWhatTheServerAnswers) {
  WorldConfig config = SmallWorld();
  config.groups = {Lattice(6)};
  Server server(config.field);
  const auto world = Made(std::move(config));
  const Robots& robots = world->robots();
  for (uint8_t id = 1; id <= robots.count; ++id) {
    server.Ask<protocol::HelloAnswer>(protocol::HelloRequest{id, 1, 1, 0});
  }
  int sensed = 0;
  for (uint8_t step = 1; step <= 60; ++step) {
    server.SetTime(world->time().now_ms());
    ASSERT_TRUE(world->Sense().ok());
    for (size_t i = 0; i < robots.count; ++i) {
      const client::Pose pose =
          sim::ToClientPose({robots.x_m[i], robots.y_m[i], robots.heading_rad[i]});
      const auto answer = server.Ask<protocol::SenseAnswer>(protocol::SenseRequest{
          static_cast<uint8_t>(i + 1), 1, false, {pose.x_mm, pose.y_mm, pose.heading}});
      ASSERT_EQ(robots.p_left[0][i], answer.left) << "robot " << i << ", step " << int{step};
      ASSERT_EQ(robots.p_right[0][i], answer.right) << "robot " << i << ", step " << int{step};
      sensed += answer.left != answer.right ? 1 : 0;
    }
    for (size_t i = 0; i < robots.count; ++i) {
      server.Ask<protocol::DepositAnswer>(protocol::DepositRequest{
          static_cast<uint8_t>(i + 1), 1, step, static_cast<int16_t>(robots.sensed_x[i]),
          static_cast<int16_t>(robots.sensed_y[i]), 1});
    }
    ASSERT_TRUE(world->Act().ok());
  }
  EXPECT_GT(sensed, 1000);
}

// All pairs, after each step.
void ExpectNoOverlap(const Robots& robots) {
  for (size_t a = 0; a < robots.count; ++a) {
    for (size_t b = 0; b < a; ++b) {
      const double least = static_cast<double>(robots.radius_m[a] + robots.radius_m[b]);
      ASSERT_GE(std::hypot(robots.x_m[a] - robots.x_m[b], robots.y_m[a] - robots.y_m[b]),
                least - 1e-7)
          << "robots " << a << " and " << b;
    }
  }
}

// Drives all robots at random, and judges after each step.
WorldTally DriveAtRandom(WorldConfig config, double most_m_s, uint64_t steps) {
  const auto world = Made(std::move(config));
  Robots& robots = world->mutable_robots();
  for (uint64_t step = 0; step < steps; ++step) {
    for (size_t i = 0; i < robots.count; ++i) {
      robots.want_left_m_s[i] = most_m_s * PheromoneUniform(1, i, step / 5, 1);
      robots.want_right_m_s[i] = most_m_s * PheromoneUniform(1, i, step / 5, 2);
    }
    EXPECT_TRUE(world->Step().ok());
    ExpectNoOverlap(robots);
  }
  double way_m = 0;
  for (const double way : robots.way_m) {
    way_m += way;
  }
  EXPECT_GT(way_m, 100);  // it is no crowd that stands
  return world->tally();
}

TEST(World, RobotsNeverOverlap) {
  WorldConfig config = SmallWorld();
  config.groups = {Lattice(12, 0.2), Alone({8, 8, 0})};
  config.groups[0].behaviour = nullptr;
  config.groups[0].wheels.acceleration_m_s2 = 0;
  config.groups[1].radius_m = 0.5;
  const WorldTally tally = DriveAtRandom(std::move(config), 1.2, 120);
  EXPECT_GT(tally.moves.robot_contacts, 500u);
  EXPECT_GT(tally.moves.wall_contacts, 20u);
}

// They go farther in a step than they are wide.
TEST(World, SmallAndFastRobotsNeverOverlap) {
  WorldConfig config = SmallWorld();
  config.field.map.width_um = config.field.map.height_um = 3'000'000;
  RobotGroup group = Lattice(1, 0.05);
  group.behaviour = nullptr;
  group.starts.clear();
  for (int i = 0; i < 144; ++i) {
    group.starts.push_back({0.1 + 0.22 * (i % 12), 0.1 + 0.22 * (i / 12), 2.4 * i});
  }
  group.wheels.acceleration_m_s2 = 0;
  group.wheels.max_speed_m_s = 3;
  config.groups = {group};
  EXPECT_GT(DriveAtRandom(std::move(config), 3, 100).moves.robot_contacts, 500u);
}

TEST(World, ARobotStopsBeforeAWallAndGoesOnWhenItIsGone) {
  WorldConfig config = SmallWorld();
  field::ObstacleMask wall(config.field.map.columns(), config.field.map.rows());
  field::BlockRectangle(config.field.map, {6'000'000, 0}, {6'100'000, 9'000'000}, &wall);
  config.field.obstacles = field::Shared(std::move(wall));
  config.groups = {Alone({5, 5, 0})};
  const auto world = Made(std::move(config));
  world->mutable_robots().want_left_m_s[0] = 0.5;
  world->mutable_robots().want_right_m_s[0] = 0.5;
  const auto drive = [&] {
    for (int step = 0; step < 40; ++step) {
      ASSERT_TRUE(world->Step().ok());
    }
  };
  drive();
  // The first blocked square begins at 5.95 m, or a cell before.
  EXPECT_LE(world->robots().x_m[0], 5.95 - 0.1);
  EXPECT_GT(world->robots().x_m[0], 5.6);
  EXPECT_EQ(world->robots().contact[0], kPheromoneWallContact);
  ASSERT_TRUE(world->ReplaceObstacles({}).ok());
  drive();
  EXPECT_GT(world->robots().x_m[0], 8);
}

TEST(World, AtTheEdgeOfTheMapARobotStops) {
  WorldConfig config = SmallWorld();
  config.groups = {Alone({9.5, 5, 0})};
  const auto world = Made(std::move(config));
  world->mutable_robots().want_left_m_s[0] = 1;
  world->mutable_robots().want_right_m_s[0] = 1;
  for (int step = 0; step < 40; ++step) {
    ASSERT_TRUE(world->Step().ok());
    ASSERT_LE(world->robots().x_m[0], 10);
  }
  EXPECT_EQ(world->robots().contact[0], kPheromoneWallContact);
}

TEST(World, AFailedRobotStandsAndDepositsNothing) {
  WorldConfig config = SmallWorld();
  config.groups = {Lattice(2)};
  const auto world = Made(std::move(config));
  ASSERT_TRUE(world->Step().ok());
  for (size_t i = 0; i < 4; ++i) {
    world->Fail(i);
  }
  for (int step = 0; step < 10; ++step) {
    ASSERT_TRUE(world->Step().ok());
  }
  EXPECT_EQ(world->tally().deposited_quanta, 4u);
  EXPECT_EQ(world->robots().left_m_s[0], 0);
}

TEST(World, AnActionThatCannotBeMeantIsAnErrorThatNamesRobotAndField) {
  const auto error_of = [](auto&& spoil) {
    WorldConfig config = SmallWorld();
    config.groups = {Lattice(2)};
    config.groups[0].behaviour = nullptr;
    const auto world = Made(std::move(config));
    EXPECT_TRUE(world->Sense().ok());
    spoil(&world->mutable_robots());
    return std::string(world->Act().ErrorOr("none"));
  };
  EXPECT_EQ(error_of([](Robots*) {}), "none");
  EXPECT_EQ(error_of([](Robots* r) { r->want_left_m_s[2] = std::nan(""); }),
            "robot 3 (index 2) of \"lattice\", step 0: left_m_s is nan, expected -1.2 to 1.2");
  EXPECT_EQ(error_of([](Robots* r) { r->want_right_m_s[0] = 1.3; }),
            "robot 1 (index 0) of \"lattice\", step 0: right_m_s is 1.3, expected -1.2 to 1.2");
  EXPECT_EQ(
      error_of([](Robots* r) { r->want_right_m_s[3] = -std::numeric_limits<double>::infinity(); }),
      "robot 4 (index 3) of \"lattice\", step 0: right_m_s is -inf, expected -1.2 to 1.2");
  EXPECT_EQ(
      error_of([](Robots* r) {
        r->want_quanta[1] = 2;
        r->want_type[1] = 9;
      }),
      "robot 2 (index 1) of \"lattice\", step 0: pheromone is 9, expected one of the map that is "
      "no blend, since it deposits 2 quanta");
  EXPECT_EQ(error_of([](Robots* r) { r->want_load[0] = 5; }),
            "robot 1 (index 0) of \"lattice\", step 0: load is 5, expected -1, 0 or 1");
}

TEST(World, AStartThatCannotBeIsRefused) {
  const auto error_of = [](const RobotGroup& group) {
    WorldConfig config = SmallWorld();
    config.groups = {group};
    return std::string(World::Create(std::move(config)).ErrorOr("none"));
  };
  RobotGroup group = Lattice(2, 0.25);
  EXPECT_EQ(error_of(group), "none");
  group.starts[3].x_m -= 0.01;
  EXPECT_NE(error_of(group).find("(0.3, 0.8), where it overlaps another robot"), std::string::npos)
      << error_of(group);
  group.starts[3].x_m = 10.001;
  EXPECT_NE(error_of(group).find("robot 4 (index 3) of \"lattice\" starts at (10.001, 0.8)"),
            std::string::npos);
  group = Lattice(2);
  group.senses = {3};
  EXPECT_EQ(error_of(group), "group \"lattice\" senses pheromone 3, which the map does not have");
}

}  // namespace
}  // namespace pheromone::lab
