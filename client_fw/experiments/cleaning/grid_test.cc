#include "client_fw/experiments/cleaning/grid.h"

#include <gtest/gtest.h>

#include <vector>

namespace pheromone::swarm {
namespace {

std::vector<double> Levels(const std::vector<SoilStep>& soil) {
  std::vector<double> levels;
  for (const SoilStep& step : soil) {
    levels.push_back(step.percent);
  }
  return levels;
}

TEST(CleaningGridTest, ThePapersZonesSoilAsInThePaper) {
  const CleaningGrid grid;
  for (int zone = 1; zone <= 12; ++zone) {
    const bool is_intensive = (zone >= 5 && zone <= 8) || zone == 11;
    EXPECT_EQ(grid.RatePercent(zone - 1), is_intensive ? 10 : 5) << zone;
  }
}

TEST(CleaningGridTest, LargerGridsRepeatThePattern) {
  const CleaningGrid grid{.columns = 8, .rows = 6};
  int sum = 0;
  for (int zone = 0; zone < grid.zones(); ++zone) {
    sum += grid.RatePercent(zone);
  }
  EXPECT_EQ(sum, 4 * (5 * 10 + 7 * 5));
  EXPECT_EQ(grid.RatePercent(1 * 6 + 1), 10);  // column 2, row 2: zone 5 of the pattern
  EXPECT_EQ(grid.RatePercent(5 * 6 + 4), 10);  // the same, four columns and three rows on
}

TEST(CleaningGridTest, AZoneIsWhereItsMiddleIs) {
  const CleaningGrid grid{.columns = 5, .rows = 4, .zone_m = 2};
  for (int zone = 0; zone < grid.zones(); ++zone) {
    EXPECT_EQ(grid.ZoneAt(grid.CentreX(zone), grid.CentreY(zone)), zone);
  }
  EXPECT_EQ(grid.CentreX(4), 3);  // the first of the second column
  EXPECT_EQ(grid.CentreY(4), 1);
  EXPECT_EQ(grid.ZoneAt(-0.1, 8.1), 3);
}

TEST(CleaningGridTest, SoilRisesInStepsAndCleaningSetsItToZero) {
  const SoilRule rule{.start_percent = 20, .unit_ms = 100};  // a step every 1.5 s
  const std::vector<Cleaning> cleanings = {
      {.zone = 3, .robot = 0, .begin_ms = 100, .end_ms = 200, .is_done = true},
      {.zone = 4, .robot = 0, .begin_ms = 2'000, .end_ms = 5'000, .is_done = true},
      {.zone = 4, .robot = 1, .begin_ms = 6'000, .end_ms = 7'000, .is_done = false}};
  const std::vector<SoilStep> soil = SoilOf({}, rule, 4, cleanings, 8'000);
  // 1.5 s; not 3 and 4.5 s; clean at 5 s; at 6 s a step, then a claim; at 7.5 s.
  EXPECT_EQ(Levels(soil), (std::vector<double>{20, 30, 0, 10, 20}));
  EXPECT_EQ(soil[2].time_ms, 5'000);
  EXPECT_EQ(soil[3].time_ms, 6'000);
  EXPECT_EQ(HighestPercent(soil), 30);
  EXPECT_EQ(HighestPercent(SoilOf({}, rule, 4, {}, 100'000)), 100);
}

TEST(CleaningGridTest, AGapIsFromAnEndToTheNextBegin) {
  const std::vector<Cleaning> cleanings = {
      {.zone = 0, .robot = 0, .begin_ms = 500, .end_ms = 600, .is_done = true},
      {.zone = 1, .robot = 1, .begin_ms = 700, .end_ms = 800, .is_done = true},
      {.zone = 0, .robot = 1, .begin_ms = 900, .end_ms = 950, .is_done = false},  // broken off
      {.zone = 0, .robot = 0, .begin_ms = 1'400, .end_ms = 1'500, .is_done = true}};
  EXPECT_EQ(WorstGapMs(0, cleanings, 2'000), 800);
  EXPECT_EQ(WorstGapMs(0, cleanings, 3'000), 1'500);  // until the end of the run
  EXPECT_EQ(WorstGapMs(1, cleanings, 1'000), 700);    // from the start
  EXPECT_EQ(WorstGapMs(2, cleanings, 1'000), 1'000);
}

TEST(CleaningGridTest, TwoInOneZoneAreNoticed) {
  const std::vector<Cleaning> apart = {
      {.zone = 0, .robot = 0, .begin_ms = 0, .end_ms = 100, .is_done = true},
      {.zone = 1, .robot = 1, .begin_ms = 50, .end_ms = 150, .is_done = true},
      {.zone = 0, .robot = 1, .begin_ms = 100, .end_ms = 200, .is_done = true}};
  EXPECT_EQ(TogetherMs(apart), 0);
  std::vector<Cleaning> together = apart;
  together.push_back({.zone = 0, .robot = 2, .begin_ms = 170, .end_ms = 300, .is_done = false});
  EXPECT_EQ(TogetherMs(together), 30);
}

}  // namespace
}  // namespace pheromone::swarm
