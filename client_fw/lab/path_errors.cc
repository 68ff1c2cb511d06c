#include "client_fw/lab/path_errors.h"

#include <cmath>

namespace pheromone::lab {
namespace {

constexpr uint64_t kBetweenLooksMs = 1000;

}  // namespace

PathWatch::PathWatch(const std::vector<field::Path>& paths, const Robots& robots)
    : paths_(paths), path_of_(paths.empty() ? 0 : robots.count) {
  for (size_t i = 0; i < path_of_.size(); ++i) {
    path_of_[i] =
        static_cast<uint32_t>(field::NearestPath(paths_, robots.x_m[i] * 1e6, robots.y_m[i] * 1e6));
  }
}

PathErrors PathWatch::Look(const StepTime& time, const Slice& slice, const Robots& robots) const {
  PathErrors errors;
  const uint64_t next_ms = time.now_ms() + time.step_ms;
  if (paths_.empty() || next_ms / kBetweenLooksMs == time.now_ms() / kBetweenLooksMs) {
    return errors;
  }
  for (size_t i = slice.first; i < slice.end(); ++i) {
    const field::PathPosition at =
        field::Locate(paths_[path_of_[i]], robots.x_m[i] * 1e6, robots.y_m[i] * 1e6);
    errors.sum_um += static_cast<uint64_t>(std::llround(at.distance_um));
    ++errors.samples;
  }
  return errors;
}

}  // namespace pheromone::lab
