#include "server/verify/cleaning_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <string>

#include "server/base/testing/count.h"

namespace pheromone::verify {
namespace {

TEST(TracePicture, ShowsEachRobotAndWhatGoesOnForEver) {
  const CleaningLimits limits{.columns = 2, .rows = 2, .lease = 0, .crashes = 1};
  const CleaningResult result = ProveCleaning(limits);
  ASSERT_EQ(result.verdict, Verdict::kRefuted);
  const std::string svg = TracePicture(limits, result);
  EXPECT_EQ(CountOf(svg, ">zone "), 4u);
  EXPECT_EQ(CountOf(svg, ">robot "), 2u);
  EXPECT_EQ(CountOf(svg, ">for ever<"), 1u);
  EXPECT_EQ(CountOf(svg, "×"), 1u);  // where one robot breaks down
  const auto finished = std::count_if(
      result.trace.begin() + 1, result.trace.end(),
      [](const CleaningMoment& it) { return it.step.action == CleaningAction::kFinishes; });
  EXPECT_EQ(CountOf(svg, "height=\"8\""), static_cast<size_t>(finished));
}

TEST(TracePicture, ShowsHowTwoRobotsMeet) {
  const CleaningLimits limits{.columns = 2, .rows = 2, .claims_unconditionally = true};
  const std::string svg = TracePicture(limits, ProveCleaning(limits));
  EXPECT_EQ(CountOf(svg, ">two robots clean zone "), 1u);
  EXPECT_EQ(CountOf(svg, "height=\"8\""), 2u);  // both are cleaning at the end
}

}  // namespace
}  // namespace pheromone::verify
