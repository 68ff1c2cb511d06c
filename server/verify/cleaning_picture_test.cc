#include "server/verify/cleaning_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <string>

namespace pheromone::verify {
namespace {

size_t Count(const std::string& text, const std::string& part) {
  size_t count = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++count;
  }
  return count;
}

TEST(TracePicture, ShowsEachRobotAndWhatGoesOnForEver) {
  const CleaningLimits limits{.columns = 2, .rows = 2, .lease = 0, .crashes = 1};
  const CleaningResult result = ProveCleaning(limits);
  ASSERT_EQ(result.verdict, Verdict::kRefuted);
  const std::string svg = TracePicture(limits, result);
  EXPECT_EQ(Count(svg, ">zone "), 4u);
  EXPECT_EQ(Count(svg, ">robot "), 2u);
  EXPECT_EQ(Count(svg, ">for ever<"), 1u);
  EXPECT_EQ(Count(svg, "×"), 1u);  // where one robot breaks down
  const auto finished = std::count_if(
      result.trace.begin() + 1, result.trace.end(),
      [](const CleaningMoment& it) { return it.step.action == CleaningAction::kFinishes; });
  EXPECT_EQ(Count(svg, "height=\"8\""), static_cast<size_t>(finished));
}

TEST(TracePicture, ShowsHowTwoRobotsMeet) {
  const CleaningLimits limits{.columns = 2, .rows = 2, .claims_unconditionally = true};
  const std::string svg = TracePicture(limits, ProveCleaning(limits));
  EXPECT_EQ(Count(svg, ">two robots clean zone "), 1u);
  EXPECT_EQ(Count(svg, "height=\"8\""), 2u);  // both are cleaning at the end
}

}  // namespace
}  // namespace pheromone::verify
