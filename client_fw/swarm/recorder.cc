#include "client_fw/swarm/recorder.h"

#include <cmath>
#include <utility>

namespace pheromone::swarm {
namespace {

bool OffLimits(const field::FieldConfig& field, const sim::PlanePose& pose) {
  const field::PointUm at{std::llround(pose.x_m * 1e6), std::llround(pose.y_m * 1e6)};
  return !field.map.Contains(at) ||
         (field.obstacles && field.obstacles->Blocked(field.map.NearestNode(at)));
}

field::Path PathOf(const field::FieldConfig& field, const sim::MobileRobot& robot) {
  if (field.paths.empty()) {
    return {.points = {{0, 0}}};
  }
  const sim::PlanePose& pose = robot.true_pose();
  return field.paths[field::NearestPath(field.paths, pose.x_m * 1e6, pose.y_m * 1e6)];
}

}  // namespace

Recorder::Recorder(const Swarm* swarm, const field::FieldConfig& field, int64_t sample_ms)
    : swarm_(swarm), field_(field), sample_ms_(sample_ms) {
  record_.robots.resize(swarm->robot_count());
  for (size_t i = 0; i < swarm->robot_count(); ++i) {
    paths_.push_back(PathOf(field_, swarm->robot(i)));
  }
}

bool Recorder::Look() {
  NoteExchanges();
  const bool sample = swarm_->now_ms() % sample_ms_ == 0;
  if (sample) {
    Sample();
  }
  return sample;
}

void Recorder::NoteExchanges() {
  for (size_t i = 0; i < swarm_->robot_count(); ++i) {
    const sim::MobileRobot& robot = swarm_->robot(i);
    client::Counters& before = record_.robots[i].counters;  // at the last answer
    if (robot.counters().answers != before.answers) {
      record_.exchanges.push_back({swarm_->now_ms(), i, robot.counters().requests - before.requests,
                                   robot.p_left(), robot.p_right()});
      before = robot.counters();
    }
  }
}

void Recorder::Sample() {
  for (size_t i = 0; i < swarm_->robot_count(); ++i) {
    RobotRecord& robot = record_.robots[i];
    robot.track.push_back(Observe(swarm_->robot(i), paths_[i], swarm_->now_ms()));
    robot.off_limits_samples += OffLimits(field_, robot.track.back().pose) ? 1 : 0;
  }
}

SwarmRecord Recorder::Finish() {
  record_.duration_ms = swarm_->now_ms();
  for (size_t i = 0; i < swarm_->robot_count(); ++i) {
    RobotRecord& robot = record_.robots[i];
    robot.counters = swarm_->robot(i).counters();
    robot.bumps = swarm_->robot(i).bumps();
    if (!field_.paths.empty()) {
      robot.progress_m = Progress(robot.track, paths_[i]);
      robot.mean_error_m = MeanDistance(robot.track, 0);
    }
  }
  for (size_t i = 0; i < swarm_->channel_count(); ++i) {
    const sim::RadioMedium& medium = swarm_->medium(i);
    record_.channels.push_back({medium.counters(), medium.Utilisation(), {}, {}});
  }
  return std::move(record_);
}

}  // namespace pheromone::swarm
