// What tests of the checkers share: they print what a search found, and expect a verdict of it.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <string>

#include "client_fw/verify/cleaning_check.h"
#include "client_fw/verify/explore.h"

namespace pheromone::verify {

inline const Explored& Print(const Explored& found) {
  std::cout << found.states << " states, " << found.transitions << " transitions\n";
  for (const std::string& step : found.trace) {
    std::cout << "  " << step << '\n';
  }
  return found;
}

inline void ExpectProof(const Explored& found) {
  Print(found);
  EXPECT_EQ(found.wrong, "");
  EXPECT_EQ(found.verdict, Verdict::kProved);
}

inline void ExpectRefutation(const Explored& found, const std::string& wrong) {
  Print(found);
  EXPECT_EQ(found.wrong, wrong);
  EXPECT_EQ(found.verdict, Verdict::kRefuted);
}

inline const CleaningResult& Print(const CleaningResult& result) {
  std::cout << result.states << " states (" << result.unfolded_states << " unfolded), "
            << result.steps << " steps, gaps";
  for (const int gap : result.gaps) {
    std::cout << ' ' << gap;
  }
  std::cout << '\n';
  if (result.verdict == Verdict::kRefuted) {
    std::cout << TraceText(result);
  }
  return result;
}

/// Robots that need exactly this long for a zone of the paper's floor.
inline CleaningLimits Taking(int time) {
  return {.clean_min = time, .clean_max = time, .rates_percent = PaperRates()};
}

inline int LongestGap(const CleaningResult& result) {
  return *std::max_element(result.gaps.begin(), result.gaps.end());
}

}  // namespace pheromone::verify
