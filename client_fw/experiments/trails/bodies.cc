#include "client_fw/experiments/trails/bodies.h"

#include <cmath>
#include <limits>

namespace pheromone::swarm {
namespace {

double Distance(const sim::PlanePose& a, const sim::PlanePose& b) {
  return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m);
}

// Along the ray from a point to a disc; infinite if it misses, 0 from inside.
double AlongRay(const sim::PlanePose& from, const sim::PlanePose& centre, double radius_m) {
  const double dx = centre.x_m - from.x_m;
  const double dy = centre.y_m - from.y_m;
  const double square = dx * dx + dy * dy - radius_m * radius_m;
  if (square <= 0) {
    return 0;
  }
  const double along = dx * std::cos(from.heading_rad) + dy * std::sin(from.heading_rad);
  const double under_root = along * along - square;
  return along > 0 && under_root >= 0 ? along - std::sqrt(under_root)
                                      : std::numeric_limits<double>::infinity();
}

}  // namespace

Bodies::Bodies(double radius_m) : state_(std::make_shared<State>(State{radius_m, {}})) {}

size_t Bodies::Add(const sim::PlanePose& pose) {
  state_->poses.push_back(pose);
  return state_->poses.size() - 1;
}

void Bodies::Move(size_t body, const sim::PlanePose& pose) {
  state_->poses[body] = pose;
}

sim::RangeFinder Bodies::RangeFrom(size_t self) const {
  return [state = state_, self](const sim::PlanePose& from, double reach_m) {
    double nearest = std::numeric_limits<double>::infinity();
    for (size_t i = 0; i < state->poses.size(); ++i) {
      const sim::PlanePose& other = state->poses[i];
      if (i != self && Distance(from, other) <= reach_m + state->radius_m) {
        nearest = std::min(nearest, AlongRay(from, other, state->radius_m));
      }
    }
    return nearest;
  };
}

sim::Blocked Bodies::BlockedFor(size_t self) const {
  return [state = state_, self](const sim::PlanePose& pose) {
    for (size_t i = 0; i < state->poses.size(); ++i) {
      const double distance = Distance(pose, state->poses[i]);
      if (i != self && distance < 2 * state->radius_m &&
          distance < Distance(state->poses[self], state->poses[i])) {
        return true;
      }
    }
    return false;
  };
}

Bodies::Pair Bodies::Nearest() const {
  Pair nearest;
  nearest.gap_m = std::numeric_limits<double>::infinity();
  for (size_t a = 0; a < state_->poses.size(); ++a) {
    for (size_t b = a + 1; b < state_->poses.size(); ++b) {
      const double gap_m = Distance(state_->poses[a], state_->poses[b]) - 2 * state_->radius_m;
      if (gap_m < nearest.gap_m) {
        nearest = {a, b, gap_m};
      }
    }
  }
  return nearest;
}

}  // namespace pheromone::swarm
