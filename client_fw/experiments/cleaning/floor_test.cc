// What a floor's file says, and what is wrong with it.

#include "client_fw/experiments/cleaning/floor.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace pheromone::swarm {
namespace {

using Zones = std::vector<uint8_t>;

CleaningFloor Good(const std::string& text) {
  const Result<CleaningFloor> floor = ParseFloor(text, "hall.toml");
  EXPECT_TRUE(floor.ok()) << floor.ErrorOr("");
  return floor.ok() ? floor.value() : CleaningFloor();
}

std::string Problem(const std::string& text) {
  return ParseFloor(text, "hall.toml").ErrorOr("nothing wrong");
}

bool Contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(CleaningFloorTest, AnEmptyFileIsAGridOfFourByThree) {
  const CleaningFloor floor = Good("");
  EXPECT_EQ(floor.name, "hall");
  EXPECT_EQ(floor.grid.zones(), 12);
  EXPECT_EQ(floor.limits.rates_percent, std::vector<int>(12, 5));
  EXPECT_EQ(floor.limits.lease, 16);
  EXPECT_TRUE(floor.starts.empty());
}

TEST(CleaningFloorTest, ZonesAreCountedFromOneInTheFile) {
  const CleaningFloor floor = Good(
      "[floor]\ncolumns = 3\nrows = 2\nrates_percent = [1, 2, 3, 4, 5, 6]\nclosed = [2]\n"
      "[robots]\nstarts = [[1, 6]]\nclean_units = [4, 7]\n[soil]\nhorizon_units = 90\n");
  EXPECT_EQ(floor.limits.closed, 2u);
  EXPECT_EQ(floor.starts, verify::CleaningStarts({{0, 5}}));
  EXPECT_EQ(floor.limits.rates_percent, (std::vector<int>{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(floor.limits.clean_min, 4);
  EXPECT_EQ(floor.limits.clean_max, 7);
  EXPECT_EQ(floor.limits.lease, 22);
  EXPECT_EQ(floor.horizon, 90);
}

TEST(CleaningFloorTest, AZoneSeesTheTagsInWhoseRangeItsMiddleIs) {
  const CleaningFloor floor = Good(
      "[[zone]]\nx_m = 1.0\ny_m = 1.0\n[[zone]]\nx_m = 2.2\ny_m = 1.0\n"
      "[[zone]]\nx_m = 4.0\ny_m = 1.0\nrange_m = 2.0\nrate_percent = 9\n");
  EXPECT_TRUE(floor.has_places);
  EXPECT_EQ(floor.limits.Floor(), verify::CleaningNeighbours({{1}, {0, 2}, {}}));
  EXPECT_EQ(floor.grid.RatePercent(2), 9);
  EXPECT_EQ(floor.grid.ZoneAt(3.2, 1), 2);
  const CleaningExperiment experiment = ExperimentOf(floor, CleaningExperiment()).value();
  EXPECT_EQ(experiment.grid.zones(), 3);
  EXPECT_EQ(experiment.cleaning_ms, 15'000);
}

TEST(CleaningFloorTest, ZonesWithoutAPlaceCanOnlyBeProved) {
  const CleaningFloor floor = Good("[[zone]]\nbeside = [2]\n[[zone]]\nbeside = [1]\n");
  EXPECT_EQ(floor.limits.Floor(), verify::CleaningNeighbours({{1}, {0}}));
  EXPECT_TRUE(Contains(ExperimentOf(floor, CleaningExperiment()).ErrorOr(""), "x_m"));
}

TEST(CleaningFloorTest, AFaultCanOnlyBeProved) {
  const CleaningFloor floor = Good("[robots]\npolicy = \"claims-unconditionally\"\n");
  EXPECT_TRUE(floor.limits.claims_unconditionally);
  EXPECT_TRUE(
      Contains(ExperimentOf(floor, CleaningExperiment()).ErrorOr(""), "claims-unconditionally"));
}

TEST(CleaningFloorTest, MistakesAreToldWithTheirPlaceAndWhatWasExpected) {
  EXPECT_TRUE(Contains(Problem("[floor]\ncolumns = 9\nrows = 9\n"), "expected at most 62"));
  EXPECT_TRUE(Contains(Problem("[robots]\ncount = 7\n"), "hall.toml:2:9: robots.count: "));
  EXPECT_TRUE(Contains(Problem("[robots]\nclean_units = [6, 5]\n"), "such as [5, 6]"));
  EXPECT_TRUE(Contains(Problem("[robots]\npolicy = \"lazy\"\n"), "moves-between-equals"));
  EXPECT_TRUE(Contains(Problem("[robots]\nstarts = [[1]]\n"), "lists of 2 zones"));
  EXPECT_TRUE(Contains(Problem("[soil]\nstart_percent = 60\n"), "less than limit_percent, 51"));
  EXPECT_TRUE(Contains(Problem("[floor]\ncolumns = 1\nrows = 1\nclosed = [1]\n"), "all zones"));
  EXPECT_TRUE(Contains(Problem("[floor]\ncolums = 3\n"), "columns"));
  EXPECT_TRUE(Contains(Problem("floor = 3\n"), "a table"));
  EXPECT_TRUE(Contains(Problem("[[zone]]\nrate_percent = 3\n"), "x_m and y_m"));
  EXPECT_TRUE(Contains(Problem("[floor]\nrates_percent = 5\n[[zone]]\nx_m = 1.0\ny_m = 1.0\n"),
                       "[[zone]]"));
  std::string star = "[[zone]]\nbeside = [2, 3, 4, 5, 6, 7, 8, 9]\n";
  for (int i = 0; i < 8; ++i) {
    star += "[[zone]]\nbeside = [1]\n";
  }
  EXPECT_TRUE(Contains(Problem(star), "zone 1: found 8 zones beside it, expected at most 7"));
}

// A robot's clock for a zone has 16 bits, and it always claims with a lease.
TEST(CleaningFloorTest, WhatRobotsCannotDoIsNotSimulated) {
  const CleaningExperiment slow =
      ExperimentOf(Good("[robots]\nclean_units = 22\n[soil]\nunit_s = 3.0\n"), {}).value();
  EXPECT_TRUE(Contains(WhatIsWrong(slow), "expected at most 65 and 65535 s")) << WhatIsWrong(slow);
  const auto unleased = ExperimentOf(Good("[robots]\nlease_units = 0\n"), {});
  EXPECT_TRUE(Contains(unleased.ErrorOr(""), "lease_units = 0 can be proved only"));
  EXPECT_TRUE(Contains(Problem("[robots]\ncrashes = 1\n"), "unknown key"));
}

// A robot is never in a closed zone, nor a zone cleaned that a sign closes: as the proof has it.
TEST(CleaningFloorTest, TheSameFileIsSimulated) {
  const CleaningFloor floor = Good(
      "[floor]\ncolumns = 2\nrows = 2\nrates_percent = 8\nclosed = [4]\n"
      "[robots]\ncount = 1\nstarts = [[3]]\nclean_units = 2\n[soil]\nunit_s = 2.0\n");
  CleaningExperiment experiment = ExperimentOf(floor, CleaningExperiment()).value();
  experiment.duration_ms = 60'000;
  const CleaningRun run = RunCleaning(experiment, 1);
  ASSERT_GE(run.cleanings.size(), 4u);
  EXPECT_EQ(run.cleanings.front().zone, 2);
  for (const Cleaning& it : run.cleanings) {
    EXPECT_NE(it.zone, 3);
    // The cleaner counts whole turns of the drive's odometry, at most 100 ms: also the one in which
    // its claim was answered.
    EXPECT_TRUE(!it.is_done || it.end_ms - it.begin_ms > 4'000 - 100);
  }
  EXPECT_TRUE(run.is_safe());
}

}  // namespace
}  // namespace pheromone::swarm
