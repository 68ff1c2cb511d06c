#include "client_fw/experiments/laws/follow.h"

#include <gtest/gtest.h>

#include <cmath>

namespace pheromone::swarm {
namespace {

TEST(Follow, BeginsBesideEveryCurveAsThePaperSays) {
  for (const Curve curve : {Curve::kLine, Curve::kCircle, Curve::kSCurve, Curve::kSpiral,
                            Curve::kEight, Curve::kSquare}) {
    for (uint64_t seed = 1; seed <= 4; ++seed) {
      FollowConditions conditions;
      conditions.curve = curve;
      conditions.duration_ms = 100;
      EXPECT_NEAR(Follow(conditions, seed).track.front().distance_m, 0.2, 0.005) << NameOf(curve);
    }
  }
}

TEST(Follow, ARepeatedRunIsTheSameToTheBit) {
  FollowConditions conditions;
  conditions.curve = Curve::kEight;
  conditions.steering.law = client::Law::kFuzzy;
  conditions.frame_loss = 0.1;
  const FollowResult first = Follow(conditions, 5);
  EXPECT_EQ(ToCsv(first.track), ToCsv(Follow(conditions, 5).track));
  EXPECT_NE(ToCsv(first.track), ToCsv(Follow(conditions, 6).track));
}

TEST(Follow, StopsBeforeTheEndOfAnOpenCurve) {
  FollowConditions conditions;
  conditions.curve = Curve::kSCurve;
  conditions.duration_ms = 100'000;
  const FollowResult result = Follow(conditions, 1);
  const double length_m = field::LengthOf(PathOf(Curve::kSCurve)) / 1e6;
  EXPECT_NEAR(result.track.back().along_m, length_m - 0.5, 0.05);
}

// Round the circle of 9.42 m more than once: the way counts on.
TEST(Follow, ProgressGoesOnBeyondTheFirstRound) {
  FollowConditions conditions;
  conditions.curve = Curve::kCircle;
  conditions.duration_ms = 60'000;
  const FollowResult result = Follow(conditions, 1);
  EXPECT_GT(result.progress_mm_s, 200);
  EXPECT_LE(result.progress_mm_s, 300 * 1.5 / (1.5 - 0.1));
}

// Where the eight crosses itself the nearest point jumps by half its length.
TEST(Follow, ACrossingIsNoProgress) {
  FollowConditions conditions;
  conditions.curve = Curve::kEight;
  conditions.duration_ms = 40'000;
  for (uint64_t seed = 1; seed <= 4; ++seed) {
    const FollowResult result = Follow(conditions, seed);
    EXPECT_GT(result.progress_mm_s, 200);
    EXPECT_LT(result.progress_mm_s, 310);
  }
}

TEST(Follow, ALateServerIsStillHeard) {
  FollowConditions conditions;
  conditions.latency_ms = 150;
  EXPECT_GT(Follow(conditions, 1).progress_mm_s, 100);
}

// A right wheel that seems to roll 1 % farther turns the odometry by 0.03 rad a metre.
TEST(Follow, DriftOfTheOdometryLeadsOffThePath) {
  FollowConditions conditions;
  const double without = Follow(conditions, 1).late_mean_error_m;
  conditions.odometry_drift = 0.01;
  EXPECT_GT(Follow(conditions, 1).late_mean_error_m, without + 0.05);
}

TEST(Spread, KnownValues) {
  const Spread spread = SpreadOf({2, 4, 4, 4, 5, 5, 7, 9});
  EXPECT_DOUBLE_EQ(spread.mean, 5);
  EXPECT_NEAR(spread.deviation, std::sqrt(32.0 / 7), 1e-12);
  EXPECT_EQ(spread.least, 2);
  EXPECT_EQ(spread.most, 9);
  EXPECT_EQ(SpreadOf({3}).deviation, 0);
  EXPECT_EQ(SpreadOf({}).mean, 0);
}

}  // namespace
}  // namespace pheromone::swarm
