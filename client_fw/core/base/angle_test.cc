#include "client_fw/core/base/angle.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

namespace pheromone {
namespace client {
namespace {

double Radians(int angle) {
  return angle * 2 * M_PI / 65536;
}

TEST(AngleTest, SineAndCosineAreWithinTheirBoundOfTheTruth) {
  for (int angle = 0; angle < 65536; ++angle) {
    const auto binary = static_cast<BinaryAngle>(angle);
    ASSERT_NEAR(16384 * std::sin(Radians(angle)), SinQ14(binary), 2) << angle;
    ASSERT_NEAR(16384 * std::cos(Radians(angle)), CosQ14(binary), 2) << angle;
  }
}

TEST(AngleTest, ExactOnTheAxes) {
  EXPECT_EQ(0, SinQ14(0x0000));
  EXPECT_EQ(16384, CosQ14(0x0000));
  EXPECT_EQ(16384, SinQ14(0x4000));
  EXPECT_EQ(0, CosQ14(0x4000));
  EXPECT_EQ(0, SinQ14(0x8000));
  EXPECT_EQ(-16384, CosQ14(0x8000));
  EXPECT_EQ(-16384, SinQ14(0xC000));
  EXPECT_EQ(0, CosQ14(0xC000));
}

TEST(AngleTest, SineEqualsCosineAt45Degrees) {
  EXPECT_EQ(SinQ14(0x2000), CosQ14(0x2000));
  EXPECT_EQ(SinQ14(0x6000), -CosQ14(0x6000));
  EXPECT_EQ(SinQ14(0xA000), CosQ14(0xA000));
  EXPECT_EQ(SinQ14(0xE000), -CosQ14(0xE000));
  EXPECT_EQ(11585, SinQ14(0x2000));  // 16384 / sqrt(2) = 11585.2
}

TEST(AngleTest, SymmetriesHoldToTheBit) {
  for (int angle = 0; angle < 65536; ++angle) {
    const auto a = static_cast<BinaryAngle>(angle);
    const auto minus = static_cast<BinaryAngle>(-angle);
    ASSERT_EQ(SinQ14(a), -SinQ14(minus));
    ASSERT_EQ(CosQ14(a), CosQ14(minus));
    ASSERT_EQ(SinQ14(a), -SinQ14(static_cast<BinaryAngle>(angle + 0x8000)));
  }
}

TEST(AngleTest, SineRisesOverAQuarter) {
  for (int angle = 1; angle <= 0x4000; ++angle) {
    ASSERT_LE(SinQ14(static_cast<BinaryAngle>(angle - 1)), SinQ14(static_cast<BinaryAngle>(angle)));
  }
}

TEST(StartPoseTest, TurnsByQuartersWithoutError) {
  const Odometry odometry = {3000, -1000, 0x1234};
  const struct {
    BinaryAngle heading;
    int32_t x;
    int32_t y;
  } cases[] = {
      {0x0000, 3000, -1000}, {0x4000, 1000, 3000}, {0x8000, -3000, 1000}, {0xC000, -1000, -3000}};
  for (const auto& c : cases) {
    const Pose pose = StartPose(Pose{100, 200, c.heading}).Place(odometry);
    EXPECT_EQ(100 + c.x, pose.x_mm);
    EXPECT_EQ(200 + c.y, pose.y_mm);
    EXPECT_EQ(static_cast<BinaryAngle>(c.heading + 0x1234), pose.heading);
  }
}

// The same sum in 64 bits: what splitting into words must not change.
int32_t Rotated(int64_t a, int64_t factor_a, int64_t b, int64_t factor_b) {
  const int64_t sum = a * factor_a + b * factor_b + 8192;
  return static_cast<int32_t>(sum >= 0 ? sum / 16384 : -((16383 - sum) / 16384));
}

TEST(StartPoseTest, EqualsTheRotationIn64BitsUpToTheLimit) {
  const int32_t places[] = {-kMaxCoordinateMm,
                            -16000000,
                            -1234567,
                            -65537,
                            -65536,
                            -32768,
                            -1,
                            0,
                            1,
                            16383,
                            16384,
                            65535,
                            65536,
                            999999,
                            16000000,
                            kMaxCoordinateMm};
  for (int heading = 0; heading < 65536; heading += 997) {
    const auto h = static_cast<BinaryAngle>(heading);
    for (const int32_t x : places) {
      for (const int32_t y : places) {
        const Pose pose = StartPose(Pose{-5, 7, h}).Place(Odometry{x, y, 0});
        ASSERT_EQ(-5 + Rotated(x, CosQ14(h), y, -SinQ14(h)), pose.x_mm);
        ASSERT_EQ(7 + Rotated(x, SinQ14(h), y, CosQ14(h)), pose.y_mm);
      }
    }
  }
}

TEST(StartPoseTest, CloseToTheTrueRotation) {
  for (int heading = 0; heading < 65536; heading += 331) {
    const StartPose start(Pose{0, 0, static_cast<BinaryAngle>(heading)});
    for (const int32_t way : {10000, -32000}) {
      const Pose pose = start.Place(Odometry{way, way / 2, 0});
      const double c = std::cos(Radians(heading));
      const double s = std::sin(Radians(heading));
      const double bound = 1 + 0.2e-3 * std::hypot(way, way / 2.0);
      ASSERT_NEAR(way * c - way / 2.0 * s, pose.x_mm, bound);
      ASSERT_NEAR(way * s + way / 2.0 * c, pose.y_mm, bound);
    }
  }
}

TEST(StartPoseTest, OdometryBeyondTheLimitIsFarAway) {
  const StartPose start(Pose{0, 0, 0x1000});
  for (const int32_t bad : {kMaxCoordinateMm + 1, -kMaxCoordinateMm - 1, INT32_MAX, INT32_MIN}) {
    EXPECT_EQ(kFarAway, start.Place(Odometry{bad, 0, 0}).x_mm);
    EXPECT_EQ(kFarAway, start.Place(Odometry{0, bad, 0}).y_mm);
  }
}

TEST(PoseUnitsTest, MillimetresAreThemselves) {
  int32_t units = 0;
  for (const int32_t mm : {0, 1, -1, 32767, -32768, kMaxCoordinateMm, -kMaxCoordinateMm}) {
    ASSERT_TRUE(ToPoseUnits(mm, 100, &units));
    EXPECT_EQ(mm, units);
  }
}

TEST(PoseUnitsTest, RoundsHalvesAwayFromZero) {
  int32_t units = 0;
  ASSERT_TRUE(ToPoseUnits(5, 1000, &units));  // 5 mm in centimetres
  EXPECT_EQ(1, units);
  ASSERT_TRUE(ToPoseUnits(-5, 1000, &units));
  EXPECT_EQ(-1, units);
  ASSERT_TRUE(ToPoseUnits(4, 1000, &units));
  EXPECT_EQ(0, units);
}

TEST(PoseUnitsTest, EqualsTheExactFractionForEveryKindOfUnit) {
  for (const int size : {1, 2, 3, 7, 99, 100, 101, 1000, 32767, 32768, 65535}) {
    const auto unit = static_cast<uint16_t>(size);
    for (int64_t mm = 0; mm <= kMaxCoordinateMm; mm = mm * 2 + 3) {
      int32_t units = 0;
      ASSERT_TRUE(ToPoseUnits(static_cast<int32_t>(-mm), unit, &units));
      const int64_t expected = (2 * mm * 100 + size) / (int64_t{2} * size);
      ASSERT_EQ(-expected, units) << mm << ' ' << unit;
    }
  }
}

TEST(PoseUnitsTest, RefusesWhatHasNoUnitOrIsTooFar) {
  int32_t units = 0;
  EXPECT_FALSE(ToPoseUnits(1, 0, &units));
  for (const int32_t bad : {kMaxCoordinateMm + 1, -kMaxCoordinateMm - 1, kFarAway, INT32_MIN}) {
    EXPECT_FALSE(ToPoseUnits(bad, 100, &units));
  }
}

}  // namespace
}  // namespace client
}  // namespace pheromone
