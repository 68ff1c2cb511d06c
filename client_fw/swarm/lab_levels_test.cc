#include "client_fw/swarm/lab_levels.h"

#include <gtest/gtest.h>

#include <string>

#include "client_fw/lab/scenario/run.h"
#include "client_fw/swarm/lab_radio.h"
#include "client_fw/swarm/scenario/run.h"

namespace pheromone::swarm {
namespace {

const std::string kFile = PHEROMONE_SOURCE_DIR "/client_fw/lab/examples/levels.toml";

// All cells are in client_fw/lab/results/levels.csv.
TEST(LabLevels, AgreeWithBytesOnTheAir) {
  for (const LevelCell& cell : {LevelCell{8, 1, 1}, LevelCell{16, 5, 2}}) {
    const Result<LevelFigures> air = MeasureLevel(kFile, lab::Level::kRadio, cell);
    ASSERT_TRUE(air.ok()) << air.error();
    for (const lab::Level level : {lab::Level::kField, lab::Level::kFirmware}) {
      const Result<LevelFigures> figures = MeasureLevel(kFile, level, cell);
      ASSERT_TRUE(figures.ok()) << figures.error();
      const Agreement agreement = Compare(figures.value(), air.value());
      SCOPED_TRACE(std::to_string(cell.robots) + " robots, level " +
                   std::to_string(static_cast<int>(level)));
      EXPECT_TRUE(agreement.answers)
          << figures.value().answers_per_s << " beside " << air.value().answers_per_s;
      EXPECT_TRUE(agreement.path_error)
          << figures.value().path_error_mm << " beside " << air.value().path_error_mm;
      EXPECT_TRUE(agreement.stops) << figures.value().stops << " beside " << air.value().stops;
    }
  }
}

TEST(LabLevels, DifferencesAreSeen) {
  const LevelFigures air{.answers_per_s = 37, .path_error_mm = 20, .stops = 100};
  EXPECT_TRUE(Compare(air, air).holds());
  EXPECT_TRUE(Compare({38, 21.9, 129}, air).holds());
  EXPECT_FALSE(Compare({38.2, 20, 100}, air).answers);
  EXPECT_FALSE(Compare({37, 17.9, 100}, air).path_error);
  EXPECT_FALSE(Compare({37, 20, 131}, air).stops);
  EXPECT_FALSE(Compare({37, 20, 70}, air).stops);
  EXPECT_TRUE(Compare({37, 20, 3}, {37, 20, 0}).stops);
  EXPECT_FALSE(Compare({37, 20, 5}, {37, 20, 0}).stops);
}

// What is measured on the air is what the robots' own counters say.
TEST(LabLevels, OnTheAirAnswersAndStopsAreThoseOfTheRobots) {
  lab::LabScenario scenario =
      lab::LoadLabScenario(kFile, {{"run.level", "radio"}, {"run.duration_s", "40"}}).value();
  scenario.world.measure_from_ms = 0;
  const SwarmRecord record = RunScenario(OnAir(scenario), {});
  uint64_t answers = 0;
  uint64_t stops = 0;
  for (const RobotRecord& robot : record.robots) {
    answers += robot.counters.answers;
    stops += robot.counters.fail_safe_stops;
  }
  const lab::Heard heard = MeasuredOnAir(scenario, record).tally.heard;
  EXPECT_EQ(heard.answers, answers);
  EXPECT_GT(stops, 100u);
  // A gap that is a millisecond or two longer than the fail-safe time need not be a stop.
  const auto counted = static_cast<double>(stops);
  EXPECT_NEAR(static_cast<double>(heard.fail_safe_stops), counted, counted / 50);
}

}  // namespace
}  // namespace pheromone::swarm
