// Times, and what share of them was how short.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <string>
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

  /// "p50 0.05 ms, p99 0.21 ms, p99.9 0.90 ms of 3000"
  std::string Text() {
    const auto ms = [this](double q) {
      return std::chrono::duration<double, std::milli>(At(q)).count();
    };
    return fmt::format("p50 {:7.3f} ms, p99 {:7.3f} ms, p99.9 {:7.3f} ms of {}", ms(0.5), ms(0.99),
                       ms(0.999), size());
  }

 private:
  std::vector<std::chrono::nanoseconds> times_;
};

}  // namespace pheromone::bench
