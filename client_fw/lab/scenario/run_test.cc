#include "client_fw/lab/scenario/run.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>

namespace pheromone::lab {
namespace {

// Ants between a nest and food that a wall parts for a while.
LabScenario Ants(const std::string& more, int duration_s) {
  const std::string text = "[run]\nduration_s = " + std::to_string(duration_s) + R"(
[map]
width_m = 8
height_m = 4
cell_m = 0.1
[antennas]
bias_m = 0.33
[[pheromone]]
type = 1
name = "trail"
core_m = 0.1
sigma_m = 0.4
tau_s = 20
quantum = 0.125
maximum = 1.0
[[site]]
name = "nest"
kind = "nest"
at_m = [1, 2]
[[site]]
name = "food"
kind = "food"
at_m = [6.5, 2]
[[robots]]
name = "ants"
behaviour = "forage"
count = 30
area_m = [0.3, 0.3, 3.5, 3.7]
radius_m = 0.05
)" + more;
  const Result<config::Value> tree = config::ParseDocument(text, "ants.toml");
  Result<LabScenario> scenario = ReadLabScenario(tree.value(), "ants.toml");
  EXPECT_TRUE(scenario.ok()) << scenario.ErrorOr("");
  return std::move(scenario).value();
}

std::map<std::string, double> Measured(const LabScenario& scenario, int threads = 1) {
  const Result<LabResult> result = RunLab(scenario, threads, {});
  EXPECT_TRUE(result.ok()) << result.ErrorOr("");
  std::map<std::string, double> measured;
  for (const auto& [name, value] : MeasuresOf(result.value())) {
    if (value) {
      measured[name] = *value;
    }
  }
  return measured;
}

constexpr const char* kGate =
    "[[wall]]\nname = \"gate\"\npoints_m = [[4, 0], [4, 4]]\nthickness_m = 0.3\n";

TEST(LabRunTest, AWallThatOpensLetsThemThrough) {
  const auto closed = Measured(Ants(kGate, 600));
  EXPECT_EQ(closed.at("deliveries"), 0);
  // The other side is half of the floor.
  EXPECT_LT(closed.at("covered_share"), 0.6);
  const std::string event = "[[event]]\nat_s = 120\nwall = \"gate\"\nopen = true\n";
  const auto opened = Measured(Ants(kGate + event, 600));
  EXPECT_GT(opened.at("deliveries"), 5);
  EXPECT_GT(opened.at("covered_share"), 0.9);
}

TEST(LabRunTest, FoodThatIsTakenAwayEndsTheDeliveries) {
  const auto all = Measured(Ants("", 600));
  const auto gone = Measured(Ants("[[event]]\nat_s = 300\nsite = \"food\"\namount = 0\n", 600));
  EXPECT_GT(gone.at("deliveries"), 10);
  EXPECT_LT(gone.at("deliveries"), 0.7 * all.at("deliveries"));
}

TEST(LabRunTest, RobotsThatFailStand) {
  const auto measures = Measured(Ants("[[event]]\nat_s = 0\nrobots = \"ants\"\nfail = 1\n", 20));
  EXPECT_EQ(measures.at("standing_share"), 1);
  EXPECT_EQ(measures.at("deposited_quanta"), 0);
}

TEST(LabRunTest, MeasuresAreWhatTheirNamesSay) {
  const auto measures = Measured(Ants("", 240));
  EXPECT_EQ(measures.at("robots"), 30);
  EXPECT_EQ(measures.at("time_s"), 240);
  EXPECT_NEAR(measures.at("deliveries_per_robot_hour"), measures.at("deliveries") / 30 * 15, 1e-9);
  // 5.5 m without the two radii, at 0.2 m/s, with turns: no robot is faster, and none needs twice
  // the way.
  EXPECT_GT(measures.at("trip_s"), 4.5 / 0.2);
  EXPECT_GT(measures.at("path_efficiency"), 0.5);
  EXPECT_LE(measures.at("path_efficiency"), 1);
  EXPECT_EQ(measures.at("delivered_quality"), measures.at("deliveries"));
}

TEST(LabRunTest, ThreadsChangeNothing) {
  EXPECT_EQ(RunLab(Ants(kGate, 20), 1, {}).value().hash,
            RunLab(Ants(kGate, 20), 3, {}).value().hash);
}

}  // namespace
}  // namespace pheromone::lab
