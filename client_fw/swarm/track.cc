#include "client_fw/swarm/track.h"

#include <fmt/format.h>

#include <numbers>

namespace pheromone::swarm {

Sample Observe(const sim::MobileRobot& robot, const field::Path& path, int64_t time_ms) {
  const sim::PlanePose& pose = robot.true_pose();
  const field::PathPosition position = field::Locate(path, pose.x_m * 1e6, pose.y_m * 1e6);
  return {time_ms,
          pose,
          robot.p_left(),
          robot.p_right(),
          robot.wheels(),
          position.distance_um / 1e6,
          position.along_um / 1e6};
}

std::string ToCsv(const std::vector<Sample>& track) {
  std::string csv =
      "time_s,x_m,y_m,heading_deg,p_left,p_right,wheel_left_mm_s,wheel_right_mm_s,"
      "distance_from_path_mm\n";
  for (const Sample& s : track) {
    csv += fmt::format("{:.3f},{:.4f},{:.4f},{:.2f},{:.4f},{:.4f},{},{},{:.1f}\n",
                       static_cast<double>(s.time_ms) / 1000, s.pose.x_m, s.pose.y_m,
                       s.pose.heading_rad * 180 / std::numbers::pi, s.p_left / 4096.0,
                       s.p_right / 4096.0, s.wheels.left_mm_s, s.wheels.right_mm_s,
                       s.distance_m * 1000);
  }
  return csv;
}

double MeanDistance(const std::vector<Sample>& track, int64_t from_ms) {
  double sum = 0;
  int count = 0;
  for (const Sample& s : track) {
    if (s.time_ms >= from_ms) {
      sum += s.distance_m;
      ++count;
    }
  }
  return count == 0 ? 0 : sum / count;
}

double Progress(const std::vector<Sample>& track, const field::Path& path) {
  const double length = field::LengthOf(path) / 1e6;
  double progress = 0;
  for (size_t i = 1; i < track.size(); ++i) {
    double step = track[i].along_m - track[i - 1].along_m;
    if (path.closed && step > length / 2) {
      step -= length;
    } else if (path.closed && step < -length / 2) {
      step += length;
    }
    progress += step;
  }
  return progress;
}

}  // namespace pheromone::swarm
