// Which places robots have been at, and how long ago: a raster of the map.
//
//   Coverage coverage(field_config, /*cell_um=*/1'000'000);
//   coverage.Visit(x_m, y_m, step);           // any number of threads
//   coverage.At(step).covered;                // the share of places that were visited
//
// A place is a square of the raster in which not every node is an obstacle. The idleness of a place
// is the time since a robot was there, or since the start (Chevaleyre 2004); its mean is over
// places and time. In whole steps, so that it depends on no order of the visits.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/core/field/config.h"

namespace pheromone::lab {

class Coverage {
 public:
  Coverage(const field::FieldConfig& field, int64_t cell_um);

  /// A robot is there at the end of `step`, counted from 1. Steps do not decrease.
  void Visit(double x_m, double y_m, uint64_t step) {
    const size_t place = PlaceOf(x_m, y_m);
    std::atomic_ref<uint32_t> last(last_step_[place]);
    const auto now = static_cast<uint32_t>(step);
    if (last.load(std::memory_order_relaxed) == now) {
      return;
    }
    const uint64_t gap = now - last.exchange(now, std::memory_order_relaxed);
    if (gap > 1 && is_place_[place] != 0) {
      gap_squares_.fetch_add(gap * gap, std::memory_order_relaxed);
    }
  }

  struct Share {
    double covered = 0;            ///< of the places
    double mean_idle_steps = 0;    ///< over places and time
    uint64_t most_idle_steps = 0;  ///< of a place, now
  };
  /// After `steps` steps.
  Share At(uint64_t steps) const;

 private:
  size_t PlaceOf(double x_m, double y_m) const {
    const auto column = static_cast<size_t>((x_m - left_m_) * per_m_);
    const auto row = static_cast<size_t>((y_m - bottom_m_) * per_m_);
    return row * columns_ + column;
  }

  double left_m_;
  double bottom_m_;
  double per_m_;
  size_t columns_;
  std::vector<uint8_t> is_place_;
  std::vector<uint32_t> last_step_;
  std::atomic<uint64_t> gap_squares_{0};
};

}  // namespace pheromone::lab
