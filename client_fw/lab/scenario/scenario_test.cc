#include "client_fw/lab/scenario/scenario.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>

namespace pheromone::lab {
namespace {

constexpr std::string_view kAnts = R"([run]
duration_s = 20
seed = 4

[map]
width_m = 10
height_m = 8
cell_m = 0.1

[antennas]
bias_m = 0.33

[obstacles]
walls = [{points_m = [[0, 7.5], [9, 7.5]], thickness_m = 0.1}]

[[pheromone]]
type = 1
name = "trail"
core_m = 0.1
sigma_m = 0.4
tau_s = 20
quantum = 0.125
maximum = 1.0

[[pheromone]]
type = 2
name = "home"
core_m = 0.1
sigma_m = 0.4
tau_s = 60
quantum = 0.125
maximum = 1.0

[[site]]
name = "nest"
kind = "nest"
at_m = [2, 2]

[[site]]
name = "crumbs"
kind = "food"
at_m = [7, 5]
radius_m = 0.75
amount = 12
quality = 3
refill_s = 30

[[wall]]
name = "gate"
points_m = [[5, 0], [5, 7]]

[[robots]]
name = "ants"
behaviour = "forage"
parameters = {quanta = 2, home = "pheromone", wander_deg = 10}
count = 20
area_m = [1, 1, 4, 4]
senses = ["trail", 2]
radius_m = 0.12

[[robots]]
name = "guard"
behaviour = "explore"
starts = [[8, 2, 90]]
odometry_bias = 0.01
fix_period_s = 5
fix_sigma_m = 0.05

[[event]]
at_s = 12
wall = "gate"
open = true

[[event]]
at_s = 10
site = "crumbs"
to_m = [8, 1]

[[event]]
at_s = 15
robots = "ants"
fail = 0.5
)";

Result<LabScenario> Parsed(const std::string& text, const KeyValues& settings = {}) {
  PHEROMONE_TRY(config::Value tree, config::ParseDocument(text, "ants.toml"));
  for (const auto& [key, value] : settings) {
    PHEROMONE_TRY_STATUS(SetValue(key, value, &tree));
  }
  return ReadLabScenario(tree, "ants.toml");
}

std::string ErrorOf(const KeyValues& settings) {
  return Parsed(std::string(kAnts), settings).ErrorOr("none");
}

// With the first `from` of the text replaced.
std::string ErrorWith(std::string_view from, std::string_view to) {
  std::string text(kAnts);
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  return Parsed(text).ErrorOr("none");
}

TEST(LabScenarioTest, ReadsAllThatIsInIt) {
  const Result<LabScenario> parsed = Parsed(std::string(kAnts));
  ASSERT_TRUE(parsed.ok()) << parsed.error();
  const LabScenario& scenario = parsed.value();
  EXPECT_EQ(scenario.name, "ants");
  EXPECT_EQ(scenario.duration_ms, 20'000);
  EXPECT_EQ(scenario.world.seed, 4u);
  EXPECT_EQ(scenario.world.step_ms, 200);
  ASSERT_EQ(scenario.world.groups.size(), 2u);
  const RobotGroup& ants = scenario.world.groups[0];
  EXPECT_EQ(ants.starts.size(), 20u);
  for (const sim::PlanePose& start : ants.starts) {
    EXPECT_TRUE(start.x_m >= 1 && start.x_m <= 4 && start.y_m >= 1 && start.y_m <= 4);
  }
  EXPECT_EQ(ants.senses, (std::vector<uint8_t>{1, 2}));
  EXPECT_EQ(ants.deposits, 1);
  EXPECT_EQ(ants.radius_m, 0.12);
  EXPECT_EQ(scenario.plans[0].kind->name, "forage");
  EXPECT_EQ(scenario.plans[0].values.find("quanta")->second, 2);
  EXPECT_EQ(scenario.plans[0].values.find("home")->second, 1);
  EXPECT_EQ(scenario.plans[0].values.find("wander_deg")->second, 10);
  EXPECT_EQ(scenario.plans[0].values.find("speed_m_per_s")->second, 0.2);
  const RobotGroup& guard = scenario.world.groups[1];
  EXPECT_NEAR(guard.starts[0].heading_rad, std::numbers::pi / 2, 1e-15);
  EXPECT_TRUE(guard.senses.empty());
  EXPECT_EQ(guard.odometry.bias, 0.01);
  EXPECT_EQ(guard.fixes.period_ms, 5'000);
  ASSERT_EQ(scenario.world.sites.size(), 2u);
  EXPECT_EQ(scenario.world.sites[0].site.is_food, 0);
  const SiteConfig& food = scenario.world.sites[1];
  EXPECT_EQ(food.site.x_m, 7);
  EXPECT_EQ(food.site.radius_m, 0.75);
  EXPECT_EQ(food.site.amount, 12);
  EXPECT_EQ(food.site.quality, 3);
  EXPECT_EQ(food.refill_ms, 30'000u);
  ASSERT_EQ(scenario.events.size(), 3u);  // in the order of their times
  EXPECT_EQ(scenario.events[0].kind, LabEvent::Kind::kMoveSite);
  EXPECT_EQ(scenario.events[0].to, (field::PointUm{8'000'000, 1'000'000}));
  EXPECT_EQ(scenario.events[1].kind, LabEvent::Kind::kGate);
  EXPECT_EQ(scenario.events[2].amount, 0.5);
}

TEST(LabScenarioTest, AClosedGateIsAnObstacleAndAnOpenOneIsNone) {
  const LabScenario scenario = Parsed(std::string(kAnts)).value();
  std::vector<Gate> gates = scenario.gates;
  const field::NodeIndex in_gate{50, 30};
  const field::NodeIndex in_wall{50, 75};
  EXPECT_TRUE(ObstaclesOf(scenario, gates)->Blocked(in_gate));
  EXPECT_TRUE(ObstaclesOf(scenario, gates)->Blocked(in_wall));
  gates[0].open = true;
  EXPECT_FALSE(ObstaclesOf(scenario, gates)->Blocked(in_gate));
  EXPECT_TRUE(ObstaclesOf(scenario, gates)->Blocked(in_wall));
}

TEST(LabScenarioTest, AMistakeNamesLineKeyAndWhatIsExpected) {
  EXPECT_EQ(ErrorWith("quanta = 2", "quantum = 2"),
            "ants.toml:55:15: robots[1].parameters.quantum: unknown key, expected quanta?");
  EXPECT_EQ(ErrorWith("wander_deg = 10", "wander_deg = 200"),
            "ants.toml:55:60: robots[1].parameters.wander_deg: found 200, expected a number from 0 "
            "to 180");
  EXPECT_EQ(ErrorWith("\"forage\"", "\"farm\""),
            "ants.toml:54:13: robots[1].behaviour: found the string \"farm\", expected one of "
            "\"follow\", \"forage\", \"patrol\", \"aggregate\", \"explore\"");
  EXPECT_EQ(
      ErrorWith("[\"trail\", 2]", "[\"trail\"]"),
      "ants.toml:58:10: robots[1].senses: found an array of 1, expected at least 2 pheromones, "
      "for this behaviour");
  EXPECT_EQ(ErrorWith("name = \"home\"\ncore_m = 0.1\nsigma_m = 0.4\ntau_s = 60\nquantum = 0.125\n"
                      "maximum = 1.0",
                      "name = \"home\"\nblend = [{pheromone = \"trail\"}]\n\n\n\n"),
            "ants.toml:58:20: robots[1].senses: found 2, expected 1 or \"trail\", since home = "
            "\"pheromone\" deposits the second");
  const std::string no_room = ErrorWith("count = 20", "count = 2000");
  EXPECT_EQ(no_room.find("ants.toml:56:9: robots[1].count: found room for "), 0u) << no_room;
  EXPECT_NE(no_room.find(" of 2000 robots, expected fewer or smaller ones, or a larger area_m"),
            std::string::npos);
  EXPECT_EQ(ErrorWith("to_m = [8, 1]", "to_m = [18, 1]"),
            "ants.toml:77:8: event[2].to_m: found [18, 1], expected a point on the map, "
            "from (0, 0) to (10, 8)");
  EXPECT_EQ(ErrorWith("wall = \"gate\"", "wall = \"door\""),
            "ants.toml:71:8: event[1].wall: found the string \"door\", expected one of \"gate\"");
  EXPECT_EQ(ErrorWith("[[8, 2, 90]]", "[[5, 2, 90]]"),
            "ants.toml:64:11: robots[2].starts: found [5, 2, 90], expected poses farther than "
            "radius_m from every obstacle");
  EXPECT_EQ(ErrorWith("kind = \"nest\"", "kind = \"nest\"\namount = 3"),
            "ants.toml:37:1: site[1].amount: not permitted with kind = \"nest\", expected food");
  EXPECT_EQ(ErrorWith("wander_deg = 10", "speed_m_per_s = 2"),
            "ants.toml:55:14: robots[1].parameters: found speed_m_per_s = 2 for wheels of at most "
            "1.2 m/s");
  EXPECT_EQ(ErrorWith("name = \"guard\"", "name = \"ants\""),
            "ants.toml:81:10: event[3].robots: found a name that several have, expected names of "
            "their own");
}

TEST(LabScenarioTest, ATableThatIsNotThereCanBeSet) {
  std::string text(kAnts);
  text.erase(0, text.find("[map]"));
  EXPECT_EQ(Parsed(text, {{"run.seed", "7"}}).value().world.seed, 7u);
}

TEST(LabScenarioTest, TablesOfATreeAreADocument) {
  const config::Value tree =
      config::ParseDocument(
          "[[path]]\nname = \"a\"\n[map]\nwidth_m = 2.5\nwide = true\n[run]\n"
          "seed = 1\n[[path]]\npoints_m = [[1, 2], [3, 4]]\n",
          "a.toml")
          .value();
  constexpr std::string_view kNames[] = {"map", "antennas", "path"};
  const std::string text = TomlOfTables(tree, kNames);
  EXPECT_EQ(Flatten(config::ParseDocument(text, "b.toml").value()),
            (KeyValues{{"map.wide", "true"},
                       {"map.width_m", "2.5"},
                       {"path[1].name", "a"},
                       {"path[2].points_m", "[[1, 2], [3, 4]]"}}))
      << text;
}

TEST(LabScenarioTest, AValueCanBeSetBeforeItIsRead) {
  const LabScenario scenario = Parsed(std::string(kAnts), {{"run.seed", "9"},
                                                           {"robots[1].count", "7"},
                                                           {"robots[1].parameters.home", "bearing"},
                                                           {"robots[2].radius_m", "0.3"},
                                                           {"wall.open", "true"}})
                                   .value();
  EXPECT_EQ(scenario.world.seed, 9u);
  EXPECT_EQ(scenario.world.groups[0].starts.size(), 7u);
  EXPECT_EQ(scenario.plans[0].values.find("home")->second, 0);
  EXPECT_EQ(scenario.world.groups[1].radius_m, 0.3);
  EXPECT_TRUE(scenario.gates[0].open);
  EXPECT_EQ(ErrorOf({{"robots[1].count", "no"}}),
            "ants.toml:56:9: robots[1].count: found the string \"no\", expected a whole number "
            "from 1 to 1000000");
  EXPECT_EQ(ErrorOf({{"robots.count", "3"}}),
            "--set robots.count: found 2 tables [[robots]], expected robots[N], with N from 1 to "
            "2");
  EXPECT_EQ(ErrorOf({{"robots[3].count", "3"}}),
            "--set robots[3].count: found 2 tables [[robots]], expected a number from 1 to 2");
  EXPECT_EQ(ErrorOf({{"robot.count", "3"}}), "ants.toml:1:1: robot: unknown key, expected robots?");
  EXPECT_EQ(ErrorOf({{"robot[1].count", "3"}}),
            "--set robot[1].count: the scenario has no table robot[1]");
  EXPECT_EQ(ErrorOf({{"path.count", "3"}}), "--set path.count: the scenario has no table path");
  EXPECT_EQ(ErrorOf({{"run.sed", "3"}}), "ants.toml:1:1: run.sed: unknown key, expected seed?");
}

TEST(LabScenarioTest, ParametersAreAllValuesButTheSeedAndTheSweep) {
  const LabScenario scenario =
      Parsed(std::string(kAnts) + "[sweep]\nseeds = 3\n", {{"robots[1].count", "7"}}).value();
  EXPECT_EQ(scenario.parameters.front(),
            (std::pair<std::string, std::string>("antennas.bias_m", "0.33")));
  const auto has = [&](const std::string& key, const std::string& value) {
    return std::find(scenario.parameters.begin(), scenario.parameters.end(),
                     std::pair(key, value)) != scenario.parameters.end();
  };
  EXPECT_TRUE(has("robots[1].count", "7"));
  EXPECT_TRUE(has("robots[1].senses", "[\"trail\", 2]"));
  EXPECT_TRUE(has("robots[1].parameters.home", "pheromone"));
  EXPECT_TRUE(has("site[2].at_m", "[7, 5]"));
  for (const auto& [key, value] : scenario.parameters) {
    EXPECT_NE(key, "run.seed");
    EXPECT_FALSE(key.starts_with("sweep"));
  }
}

}  // namespace
}  // namespace pheromone::lab
