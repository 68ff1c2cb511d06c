#include "server/base/number_check.h"

#include <gtest/gtest.h>

#include <string>

namespace pheromone {
namespace {

std::string Checked(const CLI::Validator& check, std::string text) {
  return check(text);
}

TEST(NumberCheckTest, WhatIsWithinIsTakenBoundsIncluded) {
  for (const char* good : {"0", "-0", "1000", "0.05", "1e3", "1000.0"}) {
    EXPECT_EQ(Checked(Number(0, 1000), good), "") << good;
  }
  for (const char* good : {"1", "254", "7"}) {
    EXPECT_EQ(Checked(WholeNumber(1, 254), good), "") << good;
  }
}

TEST(NumberCheckTest, WhatIsNoNumberOrOutsideIsToldWithWhatWasExpected) {
  for (const std::string bad : {"nan", "-nan", "NAN", "nan(1)", "inf", "-inf", "infinity", "1e400",
                                "-1", "1000.1", "abc", "1m", ""}) {
    EXPECT_EQ(Checked(Number(0, 1000), bad),
              "found \"" + bad + "\", expected a number from 0 to 1000");
  }
  for (const std::string bad : {"nan", "inf", "0", "255", "1.5", "99999999999999999999", "x", ""}) {
    EXPECT_EQ(Checked(WholeNumber(1, 254), bad),
              "found \"" + bad + "\", expected a whole number from 1 to 254");
  }
}

}  // namespace
}  // namespace pheromone
