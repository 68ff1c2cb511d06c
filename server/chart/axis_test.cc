#include "server/chart/axis.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace pheromone::chart {
namespace {

void ExpectTicks(const Axis& axis, const std::vector<double>& expected) {
  ASSERT_EQ(axis.ticks.size(), expected.size());
  for (size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(axis.ticks[i], expected[i], 1e-12 * std::abs(expected[i])) << i;
  }
  EXPECT_DOUBLE_EQ(axis.from, axis.ticks.front());
  EXPECT_DOUBLE_EQ(axis.to, axis.ticks.back());
}

TEST(Axis, LinearTicksAreRound) {
  ExpectTicks(AxisOver(Scale::kLinear, 0, 100), {0, 20, 40, 60, 80, 100});
  ExpectTicks(AxisOver(Scale::kLinear, 0.05, 0.3), {0.05, 0.1, 0.15, 0.2, 0.25, 0.3});
  ExpectTicks(AxisOver(Scale::kLinear, -170, 260), {-200, -100, 0, 100, 200, 300});
}

TEST(Axis, LogarithmicTicksAreRound) {
  ExpectTicks(AxisOver(Scale::kLogarithmic, 3, 400), {2, 5, 10, 20, 50, 100, 200, 500});
  ExpectTicks(AxisOver(Scale::kLogarithmic, 0.1, 0.9), {0.1, 0.2, 0.5, 1});
  ExpectTicks(AxisOver(Scale::kLogarithmic, 1, 1000), {1, 10, 100, 1000});
  ExpectTicks(AxisOver(Scale::kLogarithmic, 155, 90e6), {1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8});
}

TEST(Axis, ManyDecadesHaveFewTicks) {
  for (int decades = 3; decades < 300; ++decades) {
    const Axis axis = AxisOver(Scale::kLogarithmic, 1, std::pow(10, decades));
    EXPECT_LE(axis.ticks.size(), 11u) << decades;
    EXPECT_GE(axis.to, std::pow(10, decades) * (1 - 1e-9)) << decades;
  }
}

// Every axis covers what it was asked for, from power to power of ten.
TEST(Axis, CoversItsValues) {
  for (const Scale scale : {Scale::kLinear, Scale::kLogarithmic}) {
    for (double least = 1e-9; least < 1e9; least *= 3.7) {
      for (double most = least; most < 1e9; most *= 2.3) {
        const Axis axis = AxisOver(scale, least, most);
        EXPECT_LE(axis.from, least * (1 + 1e-9));
        EXPECT_GE(axis.to, most * (1 - 1e-9));
        EXPECT_LT(axis.from, axis.to);
        EXPECT_GE(axis.ticks.size(), 2u);
        EXPECT_LE(axis.ticks.size(), 11u);
      }
    }
  }
}

TEST(Axis, OneValueHasAnAxisToo) {
  ExpectTicks(AxisOver(Scale::kLogarithmic, 100, 100), {50, 100, 200});
  for (const double value : {-3.0, 0.0, 5.0, 1e15}) {
    const Axis axis = AxisOver(Scale::kLinear, value, value);
    EXPECT_LE(axis.from, value);
    EXPECT_GE(axis.to, value);
    EXPECT_LT(axis.from, axis.to);
  }
}

// Neighbouring numbers of type double: no step lies between them.
TEST(Axis, EndsWhereStepsAreTooSmallForTheNumbers) {
  const Axis axis = AxisOver(Scale::kLinear, 1e17, 1e17 + 16);
  EXPECT_LE(axis.ticks.size(), 11u);
  EXPECT_LT(axis.from, axis.to);
}

TEST(Axis, SharesAreThoseOfTheScale) {
  const Axis linear = AxisOver(Scale::kLinear, -100, 300);
  const Axis logarithmic = AxisOver(Scale::kLogarithmic, 0.02, 5000);  // from 0.01 to 10000
  for (const double value : {-100.0, -7.0, 0.0, 123.0, 300.0}) {
    EXPECT_NEAR(linear.ShareOf(value), (value + 100) / 400, 1e-12) << value;
  }
  for (const double value : {0.02, 0.3, 1.0, 77.0, 5000.0}) {
    EXPECT_NEAR(logarithmic.ShareOf(value), (std::log10(value) + 2) / 6, 1e-12) << value;
  }
  EXPECT_EQ(linear.ShareOf(-1e9), 0);
  EXPECT_EQ(linear.ShareOf(1e9), 1);
  EXPECT_EQ(logarithmic.ShareOf(-5), 0);
}

TEST(Axis, ALogarithmicOneHasNoPlaceForZero) {
  EXPECT_TRUE(HasPlace(Scale::kLinear, 0));
  EXPECT_TRUE(HasPlace(Scale::kLinear, -1));
  EXPECT_TRUE(HasPlace(Scale::kLogarithmic, 1e-9));
  EXPECT_FALSE(HasPlace(Scale::kLogarithmic, 0));
  EXPECT_FALSE(HasPlace(Scale::kLogarithmic, -1));
  for (const Scale scale : {Scale::kLinear, Scale::kLogarithmic}) {
    EXPECT_FALSE(HasPlace(scale, std::numeric_limits<double>::quiet_NaN()));
    EXPECT_FALSE(HasPlace(scale, std::numeric_limits<double>::infinity()));
  }
}

TEST(Axis, CategoriesLieInTheMiddleOfTheirPlaces) {
  const Axis axis = CategoryAxis(4);
  ASSERT_EQ(axis.ticks.size(), 4u);
  for (int i = 0; i < 4; ++i) {
    EXPECT_DOUBLE_EQ(axis.ShareOf(axis.ticks[static_cast<size_t>(i)]), (i + 0.5) / 4) << i;
  }
}

}  // namespace
}  // namespace pheromone::chart
