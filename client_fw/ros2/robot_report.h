// What the thread of the robots tells the thread that publishes maps and states.
#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "client_fw/ros2/ros_robot.h"

namespace pheromone::ros2 {

enum class Health : uint8_t { kOk, kWarning, kError };  ///< as levels of diagnostics

struct RobotReport {
  std::string name_space;
  uint8_t id = 0;
  Health health = Health::kOk;
  std::string state;                  ///< "drives", "stands: halted, until ..."
  std::optional<PlanePose> odometry;  ///< while it is fresh
  std::string odometry_frame;         ///< such as "tb1/odom"
  unsigned requests = 0;
  unsigned answers = 0;
};

/// Any thread.
class RobotReports {
 public:
  void Set(std::vector<RobotReport> reports) {
    const std::lock_guard lock(mutex_);
    reports_ = std::move(reports);
  }
  std::vector<RobotReport> Get() const {
    const std::lock_guard lock(mutex_);
    return reports_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<RobotReport> reports_;
};

}  // namespace pheromone::ros2
