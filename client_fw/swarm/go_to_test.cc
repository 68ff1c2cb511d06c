// Robots with the firmware's core are led to a point by the real engine over a radio channel.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "client_fw/swarm/path_experiment.h"
#include "client_fw/swarm/simulation.h"

namespace pheromone::swarm {
namespace {

using field::PointUm;

constexpr double kToleranceM = 0.1;
constexpr double kRobotRadiusM = 0.2;

struct Trip {
  sim::PlanePose start;
  PointUm to;
};

// A circuit of type 2 lies on the map of 10 m x 10 m; the robot begins somewhere else.
SimulationConfig On(const Trip& trip, client::Law law, int16_t speed_mm_s, uint64_t seed) {
  SimulationConfig config;
  config.engine = EngineConfigOf({.shape = Shape::kCircle});
  config.robot.client.type = 2;
  config.robot.client.law = law;
  config.robot.client.speed_mm_s = speed_mm_s;
  config.robot.start = trip.start;
  config.radio.seed = seed;
  config.radio.block_loss = 0.01;
  return config;
}

PointUm Position(const sim::PlanePose& pose) {
  return {std::llround(pose.x_m * 1e6), std::llround(pose.y_m * 1e6)};
}

double DistanceM(PointUm a, PointUm b) {
  return std::hypot(static_cast<double>(a.x - b.x), static_cast<double>(a.y - b.y)) / 1e6;
}

struct Outcome {
  bool arrived = false;
  double end_m = 0;          ///< from the goal, when it stands
  double travelled_m = 0;    ///
  double off_the_map_m = 0;  ///< the farthest
  bool hit = false;          ///< an obstacle
  bool stands = false;
};

Outcome Drive(const SimulationConfig& config, const Trip& trip) {
  Simulation simulation(config);
  Outcome outcome;
  simulation.RunTo(1'000);
  (void)simulation.Issue({0, config.robot.client.id, protocol::CommandCode::kResume, {}});
  simulation.RunTo(1'500);
  const Status set = simulation.service().SetGoal(0, config.robot.client.id, trip.to,
                                                  static_cast<uint32_t>(kToleranceM * 1e6));
  EXPECT_TRUE(set.ok()) << set.error();
  const auto has_goal = [&] {
    return simulation.service().Inspect([&](const engine::Engine& engine) {
      return engine.robots().Find(0, config.robot.client.id)->goal.has_value();
    });
  };
  const field::MapGeometry& map = config.engine.field.map;
  PointUm last = Position(simulation.robot().true_pose());
  int64_t arrived_ms = -1;
  for (int64_t ms = 1'520; ms < 120'000 && (arrived_ms < 0 || ms < arrived_ms + 3'000); ms += 20) {
    simulation.RunTo(ms);
    const PointUm at = Position(simulation.robot().true_pose());
    outcome.travelled_m += DistanceM(at, last);
    last = at;
    const auto off =
        std::max({map.origin.x - at.x, map.origin.y - at.y, at.x - map.origin.x - map.width_um,
                  at.y - map.origin.y - map.height_um});
    outcome.off_the_map_m = std::max(outcome.off_the_map_m, static_cast<double>(off) / 1e6);
    if (config.engine.field.obstacles) {
      for (int i = 0; i < 16; ++i) {
        const double angle = i * std::numbers::pi / 8;
        const PointUm edge{at.x + std::llround(1e6 * kRobotRadiusM * std::cos(angle)),
                           at.y + std::llround(1e6 * kRobotRadiusM * std::sin(angle))};
        outcome.hit =
            outcome.hit ||
            (map.Contains(edge) && config.engine.field.obstacles->Blocked(map.NearestNode(edge)));
      }
    }
    if (arrived_ms < 0 && !has_goal()) {
      arrived_ms = ms;
      outcome.arrived = true;
      EXPECT_LT(DistanceM(at, trip.to), kToleranceM + 0.1);
    }
  }
  outcome.end_m = DistanceM(last, trip.to);
  outcome.stands = simulation.robot().wheels() == client::WheelSpeeds{0, 0};
  return outcome;
}

// Ahead, aside, behind; near and far; one on the circuit, which it must leave.
const std::vector<Trip> kTrips = {
    {{1, 1, 0}, {8'000'000, 1'000'000}},      {{1, 1, 0}, {1'500'000, 8'000'000}},
    {{5, 5, 0}, {1'000'000, 5'000'000}},      {{5, 5, 1.5}, {9'000'000, 1'000'000}},
    {{5, 5, 3}, {5'300'000, 5'000'000}},      {{5, 5, 0}, {5'000'000, 5'165'000}},
    {{6.5, 5, 1.57}, {2'000'000, 2'000'000}}, {{9.5, 9.5, 0.8}, {500'000, 500'000}},
};

void ExpectArrivals(client::Law law, int16_t speed_mm_s, uint64_t seed = 0) {
  for (const Trip& trip : kTrips) {
    const Outcome it = Drive(On(trip, law, speed_mm_s, ++seed), trip);
    const std::string name = "trip " + std::to_string(seed) + ", law " + std::string(NameOf(law)) +
                             ", " + std::to_string(speed_mm_s) +
                             " mm/s: " + std::to_string(it.travelled_m) + " m, end " +
                             std::to_string(it.end_m) + " m";
    EXPECT_TRUE(it.arrived) << name;
    EXPECT_TRUE(it.stands) << name;
    // Of laws that do not slow down, the stopping distance of the model at this speed is added.
    const double rolls_m = law == client::Law::kCareful ? 0 : 0.05 + 0.6 * speed_mm_s / 1e3;
    EXPECT_LE(it.end_m, kToleranceM + rolls_m) << name;
    EXPECT_EQ(it.off_the_map_m, 0) << name;
    const double straight = DistanceM(Position(trip.start), trip.to);
    EXPECT_LE(it.travelled_m, 1.3 * straight + 1.5) << name;
  }
}

TEST(GoTo, ARobotArrivesWithTheDefaultLaw) {
  ExpectArrivals(client::Law::kCareful, 300);
  for (uint64_t seed = 0; seed < 100; seed += 10) {
    ExpectArrivals(client::Law::kCareful, 600, seed);
  }
}

TEST(GoTo, ARobotArrivesWithTheDifferentialLaw) {
  ExpectArrivals(client::Law::kDifferential, 300);
}

TEST(GoTo, ARobotArrivesWithTheFuzzyLaw) {
  ExpectArrivals(client::Law::kFuzzy, 300);
}

TEST(GoTo, AnObstacleIsDrivenAround) {
  const Trip trips[] = {{{2, 5, 0}, {8'000'000, 5'000'000}},
                        {{2, 5, 3.1}, {8'000'000, 5'000'000}},
                        {{8, 2, 1.5}, {2'000'000, 2'500'000}}};
  uint64_t seed = 100;
  for (const Trip& trip : trips) {
    SimulationConfig config = On(trip, client::Law::kCareful, 300, ++seed);
    field::ObstacleMask mask(config.engine.field.map.columns(), config.engine.field.map.rows());
    // A U that is open towards the robot: straight on, it would be caught.
    const field::MapGeometry& map = config.engine.field.map;
    field::BlockRectangle(map, {5'000'000, 1'500'000}, {5'200'000, 7'000'000}, &mask);
    field::BlockRectangle(map, {3'500'000, 1'500'000}, {5'200'000, 1'700'000}, &mask);
    field::BlockRectangle(map, {3'500'000, 6'800'000}, {5'200'000, 7'000'000}, &mask);
    config.engine.field.obstacles = field::Shared(std::move(mask));
    const Outcome it = Drive(config, trip);
    const std::string name = "trip " + std::to_string(seed) + ": " +
                             std::to_string(it.travelled_m) + " m, end " +
                             std::to_string(it.end_m) + " m";
    EXPECT_TRUE(it.arrived) << name;
    EXPECT_TRUE(it.stands) << name;
    EXPECT_FALSE(it.hit) << name;
    EXPECT_EQ(it.off_the_map_m, 0) << name;
    EXPECT_GT(it.travelled_m, 6) << name;
  }
}

TEST(GoTo, ACancelledRobotReturnsToTheTrail) {
  const Trip trip{{6.5, 5, 1.57}, {500'000, 500'000}};
  Simulation simulation(On(trip, client::Law::kCareful, 300, 7));
  simulation.RunTo(1'000);
  const uint8_t id = 1;
  (void)simulation.Issue({0, id, protocol::CommandCode::kResume, {}});
  simulation.RunTo(1'500);
  ASSERT_TRUE(simulation.service().SetGoal(0, id, trip.to, 100'000).ok());
  simulation.RunTo(2'000);
  ASSERT_TRUE(simulation.service().CancelGoal(0, id).ok());
  double worst_m = 0;
  for (int64_t ms = 10'000; ms < 30'000; ms += 100) {
    simulation.RunTo(ms);
    const PointUm at = Position(simulation.robot().true_pose());
    worst_m = std::max(worst_m, std::abs(DistanceM(at, {5'000'000, 5'000'000}) - 1.5));
  }
  EXPECT_LT(worst_m, 0.3);
  EXPECT_NE(simulation.robot().wheels(), (client::WheelSpeeds{0, 0}));
}

}  // namespace
}  // namespace pheromone::swarm
