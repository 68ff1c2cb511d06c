// The other rows of the tables in cleaning_test.cc, and robots that break down or need different
// times on larger grids.

#include <gtest/gtest.h>

#include "client_fw/verify/cleaning_check.h"
#include "client_fw/verify/testing/proofs.h"

namespace pheromone::verify {
namespace {

TEST(Table, LongestGaps) {
  struct Row {
    int time;
    int longest;
    int of_zone_11;
  };
  for (const Row& row :
       {Row{4, 66, 60}, Row{5, 78, 68}, Row{6, 86, 80}, Row{7, 96, 88}, Row{8, 102, 100}}) {
    const CleaningResult proof = Print(ProveCleaning(Taking(row.time)));
    ASSERT_EQ(proof.verdict, Verdict::kProved);
    EXPECT_EQ(LongestGap(proof), row.longest) << row.time;
    EXPECT_EQ(proof.gaps[10], row.of_zone_11) << row.time;
  }
}

TEST(Table, AllZonesBecomeClean) {
  EXPECT_EQ(CheckCleanAfter(Taking(6), {}, {80, 30}).longest, 174);
  EXPECT_EQ(CheckCleanAfter(Taking(7), {{5, 6}}, {80, 30}).verdict, Verdict::kProved);
  for (const int time : {7, 8}) {
    const CleaningResult result = CheckCleanAfter(Taking(time), {}, {80, 30});
    EXPECT_EQ(result.verdict, Verdict::kRefuted) << time;
    EXPECT_GT(result.repeats_from, 0u) << time;
  }
}

TEST(Table, ALongerHorizon) {
  EXPECT_EQ(CheckLevels(Taking(7), {{5, 6}}, {20, 51}, 240).verdict, Verdict::kProved);
  EXPECT_EQ(CheckLevels(Taking(7), {{5, 6}}, {20, 51}, 480).verdict, Verdict::kProved);
  EXPECT_EQ(CheckLevels(Taking(7), {{5, 6}}, {20, 51}, 960).verdict, Verdict::kRefuted);
}

// With levels and clock, four units a zone are many more states than five.
TEST(Table, FourUnitsAZone) {
  EXPECT_EQ(CheckLevels(Taking(4), {{5, 6}}, {25, 51}, 240).verdict, Verdict::kProved);
}

TEST(Jitter, OnThreeByThree) {
  const CleaningResult proof =
      Print(ProveCleaning({.columns = 3, .rows = 3, .clean_min = 5, .clean_max = 6}));
  EXPECT_EQ(proof.verdict, Verdict::kProved) << proof.wrong;
}

TEST(Crash, OnTheWholeGrid) {
  CleaningLimits limits = Taking(5);
  limits.crashes = 1;
  const CleaningResult proof = Print(ProveCleaning(limits));
  ASSERT_EQ(proof.verdict, Verdict::kProved) << proof.wrong;
  EXPECT_GE(LongestGap(proof), 115);  // one robot alone: far too long for zones of 10 %
}

TEST(Robots, ThreeOnThreeByThree) {
  const CleaningResult proof = Print(ProveCleaning({.columns = 3, .rows = 3, .robots = 3}));
  EXPECT_EQ(proof.verdict, Verdict::kProved) << proof.wrong;
}

}  // namespace
}  // namespace pheromone::verify
