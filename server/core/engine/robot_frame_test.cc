#include "server/core/engine/robot_frame.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

namespace pheromone::engine {
namespace {

field::PoseUm At(int64_t x, int64_t y, uint16_t heading = 0) {
  return {{x, y}, heading};
}

TEST(Frame, WithoutOneEverythingStaysWhereItIs) {
  const field::PoseUm pose = ToMap(RobotFrame{}, At(-123'456, 789, 4321));
  EXPECT_EQ(pose.position, (field::PointUm{-123'456, 789}));
  EXPECT_EQ(pose.heading, 4321);
}

TEST(Frame, QuarterTurnsAreExact) {
  const field::PoseUm reported = At(3'000'001, 1'000'002, 60'000);
  const struct {
    double heading_deg = 0;
    field::PointUm position;
    uint16_t heading = 0;
  } expected[] = {
      {0, {3'000'001, 1'000'002}, 60'000},           {90, {-1'000'002, 3'000'001}, 10'848},
      {180, {-3'000'001, -1'000'002}, 27'232},       {-90, {1'000'002, -3'000'001}, 43'616},
      {450, {-1'000'002, 3'000'001}, 10'848},        {-270, {-1'000'002, 3'000'001}, 10'848},
      {36'000'090, {-1'000'002, 3'000'001}, 10'848},
  };
  for (const auto& it : expected) {
    const RobotFrame frame = MakeFrame("radio-a", 1, {5, -7}, it.heading_deg);
    const field::PoseUm pose = ToMap(frame, reported);
    EXPECT_EQ(pose.position, (field::PointUm{it.position.x + 5, it.position.y - 7}))
        << it.heading_deg;
    EXPECT_EQ(pose.heading, it.heading) << it.heading_deg;
  }
}

// The exact rotation, in long double from the angle itself; tolerance: 2^-31 for each of the two
// numbers, and half a micrometre for the sum.
TEST(Frame, TurnsAsTrigonometryDoes) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> any_angle(-720, 720);
  for (int i = 0; i < 100'000; ++i) {
    const double heading_deg = any_angle(random);
    const int shift = static_cast<int>(random() % 40);
    const int64_t x = static_cast<int64_t>(random()) >> (13 + shift);  // to 2^50 um
    const int64_t y = static_cast<int64_t>(random()) >> (13 + shift);
    const field::PointUm origin{static_cast<int64_t>(random() % 2'000'000'000'000) - 1'000'000'000,
                                static_cast<int64_t>(random() % 2'000'000'000'000)};
    const RobotFrame frame = MakeFrame("radio-a", 1, origin, heading_deg);
    ASSERT_TRUE(CheckFrames({frame}).ok()) << heading_deg;
    const field::PoseUm pose = ToMap(frame, At(x, y));
    const long double angle = heading_deg * std::numbers::pi_v<long double> / 180;
    const long double c = std::cos(angle);
    const long double s = std::sin(angle);
    const auto lx = static_cast<long double>(x);
    const auto ly = static_cast<long double>(y);
    const long double allowed = 0.5L + (std::abs(lx) + std::abs(ly)) * 0x1.01p-31L;
    ASSERT_LE(std::abs(static_cast<long double>(pose.position.x - origin.x) - (c * lx - s * ly)),
              allowed);
    ASSERT_LE(std::abs(static_cast<long double>(pose.position.y - origin.y) - (s * lx + c * ly)),
              allowed);
    const long double turns = std::remainder(heading_deg / 360 - pose.heading / 65536.0L, 1.0L);
    ASSERT_LE(std::abs(turns) * 65536, 0.5001L) << heading_deg;
  }
}

// The definition, bit by bit: long double holds products of 30 and 32 bits exactly, and roundl
// rounds halves away from zero.
TEST(Frame, RoundsToNearestHalvesAwayFromZero) {
  std::mt19937_64 random(2);
  for (int i = 0; i < 100'000; ++i) {
    RobotFrame frame;
    frame.cos_q30 = static_cast<int32_t>(random() % (1u << 31)) - (1 << 30);
    frame.sin_q30 = static_cast<int32_t>(random() % (1u << 31)) - (1 << 30);
    if (i % 2 == 0) {  // ties: odd multiples of one half
      frame.cos_q30 = 1 << 29;
      frame.sin_q30 = 0;
    }
    const auto x = static_cast<int32_t>(random());
    const auto y = static_cast<int32_t>(random());
    const auto rounded = [](int64_t a, int64_t b) {
      return static_cast<int64_t>(
          std::round((static_cast<long double>(a) + static_cast<long double>(b)) / 0x1p30L));
    };
    const field::PoseUm pose = ToMap(frame, At(x, y));
    ASSERT_EQ(pose.position.x, rounded(int64_t{frame.cos_q30} * x, -int64_t{frame.sin_q30} * y));
    ASSERT_EQ(pose.position.y, rounded(int64_t{frame.sin_q30} * x, int64_t{frame.cos_q30} * y));
  }
}

TEST(Frame, TheFarthestPositionOfAMessageIsInRange) {
  const int64_t farthest = int64_t{INT32_MIN} * 655'350;
  RobotFrame frame = MakeFrame("radio-a", 1, {-kMaxOffsetUm, kMaxOffsetUm}, 180);
  ASSERT_TRUE(CheckFrames({frame}).ok());
  EXPECT_EQ(ToMap(frame, At(farthest, farthest)).position,
            (field::PointUm{-farthest - kMaxOffsetUm, -farthest + kMaxOffsetUm}));
}

TEST(CheckFrames, SaysWhichFrameIsWrongAndWhy) {
  const RobotFrame good = MakeFrame("radio-a", 7, {1, 2}, 33.3);
  const struct {
    std::function<void(RobotFrame&)> spoil;
    std::string words;
  } mistakes[] = {
      {[](RobotFrame& it) { it.id = 0; }, "invalid robot ID"},
      {[](RobotFrame& it) { it.id = 255; }, "invalid robot ID"},
      {[](RobotFrame& it) { it.x_um = kMaxOffsetUm + 1; }, "10^15"},
      {[](RobotFrame& it) { it.y_um = INT64_MIN; }, "10^15"},
      {[](RobotFrame& it) { it.cos_q30 += 4; }, "turned by"},
      {[](RobotFrame& it) { it.sin_q30 = INT32_MIN; }, "turned by"},
      {[](RobotFrame& it) { it.cos_q30 = it.sin_q30 = INT32_MIN; }, "turned by"},
      {[](RobotFrame& it) { it.sin_q30 = -it.sin_q30; }, "turned by"},
      {[](RobotFrame& it) { it.heading = static_cast<uint16_t>(it.heading + 8); }, "turned by"},
  };
  ASSERT_TRUE(CheckFrames({good}).ok());
  for (const auto& it : mistakes) {
    RobotFrame bad = good;
    it.spoil(bad);
    const Status status = CheckFrames({MakeFrame("radio-b", 7, {}, 0), bad});
    ASSERT_FALSE(status.ok()) << it.words;
    EXPECT_NE(status.error().find(it.words), std::string::npos) << status.error();
    EXPECT_NE(status.error().find("on link \"radio-a\""), std::string::npos) << status.error();
  }
  EXPECT_FALSE(CheckFrames({good, good}).ok());
  EXPECT_TRUE(CheckFrames({good, MakeFrame("radio-a", 8, {}, 0)}).ok());
}

}  // namespace
}  // namespace pheromone::engine
