// How far robots are from the paths that they follow: once a second, from the path of the map that
// each was nearest to when it started.
//
//   PathWatch watch(field.paths, robots);               // where they start
//   PathErrors errors = watch.Look(time, slice, robots);   // at the end of the step
//   errors.mean_m();
//
// Sums are whole micrometres, so that their order does not matter.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "client_fw/lab/phases.h"
#include "server/core/field/path.h"

namespace pheromone::lab {

struct PathErrors {
  uint64_t sum_um = 0;
  uint64_t samples = 0;

  double mean_m() const {
    return samples == 0 ? 0 : static_cast<double>(sum_um) / 1e6 / static_cast<double>(samples);
  }
  PathErrors& operator+=(const PathErrors& other) {
    sum_um += other.sum_um;
    samples += other.samples;
    return *this;
  }
};

class PathWatch {
 public:
  PathWatch() = default;
  PathWatch(const std::vector<field::Path>& paths, const Robots& robots);

  /// Of a slice in the step that ends; nothing unless a second ends with it, or without paths.
  PathErrors Look(const StepTime& time, const Slice& slice, const Robots& robots) const;

 private:
  std::vector<field::Path> paths_;
  std::vector<uint32_t> path_of_;  // a robot
};

}  // namespace pheromone::lab
