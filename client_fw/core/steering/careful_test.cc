#include "client_fw/core/steering/careful.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

namespace pheromone {
namespace client {
namespace {

using Mode = CarefulState::Mode;
using Side = CarefulState::Side;

constexpr WheelSpeeds kTurnLeft = {-100, 100};
constexpr WheelSpeeds kTurnRight = {100, -100};
constexpr WheelSpeeds kSlowAhead = {100, 100};

// The law again, as its header has it, in real numbers.
struct NaiveLaw {
  double plateau = 4096;

  // The speed of the faster wheel.
  double Speed(double left, double right, double k) {
    const double most = std::max(left, right);
    plateau = std::max(most, plateau * 31 / 32);
    const double d = std::abs(left - right) / std::max({4096.0, std::abs(left), std::abs(right)});
    const double sure = std::min(k, 300.0);
    const double speed = std::min(std::max(k * (1 - 3 * d), sure), 2 * k * most / plateau);
    return std::min(k, std::max(speed, std::min(k, 100.0)));
  }
};

int16_t Faster(const WheelSpeeds& wheels) {
  return std::max(wheels.left_mm_s, wheels.right_mm_s);
}

// A robot at the wheel, for sequences of answers.
struct Driver {
  CarefulState state = kCarefulStart;
  int16_t k_mm_s = 300;

  WheelSpeeds Answer(int16_t left, int16_t right, int heading_deg = 0) {
    Notice(left, right, static_cast<BinaryAngle>(heading_deg * 65536 / 360), &state);
    return SteerCareful(left, right, k_mm_s, kUnitGain, state);
  }
};

TEST(CarefulTest, SpeedIsThatOfTheEquation) {
  std::mt19937 random(1);
  const auto below = [&random](int bound) {
    return static_cast<int>(random() % static_cast<unsigned>(bound));
  };
  for (int run = 0; run < 200; ++run) {
    CarefulState state = kCarefulStart;
    NaiveLaw naive;
    const auto k = static_cast<int16_t>(below(kMaxSpeedMmS + 1));
    const int strength = 1 << (9 + below(6));
    for (int answer = 0; answer < 100; ++answer) {
      const auto left = static_cast<int16_t>(below(strength));
      const auto right = static_cast<int16_t>(below(3) == 0 ? below(strength)
                                                            : std::min(32767, left + below(200)));
      Notice(left, right, 0, &state);
      const WheelSpeeds wheels = SteerCareful(left, right, k, kUnitGain, state);
      const double speed = naive.Speed(left, right, k);
      // P_max is a whole number, which at worst costs a 32nd of its small values.
      ASSERT_NEAR(speed, Faster(wheels), 2 + speed / 16) << left << ' ' << right << ' ' << k;
      const WheelSpeeds expected = SteerDifferential(left, right, Faster(wheels));
      ASSERT_EQ(expected, wheels) << "not the differential law at its speed";
    }
  }
}

// Worked by hand.
TEST(CarefulTest, KnownSpeeds) {
  Driver robot;
  robot.k_mm_s = 600;
  EXPECT_EQ((WheelSpeeds{600, 600}), robot.Answer(8192, 8192));
  // D = 1/8: 600 * (1 - 3/8) = 375, of which the left wheel has 7/8.
  EXPECT_EQ((WheelSpeeds{328, 375}), robot.Answer(8192, 7168));
  // D = 1/2: K_sure.
  EXPECT_EQ((WheelSpeeds{300, 150}), robot.Answer(4096, 8192));
  // A quarter of P_max, which has fallen by a 32nd: 2 * 600 * 1984 / 7936.
  EXPECT_EQ((WheelSpeeds{300, 300}), robot.Answer(1984, 1984));
}

TEST(CarefulTest, UpToTheSureSpeedItIsTheDifferentialLawOnATrail) {
  for (const int16_t k : {int16_t{0}, int16_t{50}, int16_t{200}, int16_t{300}}) {
    for (int left = 0; left <= 16000; left += 371) {
      for (int right = 8000; right <= 16000; right += 173) {
        Driver robot;
        robot.k_mm_s = k;
        robot.Answer(16000, 16000);
        const auto l = static_cast<int16_t>(left);
        const auto r = static_cast<int16_t>(right);
        ASSERT_EQ(SteerDifferential(l, r, k), robot.Answer(l, r)) << l << ' ' << r << ' ' << k;
      }
    }
  }
}

TEST(CarefulTest, LeavingTheTrailItSlowsDownToTheSlowSpeed) {
  Driver robot;
  robot.k_mm_s = 600;
  robot.Answer(12000, 12000);
  int16_t before = 600;
  for (int p = 5000; p >= 0; p -= 500) {
    const WheelSpeeds wheels = robot.Answer(static_cast<int16_t>(p), static_cast<int16_t>(p));
    EXPECT_EQ(wheels.left_mm_s, wheels.right_mm_s);
    EXPECT_LE(wheels.left_mm_s, before);
    before = wheels.left_mm_s;
  }
  EXPECT_EQ(kSlowSpeedMmS, before);
}

TEST(CarefulTest, WhereARepellentPrevailsItTurnsAsideByHalfARightAngleAndPassesBySlowly) {
  for (const bool left : {false, true}) {
    const auto answer = [left](Driver* robot, int16_t less, int16_t more, int turned_deg) {
      return left ? robot->Answer(less, more, 90 + turned_deg)
                  : robot->Answer(more, less, 90 - turned_deg);
    };
    const WheelSpeeds aside = left ? kTurnLeft : kTurnRight;
    Driver robot;
    answer(&robot, 8000, 8000, 0);
    EXPECT_EQ(aside, answer(&robot, -100, -200, 0));
    EXPECT_EQ(aside, answer(&robot, -300, -200, 44));  // latched, though the other is better now
    EXPECT_EQ(kSlowAhead, answer(&robot, -300, -200, 46));
    EXPECT_EQ(kSlowAhead, answer(&robot, 50, -200, 46));  // until neither is negative
    EXPECT_EQ(aside, answer(&robot, 50, -200, 40));
    const WheelSpeeds wheels = answer(&robot, 500, 200, 46);
    EXPECT_NE(kSlowAhead, wheels);
    EXPECT_LE(Faster(wheels), kSlowSpeedMmS);  // far below P_max
  }
}

TEST(CarefulTest, ASingleAntennaInTheRepellentOnlySteers) {
  Driver robot;
  robot.Answer(8000, 8000);
  EXPECT_EQ(SteerDifferential(6000, -6000, 300), robot.Answer(6000, -6000));
  EXPECT_EQ(Side::kNone, robot.state.aside);
}

TEST(CarefulTest, BackInTheRepellentItTurnsToTheSameSideByHalfOfTheAngle) {
  Driver robot;
  robot.Answer(8000, 8000, 10);
  EXPECT_EQ(kTurnRight, robot.Answer(-200, -100, 10));
  EXPECT_EQ(kSlowAhead, robot.Answer(-200, -100, -36));
  robot.Answer(1000, 900, -36);
  EXPECT_EQ(kTurnRight, robot.Answer(-10, -300, -10));  // the left is better, but it is latched
  EXPECT_EQ(kTurnRight, robot.Answer(-10, -300, -12));
  EXPECT_EQ(kSlowAhead, robot.Answer(-10, -300, -13));  // 22.5 degrees from 10
  robot.Answer(0, 0, -13);
  EXPECT_EQ(kTurnRight, robot.Answer(-10, -300, -1));
  EXPECT_EQ(kSlowAhead, robot.Answer(-10, -300, -2));  // 11.25 degrees
}

TEST(CarefulTest, ThreeGoodAnswersInSuccessionReleaseTheSide) {
  for (const int good : {2, 3}) {
    Driver robot;
    robot.Answer(8000, 8000);
    robot.Answer(-200, -100);
    robot.Answer(7000, 7000, -46);
    robot.Answer(7000, 3000, -46);  // one antenna is below half: counted again
    for (int i = 0; i < good; ++i) {
      robot.Answer(7000, 7000, -46);
    }
    EXPECT_EQ(good == 3 ? Side::kNone : Side::kRight, robot.state.aside);
    EXPECT_EQ(good == 3 ? kTurnLeft : kSlowAhead, robot.Answer(-100, -200, -46));
  }
}

TEST(CarefulTest, EquallyRepelledItTurnsToWhereMoreWasSensedLast) {
  Driver robot;
  robot.Answer(100, 200);
  EXPECT_EQ(kTurnRight, robot.Answer(-5000, -5000));
  Driver other;
  other.Answer(200, 100);
  EXPECT_EQ(kTurnLeft, other.Answer(-5000, -5000));
}

TEST(CarefulTest, HeadingsAreComparedAcrossZero) {
  Driver robot;
  robot.Answer(-100, -200, 350);
  EXPECT_EQ(kTurnLeft, robot.Answer(-100, -200, 30));
  EXPECT_EQ(kSlowAhead, robot.Answer(-100, -200, 36));
  EXPECT_EQ(kTurnLeft, robot.Answer(-100, -200, 340));  // the wrong way
}

TEST(CarefulTest, ItSearchesBackWhereThePathWas) {
  Driver robot;
  robot.Answer(100, 200);
  EXPECT_EQ(kTurnRight, Search(300, robot.state));
  robot.Answer(-100, -200);  // aside to the left
  robot.Answer(0, 0, 46);
  EXPECT_EQ(kTurnRight, Search(300, robot.state));
  Driver other;
  other.Answer(-200, -100);
  other.Answer(0, 0, -46);
  EXPECT_EQ(kTurnLeft, Search(300, other.state));
  EXPECT_EQ((WheelSpeeds{-40, 40}), Search(40, other.state));
}

TEST(CarefulTest, IsMirrorSymmetricAndNeverFasterThanK) {
  std::mt19937 random(2);
  const auto any = [&random] { return static_cast<int16_t>(random() & 0xFFFF); };
  for (int run = 0; run < 300; ++run) {
    const auto k = static_cast<int16_t>(random() % (kMaxSpeedMmS + 1));
    CarefulState state = kCarefulStart;
    CarefulState mirrored = kCarefulStart;
    mirrored.stronger = Side::kRight;
    const int shift = static_cast<int>(random() % 12);
    for (int answer = 0; answer < 60; ++answer) {
      const auto left = static_cast<int16_t>(any() / (1 << shift));
      const auto right = static_cast<int16_t>(any() / (1 << shift));
      const auto heading = static_cast<BinaryAngle>(random() & 0xFFFF);
      Notice(left, right, heading, &state);
      Notice(right, left, static_cast<BinaryAngle>(0 - heading), &mirrored);
      const WheelSpeeds wheels = SteerCareful(left, right, k, kUnitGain, state);
      const WheelSpeeds other = SteerCareful(right, left, k, kUnitGain, mirrored);
      ASSERT_EQ(wheels.left_mm_s, other.right_mm_s);
      ASSERT_EQ(wheels.right_mm_s, other.left_mm_s);
      for (const int16_t wheel : {wheels.left_mm_s, wheels.right_mm_s}) {
        ASSERT_LE(std::abs(wheel), k);
      }
    }
  }
}

}  // namespace
}  // namespace client
}  // namespace pheromone
