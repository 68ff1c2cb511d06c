#include "client_fw/swarm/path_experiment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "client_fw/swarm/picture.h"

namespace pheromone::swarm {
namespace {

PathSummary RunSeeds(PathExperiment experiment, int seeds) {
  std::vector<PathRun> runs;
  for (int seed = 1; seed <= seeds; ++seed) {
    runs.push_back(FollowPath(experiment, static_cast<uint64_t>(seed)));
  }
  return Summarise(experiment, runs);
}

TEST(PathExperiment, BeginsWhereThePaperSays) {
  for (const Shape shape : {Shape::kLine, Shape::kCircle, Shape::kSCurve}) {
    for (uint64_t seed = 1; seed <= 4; ++seed) {
      const PathRun run = FollowPath({.shape = shape, .duration_ms = 200}, seed);
      EXPECT_NEAR(run.track.front().distance_m, 0.2, 0.003);
    }
  }
}

TEST(PathExperiment, RecordsEveryFifthOfASecondForTenSeconds) {
  const PathRun run = FollowPath({}, 1);
  ASSERT_EQ(run.track.size(), 51u);
  EXPECT_EQ(run.track.back().time_ms, 10'000);
}

// The figures that the project promises for the default law: mean of 20 seeds on each path.
class FollowsThePath : public ::testing::TestWithParam<Shape> {};

TEST_P(FollowsThePath, WithTheDifferentialLaw) {
  const PathSummary summary = RunSeeds({.shape = GetParam()}, 20);
  EXPECT_LE(summary.mean_error_m, 0.100);
  EXPECT_LE(summary.late_mean_error_m, 0.050);
  EXPECT_GE(summary.progress, 0.70);
  EXPECT_EQ(summary.fail_safe_stops, 0u);
}

INSTANTIATE_TEST_SUITE_P(EachShape, FollowsThePath,
                         ::testing::Values(Shape::kLine, Shape::kCircle, Shape::kSCurve));

TEST(PathExperiment, ARepeatedRunIsTheSameToTheBit) {
  for (const client::Law law : {client::Law::kDifferential, client::Law::kPaper}) {
    const PathExperiment experiment{
        .shape = Shape::kSCurve, .law = law, .lay_trail = true, .frame_loss = 0.05};
    const PathRun first = FollowPath(experiment, 7);
    const PathRun second = FollowPath(experiment, 7);
    const field::Field field(EngineConfigOf(experiment).field);
    const auto draw = [&](const PathRun& run) {
      return DrawPathPicture("t", field, PathOf(experiment.shape), {{"l", "#000", run.track}}, 0);
    };
    EXPECT_EQ(ToCsv(first.track), ToCsv(second.track));
    EXPECT_EQ(draw(first), draw(second));
    EXPECT_EQ(first.state_hash, second.state_hash);
    const PathRun other = FollowPath(experiment, 8);
    EXPECT_NE(ToCsv(other.track), ToCsv(first.track));
    EXPECT_NE(other.state_hash, first.state_hash);
  }
}

// What is default in a robot, on the path that is default in the server, at twice the speed.
PathExperiment Fast() {
  PathExperiment experiment;
  experiment.shape = Shape::kCircuit;
  experiment.law = client::Settings().law;
  experiment.speed_mm_s = 600;
  experiment.pioneer = sim::FindPioneerModel("p3dx-sh");
  experiment.duration_ms = 60'000;
  experiment.sample_ms = 100;
  return experiment;
}

bool OnTheMap(const std::vector<Sample>& track) {
  return std::all_of(track.begin(), track.end(), [](const Sample& sample) {
    return sample.pose.x_m > 0 && sample.pose.x_m < 10 && sample.pose.y_m > 0 &&
           sample.pose.y_m < 10;
  });
}

// Two turns of 22 m, or nearly.
TEST(PathExperiment, APioneerHoldsTheDefaultCircuitAt600MmS) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    const PathRun run = FollowPath(Fast(), seed);
    EXPECT_LE(MeanDistance(run.track, 5'000), 0.060) << seed;
    EXPECT_GE(run.progress, 0.5) << seed;
    PathExperiment plain = Fast();
    plain.law = client::Law::kDifferential;
    EXPECT_GT(MeanDistance(FollowPath(plain, seed).track, 5'000), 0.100)
        << seed << ": the law need not slow down";
  }
}

// At any point of the circuit: in bends, and where it is fast.
TEST(PathExperiment, WhereTheTrailIsTakenAwayAPioneerStandsWithinAMetre) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    PathExperiment experiment = Fast();
    experiment.erase_ms = 10'000 + 1'300 * static_cast<int64_t>(seed);
    experiment.duration_ms = experiment.erase_ms + 12'000;
    const PathRun run = FollowPath(experiment, seed);
    EXPECT_LE(run.on_its_own_m, 1.0) << seed;
    EXPECT_TRUE(OnTheMap(run.track)) << seed;
    const Sample& last = run.track.back();
    const Sample& before = run.track[run.track.size() - 31];
    EXPECT_EQ(before.pose.x_m, last.pose.x_m) << seed;
    EXPECT_EQ(before.pose.y_m, last.pose.y_m) << seed;
    EXPECT_EQ(before.pose.heading_rad, last.pose.heading_rad) << seed;
    EXPECT_EQ(1u, run.counters.events) << seed;
  }
}

TEST(PathExperiment, StaysOnACircleForTenMinutes) {
  const PathRun run = FollowPath({.shape = Shape::kCircle, .duration_ms = 600'000}, 3);
  EXPECT_LE(run.late_mean_error_m, 0.050);
  EXPECT_GE(run.progress, 0.70);
}

}  // namespace
}  // namespace pheromone::swarm
