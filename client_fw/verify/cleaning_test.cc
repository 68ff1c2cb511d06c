// The paper's two queries and what follows for all time, in the real decision and on real tags; and
// each safeguard taken away in turn. The expected figures were measured beforehand with another
// program, written without this one.

#include <gtest/gtest.h>

#include <string>

#include "client_fw/verify/cleaning_check.h"
#include "client_fw/verify/testing/proofs.h"

namespace pheromone::verify {
namespace {

constexpr SoilPercents kFromDirty{.start = 80, .below = 30};

// What is wrong in a refuted proof; empty: it was not refuted.
std::string Wrong(const CleaningLimits& limits) {
  const CleaningResult result = Print(ProveCleaning(limits));
  return result.verdict == Verdict::kRefuted ? result.wrong : "";
}

constexpr char kForgotten[] = "a zone need not be cleaned again";
constexpr char kTwoInOneZone[] = "two robots";  // how it begins

const CleaningStarts kSixAndSeven = {{5, 6}};

TEST(Proof, ForAllTimeAndFromAnyStart) {
  const CleaningResult proof = Print(ProveCleaning(Taking(5)));
  ASSERT_EQ(proof.verdict, Verdict::kProved) << proof.wrong;
  EXPECT_EQ(LongestGap(proof), 78);
  EXPECT_EQ(proof.gaps[10], 68);  // of zone 11, the longest of those that soil fast
  const std::vector<int> rates = PaperRates();
  for (size_t zone = 0; zone < 12; ++zone) {
    EXPECT_LT(HighestPercent(rates[zone], proof.gaps[zone]), 51) << zone + 1;
  }
}

TEST(Proof, OneRobotAloneNeedsNoLease) {
  const CleaningResult proof = ProveCleaning({.robots = 1, .lease = 0});
  EXPECT_EQ(proof.verdict, Verdict::kProved);
  EXPECT_EQ(LongestGap(proof), 115);
}

TEST(Query, AllZonesBecomeClean) {
  const CleaningResult four = Print(CheckCleanAfter(Taking(4), {}, kFromDirty));
  EXPECT_EQ(four.verdict, Verdict::kProved);
  EXPECT_EQ(four.longest, 70);
  const CleaningResult five = CheckCleanAfter(Taking(5), {}, kFromDirty);
  EXPECT_EQ(five.verdict, Verdict::kProved);
  EXPECT_EQ(five.longest, 101);
}

TEST(Query, AllZonesStayBelowTheThreshold) {
  EXPECT_EQ(Print(CheckLevels(Taking(5), kSixAndSeven, {20, 51}, 240)).verdict, Verdict::kProved);
  EXPECT_EQ(CheckLevels(Taking(6), kSixAndSeven, {20, 51}, 240).verdict, Verdict::kProved);
  EXPECT_EQ(CheckLevels(Taking(8), kSixAndSeven, {20, 51}, 240).verdict, Verdict::kProved);
}

TEST(Query, ALongerHorizonRefutesWhatAShortOneProves) {
  EXPECT_EQ(CheckLevels(Taking(8), kSixAndSeven, {20, 51}, 300).verdict, Verdict::kProved);
  const CleaningResult later = CheckLevels(Taking(8), kSixAndSeven, {20, 51}, 360);
  EXPECT_EQ(later.verdict, Verdict::kRefuted);
  EXPECT_GE(later.trace.back().time, 300);
  EXPECT_LT(later.trace.back().time, 360);
}

TEST(Query, FromALittleMoreSoil) {
  EXPECT_EQ(CheckLevels(Taking(5), kSixAndSeven, {25, 51}, 240).verdict, Verdict::kProved);
  for (const int time : {6, 7, 8}) {
    EXPECT_EQ(CheckLevels(Taking(time), kSixAndSeven, {25, 51}, 240).verdict, Verdict::kRefuted)
        << time;
  }
}

// A robot that breaks down while it cleans leaves its sign, until the lease ends.
TEST(Crash, TheOtherRobotTakesOver) {
  const CleaningResult proof =
      Print(ProveCleaning({.columns = 3, .rows = 2, .robots = 2, .crashes = 1}));
  ASSERT_EQ(proof.verdict, Verdict::kProved) << proof.wrong;
  const CleaningResult sound = ProveCleaning({.columns = 3, .rows = 2, .robots = 2});
  EXPECT_GT(LongestGap(proof), LongestGap(sound));
}

TEST(Jitter, CleaningMayTakeDifferentTimes) {
  const CleaningResult proof =
      Print(ProveCleaning({.columns = 3, .rows = 2, .clean_min = 5, .clean_max = 6}));
  EXPECT_EQ(proof.verdict, Verdict::kProved) << proof.wrong;
}

TEST(PassersBy, CannotDropASignThatIsLeased) {
  CleaningLimits limits{.columns = 2, .rows = 2, .passers_by = true};
  limits.clean_min = limits.clean_max = 2;
  EXPECT_EQ(Print(ProveCleaning(limits)).verdict, Verdict::kProved);
}

// An operator's sign in the middle of 3 x 3 zones, and in a corner.
TEST(Signs, KeepAllRobotsAwayFromAClosedZoneForAllTime) {
  for (const uint64_t closed : {uint64_t{1u << 4}, uint64_t{1}}) {
    const CleaningResult proof =
        Print(ProveCleaning({.columns = 3, .rows = 3, .robots = 2, .closed = closed}));
    ASSERT_EQ(proof.verdict, Verdict::kProved) << proof.wrong;
    for (size_t zone = 0; zone < 9; ++zone) {
      EXPECT_EQ(proof.gaps[zone] == 0, (closed >> zone & 1) != 0) << zone + 1;
    }
  }
}

TEST(Signs, ThatCutTheFloorInTwoLetOnePartBeForgotten) {
  EXPECT_EQ(Wrong({.columns = 3, .rows = 2, .robots = 2, .closed = 0b001100}), kForgotten);
}

// At any moment an operator asks for any zone, twice.
TEST(Signs, ToCleanAgainForgetNoZone) {
  const CleaningResult proof =
      Print(ProveCleaning({.columns = 3, .rows = 2, .robots = 2, .asks = 2}));
  ASSERT_EQ(proof.verdict, Verdict::kProved) << proof.wrong;
  const CleaningResult without = ProveCleaning({.columns = 3, .rows = 2, .robots = 2});
  EXPECT_GT(LongestGap(proof), LongestGap(without)) << "who is asked for goes first";
}

TEST(Fault, ASignThatIsNotOutdatedByACleaningKeepsARobotForEver) {
  EXPECT_EQ(Wrong({.columns = 3, .rows = 2, .robots = 1, .asks = 1, .asks_for_ever = true}),
            kForgotten);
}

TEST(Fault, RobotsThatMoveBetweenEqualsCanWanderForEver) {
  const CleaningResult result =
      Print(ProveCleaning({.columns = 3, .rows = 2, .moves_between_equals = true}));
  EXPECT_EQ(result.verdict, Verdict::kRefuted);
  EXPECT_EQ(result.wrong, kForgotten);
  EXPECT_GT(result.repeats_from, 0u);
}

TEST(Fault, ASignWithoutALeaseStaysForEver) {
  EXPECT_EQ(Wrong({.columns = 2, .rows = 2, .lease = 0, .crashes = 1}), kForgotten);
}

TEST(Fault, ClaimsWithoutAConditionMeet) {
  EXPECT_TRUE(
      Wrong({.columns = 3, .rows = 2, .claims_unconditionally = true}).starts_with(kTwoInOneZone));
}

TEST(Fault, ASignThatMayBeDroppedLetsASecondRobotIn) {
  EXPECT_TRUE(
      Wrong({.columns = 3, .rows = 2, .lease = 0, .passers_by = true}).starts_with(kTwoInOneZone));
}

TEST(Fault, ALeaseShorterThanCleaningLetsASecondRobotIn) {
  EXPECT_TRUE(Wrong({.columns = 3, .rows = 2, .clean_min = 2, .clean_max = 7, .lease = 4})
                  .starts_with(kTwoInOneZone));
}

// What is cleaned is never stamped, so that robots stay where they are.
TEST(Fault, ALeaseThatIsAlwaysShorterCleansTheSameZonesForEver) {
  EXPECT_EQ(Wrong({.columns = 3, .rows = 2, .lease = 4}), kForgotten);
}

}  // namespace
}  // namespace pheromone::verify
