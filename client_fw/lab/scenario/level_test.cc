#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "client_fw/lab/scenario/run.h"
#include "client_fw/lab/scenario/scenario.h"
#include "server/base/file.h"
#include "server/config/document.h"

namespace pheromone::lab {
namespace {

constexpr const char* kFile = "/client_fw/lab/examples/levels.toml";

Result<LabScenario> Levels(const KeyValues& settings) {
  return LoadLabScenario(PHEROMONE_SOURCE_DIR + std::string(kFile), settings);
}

// Without the place.
std::string LevelError(const KeyValues& settings) {
  const std::string error = Levels(settings).ErrorOr("none");
  const size_t key = error.find(": ");
  return key == std::string::npos ? error : error.substr(key + 2);
}

TEST(Level, TheExampleRunsAtEachOfThem) {
  const LabScenario field = Levels({}).value();
  EXPECT_EQ(field.level, Level::kField);
  EXPECT_EQ(field.world.step_ms, 20);
  EXPECT_EQ(field.world.measure_from_ms, 10'000);
  EXPECT_EQ(field.world.radio, (RadioModel{.robots_per_channel = 20, .lost_percent = 1}));
  EXPECT_EQ(Levels({{"run.level", "firmware"}}).value().level, Level::kFirmware);
  EXPECT_EQ(Levels({{"run.level", "radio"}}).value().level, Level::kRadio);
  const Result<std::unique_ptr<World>> none =
      MakeWorld(Levels({{"run.level", "radio"}}).value(), 1);
  EXPECT_EQ(
      none.ErrorOr("none"),
      "levels: found run.level = \"radio\", which pheromone-swarm lab run simulates, expected "
      "\"field\" or \"firmware\"");
}

TEST(Level, TheRadioIsOneThatWasMeasured) {
  EXPECT_EQ(LevelError({{"radio.lost", "0.02"}}),
            "radio.lost: found 0.02, expected what was measured: 0, 0.01 or 0.05");
  EXPECT_EQ(LevelError({{"radio.robots_per_channel", "41"}}),
            "radio.robots_per_channel: found 41, expected a whole number from 1 to 40");
  EXPECT_EQ(LevelError({{"run.step_s", "0.2"}}),
            "run.step_s: found 0.2, expected a number from 0.001 to 0.1");
  const std::string ideal = LevelError({{"radio.model", "ideal"}});
  EXPECT_NE(ideal.find("radio.robots_per_channel: not permitted with model = \"ideal\", expected "
                       "model = \"rounds\""),
            std::string::npos)
      << ideal;
  EXPECT_NE(ideal.find("radio.lost: not permitted"), std::string::npos) << ideal;
  EXPECT_EQ(LevelError({{"measure.from_s", "70"}}),
            "measure.from_s: found 70, expected a number from 0 to 69.999");
}

TEST(Level, AMistakeIsToldOnce) {
  EXPECT_EQ(
      LevelError({{"run.level", "air"}}),
      "run.level: found the string \"air\", expected one of \"field\", \"firmware\", \"radio\"");
  EXPECT_EQ(LevelError({{"radio.model", "round"}}),
            "radio.model: found the string \"round\", expected one of \"ideal\", \"rounds\"");
  EXPECT_EQ(LevelError({{"run.level", "radio"}, {"radio.model", "round"}}),
            "radio.model: found the string \"round\", expected one of \"ideal\", \"rounds\"");
  EXPECT_EQ(LevelError({{"run", "5"}}), "run: found 5, expected a table [run]");
  EXPECT_EQ(LevelError({{"run.level", "radio"}, {"robots.behaviour", "folow"}}).find('\n'),
            std::string::npos);
  // What the level does not have is not read, either.
  EXPECT_EQ(
      LevelError({{"run.level", "radio"}, {"run.step_s", "7"}}),
      "run.step_s: not permitted with level = \"radio\", expected its own step, a millisecond");
  EXPECT_EQ(
      LevelError({{"run.level", "radio"}, {"measure.place_m", "-1"}}),
      "measure.place_m: not permitted with level = \"radio\", expected no measure of coverage");
}

TEST(Level, WhatItDoesNotKnowIsRefusedByName) {
  for (const char* level : {"firmware", "radio"}) {
    const auto error = [&](KeyValues settings) {
      settings.emplace_back("run.level", level);
      return LevelError(settings);
    };
    const std::string name = std::string("level = \"") + level + '"';
    EXPECT_EQ(error({{"robots.behaviour", "explore"}}),
              "robots[1].behaviour: not known to " + name + ", expected \"follow\"");
    EXPECT_EQ(error({{"robots.senses", "[\"path\", \"path\"]"}}),
              "robots[1].senses: not known to " + name + ", expected one pheromone");
    EXPECT_EQ(error({{"robots.parameters", "{quanta = 2}"}}),
              "robots[1].parameters.quanta: found 2, expected 0 or 1: at " + name +
                  ", robots send TRACE");
    const std::string text = ReadFile(PHEROMONE_SOURCE_DIR + std::string(kFile)).value() +
                             "[[wall]]\nname = \"gate\"\npoints_m = [[1, 1], [2, 1]]\n";
    config::Value tree = config::ParseDocument(text, "levels.toml").value();
    ASSERT_TRUE(SetValue("run.level", level, &tree).ok());
    const std::string wall = ReadLabScenario(tree, "levels.toml").ErrorOr("none");
    EXPECT_NE(wall.find("wall: not known to " + name + ", expected none"), std::string::npos)
        << wall;
  }
  const auto on_air = [](const std::string& key, const std::string& value) {
    return LevelError({{"run.level", "radio"}, {key, value}});
  };
  EXPECT_EQ(
      on_air("run.step_s", "0.01"),
      "run.step_s: not permitted with level = \"radio\", expected its own step, a millisecond");
  EXPECT_EQ(
      on_air("measure.place_m", "2"),
      "measure.place_m: not permitted with level = \"radio\", expected no measure of coverage");
  EXPECT_EQ(
      on_air("robots.radius_m", "0.1"),
      "robots[1].radius_m: found 0.1, expected 0: at level = \"radio\", robots do not collide");
  EXPECT_EQ(on_air("robots.slip", "0.1"),
            "robots[1].slip: not permitted with level = \"radio\", expected the drive that the "
            "simulator has");
  EXPECT_EQ(on_air("radio.model", "ideal"),
            "radio.model: not known to level = \"radio\", expected \"rounds\"");
  EXPECT_EQ(on_air("radio.robots_per_channel", "1"),
            "robots: found 20 robots on 20 channels, expected at most 254 on 16 at level = "
            "\"radio\"");
}

}  // namespace
}  // namespace pheromone::lab
