// Times and their quantiles.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <vector>

namespace pheromone::bench {

class Quantiles {
 public:
  void Add(std::chrono::nanoseconds time) { times_.push_back(time); }
  size_t size() const { return times_.size(); }

  /// The time that a share `q` of all does not exceed, by rank; 0 if there are none.
  std::chrono::nanoseconds At(double q) {
    if (times_.empty()) {
      return {};
    }
    const auto rank = static_cast<size_t>(q * static_cast<double>(times_.size()));
    const auto place = times_.begin() + static_cast<std::ptrdiff_t>(std::min(rank, size() - 1));
    std::nth_element(times_.begin(), place, times_.end());
    return *place;
  }

 private:
  std::vector<std::chrono::nanoseconds> times_;
};

}  // namespace pheromone::bench
