#include "client_fw/experiments/laws/law_robot.h"

#include <gtest/gtest.h>

#include "client_fw/experiments/laws/follow.h"
#include "client_fw/swarm/path_experiment.h"

namespace pheromone::swarm {
namespace {

// The path experiment runs the firmware as it is, its own law included. Its start is computed in
// another order, so that it may differ in the last bit.
TEST(LawRobot, DrivesAsTheFirmwareDoes) {
  for (const client::Law law :
       {client::Law::kDifferential, client::Law::kPaper, client::Law::kFuzzy}) {
    for (uint64_t seed = 1; seed <= 3; ++seed) {
      const PathRun firmware = FollowPath({.shape = Shape::kCircle, .law = law}, seed);
      FollowConditions conditions;
      conditions.curve = Curve::kCircle;
      conditions.steering.law = law;
      conditions.duration_ms = 10'000;
      const FollowResult chosen = Follow(conditions, seed);
      for (const Sample& sample : firmware.track) {
        const Sample& other = chosen.track[static_cast<size_t>(sample.time_ms / 100)];
        ASSERT_EQ(other.time_ms, sample.time_ms);
        ASSERT_NEAR(other.pose.x_m, sample.pose.x_m, 1e-9) << sample.time_ms;
        ASSERT_NEAR(other.pose.y_m, sample.pose.y_m, 1e-9) << sample.time_ms;
        ASSERT_NEAR(other.pose.heading_rad, sample.pose.heading_rad, 1e-9) << sample.time_ms;
      }
    }
  }
}

TEST(LawRobot, StandsStillWhileTheFirmwareWould) {
  FollowConditions conditions;
  conditions.frame_loss = 1;
  const FollowResult result = Follow(conditions, 1);
  EXPECT_EQ(result.track.front().pose.x_m, result.track.back().pose.x_m);
  EXPECT_EQ(result.track.front().pose.heading_rad, result.track.back().pose.heading_rad);
}

TEST(LawRobot, AHigherGainTurnsMoreSharply) {
  FollowConditions conditions;
  conditions.curve = Curve::kCircle;
  conditions.duration_ms = 40'000;
  const FollowResult gentle = Follow(conditions, 1);
  conditions.steering.gain_8 = 2 * client::kUnitGain;
  const FollowResult sharp = Follow(conditions, 1);
  EXPECT_LT(sharp.late_mean_error_m, gentle.late_mean_error_m);
}

}  // namespace
}  // namespace pheromone::swarm
