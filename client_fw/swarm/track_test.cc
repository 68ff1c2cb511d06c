#include "client_fw/swarm/track.h"

#include <gtest/gtest.h>

namespace pheromone::swarm {
namespace {

Sample At(int64_t time_ms, double distance_m, double along_m) {
  Sample sample;
  sample.time_ms = time_ms;
  sample.distance_m = distance_m;
  sample.along_m = along_m;
  return sample;
}

TEST(MeanDistance, CountsFromTheGivenTime) {
  const std::vector<Sample> track = {At(0, 0.3, 0), At(200, 0.1, 0), At(400, 0.2, 0)};
  EXPECT_DOUBLE_EQ(MeanDistance(track, 0), 0.2);
  EXPECT_DOUBLE_EQ(MeanDistance(track, 200), 0.15);
  EXPECT_DOUBLE_EQ(MeanDistance(track, 401), 0);
}

TEST(Progress, IsTheDifferenceOnAnOpenPath) {
  field::Path path;
  path.points = {{0, 0}, {5'000'000, 0}};
  EXPECT_DOUBLE_EQ(Progress({At(0, 0, 0.5), At(1, 0, 0.4), At(2, 0, 2.0)}, path), 1.5);
}

TEST(Progress, GoesOnOverTheSeamOfAClosedPath) {
  field::Path path;
  path.closed = true;
  path.points = {{0, 0}, {1'000'000, 0}, {1'000'000, 1'000'000}, {0, 1'000'000}};
  const std::vector<Sample> forward = {At(0, 0, 3.5), At(1, 0, 0.5), At(2, 0, 2), At(3, 0, 3.75),
                                       At(4, 0, 0.25)};
  EXPECT_DOUBLE_EQ(Progress(forward, path), 4.75);
  EXPECT_DOUBLE_EQ(Progress({At(0, 0, 0.5), At(1, 0, 3.5)}, path), -1.0);
}

TEST(ToCsv, HasAHeaderAndFixedDigits) {
  Sample sample = At(1200, 0.0123, 0);
  sample.pose = {1.5, -2.25, 0};
  sample.p_left = 2048;
  sample.p_right = -4096;
  sample.wheels = {300, -20};
  EXPECT_EQ(ToCsv(std::vector<Sample>{sample}),
            "time_s,x_m,y_m,heading_deg,p_left,p_right,wheel_left_mm_s,wheel_right_mm_s,"
            "distance_from_path_mm\n"
            "1.200,1.5000,-2.2500,0.00,0.5000,-1.0000,300,-20,12.3\n");
}

}  // namespace
}  // namespace pheromone::swarm
