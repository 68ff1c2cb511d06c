// What is recorded of a robot on its way, and how it becomes a table.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client_fw/sim/mobile_robot.h"
#include "server/core/field/path.h"

namespace pheromone::swarm {

/// One moment. Poses are the true ones, not what odometry believes.
struct Sample {
  int64_t time_ms = 0;
  sim::PlanePose pose;
  int16_t p_left = 0;  ///< 1/4096 of a pheromone unit, as last received
  int16_t p_right = 0;
  client::WheelSpeeds wheels{0, 0};  ///< as last commanded (MobileRobot::wheels)
  double distance_m = 0;             ///< from the path
  double along_m = 0;                ///< of the nearest point of the path, from its beginning
};

Sample Observe(const sim::MobileRobot& robot, const field::Path& path, int64_t time_ms);

/// A header line, then a line a sample, numbers with fixed digits.
std::string ToCsv(const std::vector<Sample>& track);

/// The mean distance from the path, in metres, of the samples from `from_ms` on; 0 without any.
double MeanDistance(const std::vector<Sample>& track, int64_t from_ms);

/// How far the robot came along the path, in metres, from the first sample to the last; on a closed
/// path all the way round counts.
double Progress(const std::vector<Sample>& track, const field::Path& path);

}  // namespace pheromone::swarm
