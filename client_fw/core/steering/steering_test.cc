#include "client_fw/core/steering/steering.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <tuple>
#include <vector>

namespace pheromone {
namespace client {
namespace {

// The laws again, in fractions: speeds as numerators over M, rounded only at the end.
struct Fraction {
  int64_t numerator;
  int64_t denominator;
};

int64_t FloorDivide(int64_t a, int64_t b) {
  const int64_t quotient = a / b;
  return a % b != 0 && (a < 0) != (b < 0) ? quotient - 1 : quotient;
}

int64_t RoundHalfUp(Fraction f) {
  return FloorDivide(2 * f.numerator + f.denominator, 2 * f.denominator);
}

int64_t ScaleOf(int64_t left, int64_t right) {
  return std::max({int64_t{4096}, std::abs(left), std::abs(right)});
}

// K (1 - x) with the term K x rounded.
int64_t Remaining(int64_t k, int64_t x_numerator, int64_t scale) {
  return k - RoundHalfUp({k * x_numerator, scale});
}

std::pair<int64_t, int64_t> Differential(int64_t left, int64_t right, int64_t k) {
  const int64_t scale = ScaleOf(left, right);
  const int64_t d = left - right;
  return {Remaining(k, std::max(d, int64_t{0}), scale),
          Remaining(k, std::max(-d, int64_t{0}), scale)};
}

// Eq. (6), case by case as it stands in the paper.
std::pair<int64_t, int64_t> Paper(int64_t left, int64_t right, int64_t k) {
  const int64_t scale = ScaleOf(left, right);
  const int64_t d = std::abs(left - right);
  const int64_t with = RoundHalfUp({k * d, scale});
  const int64_t without = Remaining(k, d, scale);
  const int64_t v_left = left > right ? without : with;
  const int64_t v_right = left >= right ? with : without;
  return {v_left, v_right};
}

std::vector<int16_t> Intensities() {
  std::vector<int16_t> values;
  for (int value = -32768; value <= 32767; value += 331) {
    values.push_back(static_cast<int16_t>(value));
  }
  for (const int value : {-32768, -32767, -4097, -4096, -4095, -2048, -1, 0, 1, 2, 2047, 2048, 2049,
                          4095, 4096, 4097, 8191, 32766, 32767}) {
    values.push_back(static_cast<int16_t>(value));
  }
  return values;
}

constexpr int16_t kSpeeds[] = {0, 1, 2, 3, 199, 200, 777, 2199, 2200};

TEST(SteeringTest, DifferentialEqualsTheExactFractionEverywhere) {
  for (const int16_t left : Intensities()) {
    for (const int16_t right : Intensities()) {
      for (const int16_t k : kSpeeds) {
        const WheelSpeeds speeds = SteerDifferential(left, right, k);
        const auto expected = Differential(left, right, k);
        ASSERT_EQ(expected.first, speeds.left_mm_s) << left << ' ' << right << ' ' << k;
        ASSERT_EQ(expected.second, speeds.right_mm_s) << left << ' ' << right << ' ' << k;
      }
    }
  }
}

TEST(SteeringTest, PaperEqualsTheExactFractionEverywhere) {
  for (const int16_t left : Intensities()) {
    for (const int16_t right : Intensities()) {
      for (const int16_t k : kSpeeds) {
        const WheelSpeeds speeds = SteerPaper(left, right, k);
        const auto expected = Paper(left, right, k);
        ASSERT_EQ(expected.first, speeds.left_mm_s) << left << ' ' << right << ' ' << k;
        ASSERT_EQ(expected.second, speeds.right_mm_s) << left << ' ' << right << ' ' << k;
      }
    }
  }
}

TEST(SteeringTest, DenseGridBelowTwoUnits) {
  for (int left = -100; left <= 8300; left += 7) {
    for (int right = 0; right <= 8300; right += 61) {
      const auto l = static_cast<int16_t>(left);
      const auto r = static_cast<int16_t>(right);
      const WheelSpeeds differential = SteerDifferential(l, r, 200);
      const WheelSpeeds paper = SteerPaper(l, r, 200);
      ASSERT_EQ(Differential(left, right, 200),
                (std::pair<int64_t, int64_t>{differential.left_mm_s, differential.right_mm_s}));
      ASSERT_EQ(Paper(left, right, 200),
                (std::pair<int64_t, int64_t>{paper.left_mm_s, paper.right_mm_s}));
    }
  }
}

// Worked by hand from the definitions.
TEST(SteeringTest, KnownValues) {
  // D = 1/2, K = 200.
  EXPECT_EQ((WheelSpeeds{100, 200}), SteerDifferential(2048, 0, 200));
  EXPECT_EQ((WheelSpeeds{200, 100}), SteerDifferential(0, 2048, 200));
  // M = 8192: D = 1/4.
  EXPECT_EQ((WheelSpeeds{150, 200}), SteerDifferential(8192, 6144, 200));
  // d = 1/4: the stronger side 3/4 K, the weaker 1/4 K.
  EXPECT_EQ((WheelSpeeds{150, 50}), SteerPaper(1024, 0, 200));
  EXPECT_EQ((WheelSpeeds{50, 150}), SteerPaper(0, 1024, 200));
  // K D = 1/2 exactly: the term is rounded up.
  EXPECT_EQ((WheelSpeeds{0, 1}), SteerDifferential(2048, 0, 1));
  // Opposite signs: D = 2.
  EXPECT_EQ((WheelSpeeds{-200, 200}), SteerDifferential(4096, -4096, 200));
  EXPECT_EQ((WheelSpeeds{-200, 400}), SteerPaper(4096, -4096, 200));
}

TEST(SteeringTest, DifferentialGoesStraightAtFullSpeedWhenBalanced) {
  for (const int16_t p : Intensities()) {
    for (const int16_t k : kSpeeds) {
      EXPECT_EQ((WheelSpeeds{k, k}), SteerDifferential(p, p, k));
    }
  }
}

TEST(SteeringTest, DifferentialTurnsTowardsTheStrongerSide) {
  for (const int16_t left : Intensities()) {
    for (const int16_t right : Intensities()) {
      const WheelSpeeds speeds = SteerDifferential(left, right, 2200);
      // A difference of less than half a mm/s may be rounded away.
      const bool visible =
          2 * 2200 * std::abs(left - right) >= static_cast<int>(ScaleOf(left, right));
      if (visible && left > right) {
        EXPECT_LT(speeds.left_mm_s, speeds.right_mm_s);
      } else if (visible && left < right) {
        EXPECT_GT(speeds.left_mm_s, speeds.right_mm_s);
      }
    }
  }
}

TEST(SteeringTest, PaperStopsWhenBalanced) {
  for (const int16_t p : Intensities()) {
    for (const int16_t k : kSpeeds) {
      EXPECT_EQ((WheelSpeeds{0, 0}), SteerPaper(p, p, k));
    }
  }
}

TEST(SteeringTest, PaperTurnsAwayBelowOneHalfAndTowardsAboveIt) {
  for (int difference = 10; difference <= 4096; difference += 2) {
    const auto p = static_cast<int16_t>(difference);
    const WheelSpeeds left_stronger = SteerPaper(p, 0, 2000);
    const WheelSpeeds right_stronger = SteerPaper(0, p, 2000);
    if (difference < 2048) {
      EXPECT_GT(left_stronger.left_mm_s, left_stronger.right_mm_s);    // to the right: away
      EXPECT_LT(right_stronger.left_mm_s, right_stronger.right_mm_s);  // to the left: away
    } else if (difference == 2048) {
      EXPECT_EQ(left_stronger.left_mm_s, left_stronger.right_mm_s);
    } else {
      EXPECT_LT(left_stronger.left_mm_s, left_stronger.right_mm_s);
      EXPECT_GT(right_stronger.left_mm_s, right_stronger.right_mm_s);
    }
  }
}

TEST(SteeringTest, GainMultipliesTheDifferenceUpToTwice) {
  for (const int16_t left : Intensities()) {
    for (const int right : {0, 1, 1000, -4096}) {
      for (int gain = 0; gain <= kMaxGain; ++gain) {
        const int16_t k = 2000;
        const int64_t scale = ScaleOf(left, right);
        const int64_t d = std::abs(left - right);
        const int64_t term =
            std::min<int64_t>(RoundHalfUp({(int64_t{k} * gain / 8) * d, scale}), int64_t{2} * k);
        const WheelSpeeds speeds = Steer(Law::kDifferential, left, static_cast<int16_t>(right), k,
                                         static_cast<uint8_t>(gain));
        ASSERT_EQ(k - term, left > right ? speeds.left_mm_s : speeds.right_mm_s);
        ASSERT_EQ(k, left > right ? speeds.right_mm_s : speeds.left_mm_s);
      }
    }
  }
}

TEST(SteeringTest, BothLawsAreMirrorSymmetric) {
  for (const int16_t left : Intensities()) {
    for (const int16_t right : Intensities()) {
      for (const Law law : {Law::kDifferential, Law::kPaper}) {
        const WheelSpeeds speeds = Steer(law, left, right, 1234);
        const WheelSpeeds mirrored = Steer(law, right, left, 1234);
        ASSERT_EQ(speeds.left_mm_s, mirrored.right_mm_s);
        ASSERT_EQ(speeds.right_mm_s, mirrored.left_mm_s);
      }
    }
  }
}

}  // namespace
}  // namespace client
}  // namespace pheromone
