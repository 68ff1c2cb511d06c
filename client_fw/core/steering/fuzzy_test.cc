#include "client_fw/core/steering/fuzzy.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <vector>

namespace pheromone {
namespace client {
namespace {

struct Speeds {
  double left;
  double right;
};

double Triangle(double x, double centre) {
  return std::max(0.0, 1 - std::abs(x - centre));
}

// e as fuzzy.h defines it.
double ErrorOf(int left, int right) {
  const double scale = std::max({4096, std::abs(left), std::abs(right)});
  const double exact = std::abs(left - right) / scale;
  return std::copysign(std::floor(exact * 2048 + 0.5) / 2048, left - right);
}

// The controller as a textbook has it: five labels for a signed e, each with its rule, the weights
// in floating point and the weighted mean with its division.
Speeds Sugeno(const FuzzyGains& gains, double error, double change, double k) {
  const double scaled = error * gains.error_16 / 16.0;
  double weights = 0;
  double turn = 0;
  double speed = 0;
  for (int label = -2; label <= 2; ++label) {  // NB, N, Z, P, PB
    const double x = std::clamp(scaled, -2.0, 2.0);
    const double weight = Triangle(x, label);
    const FuzzyRule& rule = gains.rules[std::abs(label)];
    weights += weight;
    const double side = label < 0 ? -1 : 1;
    turn += weight * (side * rule.turn_128 / 128.0 + rule.change_64 / 64.0 * change);
    speed += weight * rule.speed_128 / 128.0;
  }
  turn = std::clamp(turn / weights, -1.0, 1.0);
  speed /= weights;
  return {k * speed * (1 - 2 * std::max(turn, 0.0)), k * speed * (1 - 2 * std::max(-turn, 0.0))};
}

constexpr int16_t kEdges[] = {-32768, -32767, -8192, -4097, -4096, -4095, -2048, -1,    0,    1,
                              2047,   2048,   2049,  4095,  4096,  4097,  8192,  32766, 32767};
constexpr int16_t kSpeeds[] = {0, 1, 2, 300, 500, 777, 2200};

std::vector<FuzzyGains> Controllers() {
  return {kTunedFuzzy,
          {16, {{0, 0, 127}, {64, 0, 127}, {127, 0, 127}}},          // almost the differential law
          {0, {{0, 127, 127}, {0, 0, 0}, {0, 0, 0}}},                // looks at the change alone
          {127, {{0, 10, 100}, {30, 100, 60}, {120, 127, 20}}},      // steep
          {8, {{0, -128, 0}, {-128, 127, 127}, {127, -128, 127}}}};  // makes no sense
}

void ExpectNear(const FuzzyGains& gains, int16_t left, int16_t right, int16_t k, FuzzyState state) {
  const double error = ErrorOf(left, right);
  const double change = state.error == kNoError ? 0 : error - state.error / 2048.0;
  const Speeds expected = Sugeno(gains, error, change, k);
  const WheelSpeeds got = SteerFuzzy(left, right, k, gains, &state);
  const double tolerance = 1 + k / 200.0;
  ASSERT_NEAR(got.left_mm_s, expected.left, tolerance) << left << ' ' << right << ' ' << k;
  ASSERT_NEAR(got.right_mm_s, expected.right, tolerance) << left << ' ' << right << ' ' << k;
  ASSERT_EQ(state.error, static_cast<int16_t>(std::lround(error * 2048)));
}

// What is left in the state after these intensities.
FuzzyState After(int16_t left, int16_t right) {
  FuzzyState state = {kNoError};
  SteerFuzzy(left, right, 0, kTunedFuzzy, &state);
  return state;
}

TEST(FuzzyTest, EqualsTheTextbooksControllerInEveryCorner) {
  for (const FuzzyGains& gains : Controllers()) {
    for (const int16_t left : kEdges) {
      for (const int16_t right : kEdges) {
        for (const int16_t before : kEdges) {
          for (const int16_t k : kSpeeds) {
            ExpectNear(gains, left, right, k, After(before, 0));
            ExpectNear(gains, left, right, k, After(before, static_cast<int16_t>(-before / 2)));
          }
        }
        ExpectNear(gains, left, right, 300, {kNoError});
      }
    }
  }
}

TEST(FuzzyTest, EqualsTheTextbooksControllerAtRandom) {
  std::mt19937 random(1);
  const auto draw = [&](int from, int to) {
    return std::uniform_int_distribution<int>(from, to)(random);
  };
  for (int i = 0; i < 300'000; ++i) {
    FuzzyGains gains{};
    gains.error_16 = static_cast<int8_t>(draw(0, 127));
    for (FuzzyRule& rule : gains.rules) {
      rule = {static_cast<int8_t>(draw(-128, 127)), static_cast<int8_t>(draw(-128, 127)),
              static_cast<int8_t>(draw(0, 127))};
    }
    // Half of them as on a path: within two units.
    const int most = i % 2 == 0 ? 8192 : 32767;
    const auto left = static_cast<int16_t>(draw(-most, most));
    const auto right = static_cast<int16_t>(draw(-most, most));
    gains.rules[0].turn_128 = 0;
    const FuzzyState state = {static_cast<int16_t>(draw(-4096, 4096))};
    ExpectNear(gains, left, right, static_cast<int16_t>(draw(0, 2200)), state);
  }
}

TEST(FuzzyTest, TheTunedRulesAreExactTo1500MicrometresASecondAt300) {
  std::mt19937 random(3);
  for (int i = 0; i < 300'000; ++i) {
    const auto left = static_cast<int16_t>(random() % 32768);
    const auto right = static_cast<int16_t>(random() % 32768);
    const auto before = static_cast<int16_t>(static_cast<int>(random() % 4097) - 2048);
    FuzzyState state = {before};
    const double error = ErrorOf(left, right);
    const Speeds expected = Sugeno(kTunedFuzzy, error, error - before / 2048.0, 300);
    const WheelSpeeds got = SteerFuzzy(left, right, 300, kTunedFuzzy, &state);
    ASSERT_NEAR(got.left_mm_s, expected.left, 1.5) << left << ' ' << right << ' ' << before;
    ASSERT_NEAR(got.right_mm_s, expected.right, 1.5) << left << ' ' << right << ' ' << before;
  }
}

TEST(FuzzyTest, MirroredIntensitiesGiveMirroredWheels) {
  for (const FuzzyGains& gains : Controllers()) {
    for (const int16_t left : kEdges) {
      for (const int16_t right : kEdges) {
        for (int before = -4096; before <= 4096; before += 127) {
          FuzzyState state = {static_cast<int16_t>(before)};
          FuzzyState mirrored_state = {static_cast<int16_t>(-before)};
          const WheelSpeeds wheels = SteerFuzzy(left, right, 777, gains, &state);
          const WheelSpeeds mirrored = SteerFuzzy(right, left, 777, gains, &mirrored_state);
          ASSERT_EQ(wheels, (WheelSpeeds{mirrored.right_mm_s, mirrored.left_mm_s}))
              << left << ' ' << right << ' ' << before;
          ASSERT_EQ(state.error, -mirrored_state.error);
        }
      }
    }
  }
}

TEST(FuzzyTest, GoesStraightWhenBalancedAndSteady) {
  for (const int16_t p : kEdges) {
    FuzzyState state = {kNoError};
    for (int answer = 0; answer < 3; ++answer) {
      const WheelSpeeds wheels = SteerFuzzy(p, p, 300, kTunedFuzzy, &state);
      EXPECT_EQ(wheels.left_mm_s, wheels.right_mm_s);
      EXPECT_GE(wheels.left_mm_s, 295);
    }
  }
}

TEST(FuzzyTest, TurnsTheMoreTheLargerTheError) {
  for (const int before : {0, 300, -300}) {
    int last = -5000;
    for (int left = 0; left <= 8192; ++left) {
      FuzzyState state = {static_cast<int16_t>(before)};
      // Wheels at speed share 1, so that nothing but u is looked at.
      FuzzyGains gains = kTunedFuzzy;
      for (FuzzyRule& rule : gains.rules) {
        rule.speed_128 = 127;
      }
      const WheelSpeeds wheels = SteerFuzzy(static_cast<int16_t>(left),
                                            static_cast<int16_t>(8192 - left), 300, gains, &state);
      const int turn = wheels.right_mm_s - wheels.left_mm_s;
      ASSERT_GE(turn, last) << left;
      last = turn;
    }
    EXPECT_GT(last, 300);
  }
}

TEST(FuzzyTest, TurnsTowardsTheStrongerSideWhenSteady) {
  for (const int16_t left : kEdges) {
    for (const int16_t right : kEdges) {
      FuzzyState state = {kNoError};
      const WheelSpeeds wheels = SteerFuzzy(left, right, 2200, kTunedFuzzy, &state);
      if (ErrorOf(left, right) > 0.01) {
        EXPECT_LT(wheels.left_mm_s, wheels.right_mm_s);
      } else if (ErrorOf(left, right) < -0.01) {
        EXPECT_GT(wheels.left_mm_s, wheels.right_mm_s);
      }
    }
  }
}

TEST(FuzzyTest, TheWheelsStayWithinK) {
  std::mt19937 random(2);
  for (int i = 0; i < 200'000; ++i) {
    const auto byte = [&] { return static_cast<int8_t>(random() & 0xFF); };
    const auto speed = [&] { return static_cast<int8_t>(random() & 0x7F); };
    const FuzzyGains gains = {
        speed(), {{byte(), byte(), speed()}, {byte(), byte(), speed()}, {byte(), byte(), speed()}}};
    FuzzyState state = {static_cast<int16_t>(static_cast<int>(random() % 8193) - 4096)};
    const auto k = static_cast<int16_t>(random() % 2201);
    const WheelSpeeds wheels =
        SteerFuzzy(static_cast<int16_t>(random() & 0xFFFF), static_cast<int16_t>(random() & 0xFFFF),
                   k, gains, &state);
    ASSERT_LE(std::abs(wheels.left_mm_s), k);
    ASSERT_LE(std::abs(wheels.right_mm_s), k);
  }
}

// Worked by hand: g = 1, rules Z (0, 0, 1), P (1/2, 1/2, 1), PB (1, 1/2, 1/2).
TEST(FuzzyTest, KnownValues) {
  const FuzzyGains gains = {16, {{0, 0, 127}, {64, 32, 127}, {127, 32, 64}}};
  FuzzyState state = {kNoError};
  // e = 1/2: halfway between Z and P, u = 1/4, s = 127/128: 1016 K/1024 and half of that.
  EXPECT_EQ(SteerFuzzy(2048, 0, 1024, gains, &state), (WheelSpeeds{508, 1016}));
  // e = 1/2 again is no change; e = 1 then adds de = 1/2: u = 1/2 + 1/4.
  EXPECT_EQ(SteerFuzzy(0, -2048, 1024, gains, &state), (WheelSpeeds{508, 1016}));
  EXPECT_EQ(SteerFuzzy(4096, 0, 1024, gains, &state), (WheelSpeeds{-508, 1016}));
  // Back to e = 0, where Z does not look at the change: straight on.
  EXPECT_EQ(SteerFuzzy(700, 700, 1024, gains, &state), (WheelSpeeds{1016, 1016}));
  // e = -1, de = -1: u = -1, on the spot to the right.
  EXPECT_EQ(SteerFuzzy(0, 4096, 1024, gains, &state), (WheelSpeeds{1016, -1016}));
  // e = -1/2, de = +1/2: u = -1/4 + 1/8.
  EXPECT_EQ(SteerFuzzy(0, 2048, 1024, gains, &state), (WheelSpeeds{1016, 762}));
}

TEST(FuzzyTest, AfterAPauseTheOldErrorDoesNotCount) {
  FuzzyState fresh = {kNoError};
  FuzzyState steady = After(3000, 1000);
  EXPECT_EQ(SteerFuzzy(3000, 1000, 300, kTunedFuzzy, &fresh),
            SteerFuzzy(3000, 1000, 300, kTunedFuzzy, &steady));
}

}  // namespace
}  // namespace client
}  // namespace pheromone
