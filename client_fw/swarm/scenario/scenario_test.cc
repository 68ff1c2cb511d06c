#include "client_fw/swarm/scenario/scenario.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "client_fw/swarm/robots.h"

namespace pheromone::swarm {
namespace {

constexpr std::string_view kArena = R"([map]
width_m = 10.0
height_m = 10.0
cell_m = 0.1
[antennas]
bias_m = 0.33
[[pheromone]]
type = 2
name = "path"
core_m = 0.1
sigma_m = 0.4
tau_s = 0
quantum = 0.125
maximum = 1.0
[[pheromone]]
type = 3
name = "guide"
blend = [{pheromone = "path"}]
)";

Result<Scenario> Parse(const std::string& more) {
  return ParseScenario(std::string(kArena) + more, "s.toml");
}

std::string ErrorOf(const std::string& more) {
  const Result<Scenario> scenario = Parse(more);
  return scenario.ErrorOr("accepted");
}

TEST(Scenario, WhatARobotDoesWithoutATrailCanBeChosen) {
  const std::string robots = "[[robots]]\npheromone = 2\nstarts = [[1, 2, 90]]\nlost_trail = ";
  const std::pair<std::string, client::LostTrail> choices[] = {
      {"search", client::LostTrail::kSearch},
      {"stop", client::LostTrail::kStop},
      {"straight", client::LostTrail::kStraight},
      {"spiral", client::LostTrail::kSpiral}};
  for (const auto& [word, choice] : choices) {
    const Result<Scenario> parsed = Parse(robots + '"' + word + "\"\n");
    ASSERT_TRUE(parsed.ok()) << parsed.error();
    EXPECT_EQ(choice, parsed.value().groups[0].client.lost_trail);
  }
  EXPECT_EQ(0u, ErrorOf(robots + "\"on\"\n")
                    .find("s.toml:22:14: robots[1].lost_trail: found the string \"on\", expected"))
      << ErrorOf(robots + "\"on\"\n");
}

// 0.6 m/s: 0.21 m until it is noticed, and 0.6 m to brake at 0.3 m/s2.
TEST(Scenario, ASpeedThatDoesNotFitTheTrailIsAWarning) {
  const std::string robots =
      "[[robots]]\npheromone = 2\nstarts = [[1, 2, 90]]\ndrive = \"p3dx-sh\"\nspeed_m_per_s = ";
  const Result<Scenario> fast = Parse(robots + "0.6\n");
  ASSERT_TRUE(fast.ok()) << fast.error();
  ASSERT_EQ(1u, fast.value().warnings.size());
  const std::string& text = fast.value().warnings[0].text;
  EXPECT_EQ(0u, text.find("s.toml:23:17: robots[1].speed_m_per_s: at 0.6 m/s the robot needs 0.81"))
      << text;
  const Result<Scenario> slow = Parse(robots + "0.4\n");
  ASSERT_TRUE(slow.ok()) << slow.error();
  EXPECT_TRUE(slow.value().warnings.empty());
}

TEST(Scenario, ATableOfTheServerAloneIsToldWithThoseThatAScenarioMayHave) {
  const Result<Scenario> parsed =
      Parse("[[robots]]\npheromone = 2\nstarts = [[1, 2, 90]]\n[[tag]]\nname = \"door\"\n");
  ASSERT_FALSE(parsed.ok());
  EXPECT_NE(parsed.error().find("tag: unknown key, expected one of run, radio, robots, map, "
                                "antennas, pheromone, obstacles, path, print"),
            std::string::npos)
      << parsed.error();
}

TEST(Scenario, WhatIsLeftOutHasItsDefault) {
  const Result<Scenario> parsed = Parse("[[robots]]\npheromone = 2\nstarts = [[1, 2, 90]]\n");
  ASSERT_TRUE(parsed.ok()) << parsed.error();
  const Scenario& scenario = parsed.value();
  EXPECT_EQ("s", scenario.name);
  EXPECT_EQ(60'000, scenario.duration_ms);
  EXPECT_EQ(200, scenario.sample_ms);
  EXPECT_EQ(1u, scenario.seed);
  EXPECT_EQ(9600, scenario.timing.baud);
  EXPECT_EQ(2'000'000, scenario.timing.turnaround_ns);
  EXPECT_TRUE(scenario.timing.carrier_detect);
  ASSERT_EQ(1u, scenario.engine.links.size());
  EXPECT_EQ(9, scenario.engine.links[0].response_window_ms);
  ASSERT_EQ(1u, scenario.groups.size());
  const RobotGroup& group = scenario.groups[0];
  EXPECT_EQ(1, group.count);
  EXPECT_EQ(200, group.client.speed_mm_s);
  EXPECT_EQ(200, group.client.period_ms);
  EXPECT_EQ(client::Law::kCareful, group.client.law);
  EXPECT_EQ(client::LostTrail::kSearch, group.client.lost_trail);
  EXPECT_TRUE(scenario.warnings.empty());
  EXPECT_FALSE(group.client.lay_trail);
  EXPECT_EQ(0.25, group.radius_m);
  EXPECT_EQ(nullptr, group.pioneer);
  EXPECT_EQ("", group.image);
  EXPECT_EQ(1, group.starts[0].x_m);
  EXPECT_EQ(2, group.starts[0].y_m);
  EXPECT_DOUBLE_EQ(std::numbers::pi / 2, group.starts[0].heading_rad);
}

TEST(Scenario, EveryKeyIsTakenOver) {
  const Result<Scenario> parsed = Parse(R"([run]
duration_s = 12.5
sample_s = 0.1
seed = 42
[radio]
baud = 19200
channels = 2
turnaround_s = 0.02
server_delay_s = 0.008
adapter_latency_s = 0.016
carrier_detect = false
loss = 0.1
bit_error = 0.001
hidden_pairs = [[1, 3]]
[[robots]]
pheromone = "path"
starts = [[1, 2, 0], [2, 2, 0]]
count = 3
spread_m = 0.5
law = "paper"
speed_m_per_s = 0.3
period_s = 0.25
trail = true
radius_m = 0.3
drive = "peoplebot-sh"
client = "core"
[[robots]]
pheromone = "guide"
starts = [[5, 5, -90]]
)");
  ASSERT_TRUE(parsed.ok()) << parsed.error();
  const Scenario& scenario = parsed.value();
  EXPECT_EQ(12'500, scenario.duration_ms);
  EXPECT_EQ(100, scenario.sample_ms);
  EXPECT_EQ(42u, scenario.seed);
  EXPECT_EQ(19'200, scenario.timing.baud);
  EXPECT_EQ(2u, scenario.engine.links.size());
  EXPECT_EQ(20'000'000, scenario.timing.turnaround_ns);
  EXPECT_EQ(16'000'000, scenario.timing.adapter_ns);
  EXPECT_EQ(8'000'000, scenario.timing.server_delay_ns);
  EXPECT_FALSE(scenario.timing.carrier_detect);
  EXPECT_EQ(0.1, scenario.loss);
  EXPECT_EQ(0.001, scenario.bit_error);
  EXPECT_EQ((std::vector<std::pair<size_t, size_t>>{{0, 2}}), scenario.hidden_pairs);
  EXPECT_EQ(4, scenario.robot_count());
  EXPECT_EQ(3, scenario.groups[0].count);
  EXPECT_EQ(0.5, scenario.groups[0].spread_m);
  EXPECT_EQ(client::Law::kPaper, scenario.groups[0].client.law);
  EXPECT_EQ(300, scenario.groups[0].client.speed_mm_s);
  EXPECT_EQ(250, scenario.groups[0].client.period_ms);
  EXPECT_TRUE(scenario.groups[0].client.lay_trail);
  EXPECT_EQ(0.3, scenario.groups[0].radius_m);
  ASSERT_NE(nullptr, scenario.groups[0].pioneer);
  EXPECT_EQ("peoplebot-sh", scenario.groups[0].pioneer->subclass);
  EXPECT_EQ("", scenario.groups[0].image);
  EXPECT_EQ(3, scenario.groups[1].client.type);
}

TEST(Scenario, ErrorsNameFileLineAndKey) {
  EXPECT_EQ("s.toml:1:1: robots: missing, expected at least one [[robots]]", ErrorOf(""));
  EXPECT_EQ(
      "s.toml:20:8: run.seed: found the string \"x\", expected a whole number from 0 to "
      "9223372036854775807\n"
      "s.toml:22:1: robots[1].spede_m_per_s: unknown key, expected speed_m_per_s?\n"
      "s.toml:23:13: robots[1].pheromone: found the string \"pth\", expected 2 or \"path\", 3 or "
      "\"guide\"\n"
      "s.toml:24:11: robots[1].starts: found [11, 2, 0], expected poses on the map, [x_m, y_m, "
      "heading_deg] each, such as [[1, 2, 90]]",
      ErrorOf("[run]\nseed = \"x\"\n[[robots]]\nspede_m_per_s = 1\npheromone = \"pth\"\n"
              "starts = [[11, 2, 0]]\n"));
}

TEST(Scenario, WhatTheServersTablesGetWrongIsToldInTheSameWay) {
  const Result<Scenario> parsed =
      ParseScenario("[map]\nwidth = 3\nheight_m = 3.0\ncell_m = 0.1\n[[link]]\n", "s.toml");
  ASSERT_FALSE(parsed.ok());
  EXPECT_NE(std::string::npos, parsed.error().find("s.toml:2:1: map.width: unknown key"));
  EXPECT_NE(std::string::npos, parsed.error().find("s.toml:5:3: link: unknown key"));
}

TEST(Scenario, RobotsThatCannotBeAreRefused) {
  const std::string robot = "[[robots]]\npheromone = 2\nstarts = [[1, 2, 90]]\n";
  for (const char* more :
       {"count = 0\n", "count = 255\n", "law = \"best\"\n", "speed_m_per_s = 3\n", "period_s = 0\n",
        "spread_m = -1\n", "trail = 1\n", "spread_m = nan\n", "radius_m = -0.1\n",
        "radius_m = nan\n", "drive = \"p4dx\"\n", "drive = 3\n", "client = \"arm\"\n",
        "image = \"x.elf\"\n"}) {
    EXPECT_NE("accepted", ErrorOf(robot + more)) << more;
  }
  EXPECT_NE("accepted", ErrorOf("[[robots]]\npheromone = 3\nstarts = [[1, 2, 0]]\ntrail = true\n"));
  EXPECT_NE("accepted", ErrorOf("[[robots]]\npheromone = 2\n"));
  EXPECT_NE("accepted", ErrorOf("[[robots]]\npheromone = 2\nstarts = []\n"));
  EXPECT_NE("accepted", ErrorOf("[[robots]]\npheromone = 2\nstarts = [[1, 2]]\n"));
  EXPECT_NE("accepted", ErrorOf(robot + "count = 200\n" + robot + "count = 200\n"));
}

TEST(Scenario, HiddenPairsAreOfRobotsThatThereAre) {
  const std::string robots = "[[robots]]\npheromone = 2\nstarts = [[1, 2, 0], [2, 2, 0]]\n";
  EXPECT_EQ("accepted", ErrorOf("[radio]\nhidden_pairs = [[1, 2]]\n" + robots));
  for (const char* pairs : {"[[1, 3]]", "[[0, 1]]", "[[1, 1]]", "[1, 2]", "[[1]]", "3"}) {
    EXPECT_NE(std::string::npos,
              ErrorOf("[radio]\nhidden_pairs = " + std::string(pairs) + "\n" + robots)
                  .find("pairs of two different robots, numbers from 1 to 2"))
        << pairs;
  }
}

TEST(Scenario, ARobotDoesNotStartInAWall) {
  const std::string wall = "[obstacles]\nrectangles_m = [[3, 3, 4, 4]]\n";
  const std::string robot = "[[robots]]\npheromone = 2\n";
  EXPECT_EQ("accepted", ErrorOf(wall + robot + "starts = [[2.5, 3.5, 0]]\n"));
  EXPECT_EQ(
      "s.toml:23:22: robots[1].starts: found [2.8, 3.5, 0], expected poses farther than radius_m "
      "from every obstacle",
      ErrorOf(wall + robot + "starts = [[1, 1, 0], [2.8, 3.5, 0]]\n"));
  EXPECT_EQ("accepted", ErrorOf(wall + robot + "starts = [[2.8, 3.5, 0]]\nradius_m = 0.1\n"));
}

TEST(Scenario, AnImageIsRefusedWhereItCannotRun) {
  const std::string avr = "[[robots]]\npheromone = 2\nstarts = [[1, 2, 0]]\nclient = \"avr\"\n";
  const std::string pioneer = "drive = \"p3dx\"\n";
  const std::string accepted = ErrorOf(avr + pioneer);
  if (HasAvrRobots()) {
    EXPECT_EQ("accepted", accepted);
  } else {
    EXPECT_EQ(
        "s.toml:22:10: robots[1].client: this program was built without libsimavr, which simulates "
        "an AVR, expected \"core\"",
        accepted);
  }
  for (const auto& [text, expected] : std::vector<std::pair<std::string, std::string>>{
           {avr,
            "s.toml:22:10: robots[1].client: the AVR image drives a Pioneer, expected drive ="},
           {"[radio]\nbaud = 19200\n" + avr + pioneer, "expected radio.baud = 9600"},
           {"[radio]\nloss = 0.1\n" + avr + pioneer, "expected radio.bit_error instead"},
           {"[radio]\nturnaround_s = 0.0005\n" + avr + pioneer, "radio.turnaround_s >= 0.001"},
           {avr + pioneer + "image = \"nowhere.elf\"\n", "s.toml:24:9: robots[1].image: "},
           {avr + pioneer + "image = \"image.hex\"\n", "s.toml:24:9: robots[1].image: "}}) {
    EXPECT_NE(std::string::npos, ErrorOf(text).find(expected)) << ErrorOf(text);
  }
}

TEST(Scenario, ALargeMapIsSpokenOfInWideMessages) {
  const std::string text(kArena);
  const std::string robots = "[[robots]]\npheromone = 2\nstarts = [[1, 2, 0]]\n";
  const Result<Scenario> small = Parse(robots);
  ASSERT_TRUE(small.ok());
  EXPECT_FALSE(small.value().groups[0].client.wide);
  const Result<Scenario> large =
      ParseScenario("[map]\nwidth_m = 40.0\nheight_m = 10.0\ncell_m = 0.1\nwide = true\n" +
                        text.substr(text.find("[antennas]")) + robots,
                    "s.toml");
  ASSERT_TRUE(large.ok()) << large.error();
  EXPECT_TRUE(large.value().groups[0].client.wide);
}

TEST(Scenario, AFileThatIsNotThereIsAnError) {
  EXPECT_FALSE(LoadScenario("/nonexistent/scenario.toml").ok());
}

TEST(Scenario, TheExamplesAreGood) {
  const std::filesystem::path folder =
      std::filesystem::path(PHEROMONE_SOURCE_DIR) / "client_fw/swarm/examples";
  int examples = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const Result<Scenario> scenario = LoadScenario(entry.path().string());
    if (entry.path().filename() == "avr.toml" && !HasAvrRobots()) {
      EXPECT_FALSE(scenario.ok());
      continue;
    }
    EXPECT_TRUE(scenario.ok()) << scenario.error();
    ++examples;
  }
  EXPECT_GE(examples, 6);
}

}  // namespace
}  // namespace pheromone::swarm
