// The oracle of the field: the paper's formulas recomputed naively. A dense array of all N^2 nodes,
// scanned whole for each antenna; evaporation counted down step by step; the Z-shape rounded by
// comparing integers, without any floating point; trigonometry from libm. It shares no arithmetic
// with the code under test.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <numbers>
#include <vector>

#include "server/field/field.h"

namespace pheromone::field::testing {

__extension__ using Wide = __int128;

class NaiveField {
 public:
  explicit NaiveField(const FieldConfig& config) : config_(config) {
    for (const PheromoneLaw& law : config.pheromones) {
      layers_[law.type].resize(static_cast<size_t>(columns()) * static_cast<size_t>(rows()));
    }
  }

  void Deposit(uint8_t type, PointUm point, int quanta, uint64_t now_ms) {
    const int64_t column = Nearest(point.x - config_.map.origin.x, columns());
    const int64_t row = Nearest(point.y - config_.map.origin.y, rows());
    Node& node = layers_[type][static_cast<size_t>(row * columns() + column)];
    const PheromoneLaw& law = LawOf(type);
    node.count = std::min<int64_t>(law.max_count, CountDown(law, node, now_ms) + quanta);
    node.time_ms = now_ms;
  }

  Intensities Sense(uint8_t type, const PoseUm& pose, uint64_t now_ms) const {
    const long double angle = 2 * std::numbers::pi_v<long double> * pose.heading / 65536;
    const int64_t cos_q14 = std::llround(16384 * std::cos(angle));
    const int64_t sin_q14 = std::llround(16384 * std::sin(angle));
    const long double half = static_cast<long double>(config_.antenna_distance_um) / 2;
    const int64_t across_x = std::llround(-half * static_cast<long double>(sin_q14) / 16384);
    const int64_t across_y = std::llround(half * static_cast<long double>(cos_q14) / 16384);
    const PointUm p = pose.position;
    return {Intensity(type, p, cos_q14, sin_q14, {p.x + across_x, p.y + across_y}, now_ms),
            Intensity(type, p, cos_q14, sin_q14, {p.x - across_x, p.y - across_y}, now_ms)};
  }

  /// The exact floor(65 536 * mu(d) + 1/2) of eq. (1) at distance sqrt(d2): the largest m with
  /// m - 1/2 <= 65 536 (R - d) / sigma, that is (131 072 d)^2 <= (131 072 R - (2 m - 1) sigma)^2.
  static int64_t ExactSpread(const PheromoneLaw& law, int64_t d2) {
    const Wide core = law.core_um;
    const Wide reach = core + law.sigma_um;
    if (d2 <= core * core) {
      return 65536;
    }
    if (d2 > reach * reach) {
      return 0;
    }
    int64_t low = 0;  // holds
    int64_t high = 65536;
    while (low < high) {
      const int64_t m = (low + high + 1) / 2;
      const Wide bound = 131072 * reach - (2 * Wide{m} - 1) * law.sigma_um;
      const bool holds = bound >= 0 && Wide{131072} * 131072 * d2 <= bound * bound;
      (holds ? low : high) = holds ? m : m - 1;
    }
    return low;
  }

 private:
  struct Node {
    int64_t count = 0;
    uint64_t time_ms = 0;
  };

  int64_t columns() const { return config_.map.width_um / config_.map.cell_um + 1; }
  int64_t rows() const { return config_.map.height_um / config_.map.cell_um + 1; }

  const PheromoneLaw& LawOf(uint8_t type) const {
    for (const PheromoneLaw& law : config_.pheromones) {
      if (law.type == type) {
        return law;
      }
    }
    std::abort();
  }

  // The nearest of `count` nodes by trying them all, a later one winning a tie.
  int64_t Nearest(int64_t offset_um, int64_t count) const {
    int64_t best = 0;
    for (int64_t i = 1; i < count; ++i) {
      if (std::abs(offset_um - i * config_.map.cell_um) <=
          std::abs(offset_um - best * config_.map.cell_um)) {
        best = i;
      }
    }
    return best;
  }

  static int64_t CountDown(const PheromoneLaw& law, const Node& node, uint64_t now_ms) {
    int64_t count = node.count;
    if (law.tau_ms > 0) {
      const auto tau = static_cast<uint64_t>(law.tau_ms);
      for (uint64_t t = node.time_ms + tau; t <= now_ms && count > 0; t += tau) {
        --count;
      }
    }
    return count;
  }

  int64_t Intensity(uint8_t type, PointUm robot, int64_t cos_q14, int64_t sin_q14, PointUm antenna,
                    uint64_t now_ms) const {
    const PheromoneLaw& law = LawOf(type);
    const std::vector<Node>& nodes = layers_.at(type);
    Wide sum = 0;
    for (int64_t row = 0; row < rows(); ++row) {
      for (int64_t column = 0; column < columns(); ++column) {
        const Node& node = nodes[static_cast<size_t>(row * columns() + column)];
        const int64_t x = config_.map.origin.x + column * config_.map.cell_um;
        const int64_t y = config_.map.origin.y + row * config_.map.cell_um;
        if (law.directional && (x - robot.x) * cos_q14 + (y - robot.y) * sin_q14 < 0) {
          continue;
        }
        const int64_t d2 = (x - antenna.x) * (x - antenna.x) + (y - antenna.y) * (y - antenna.y);
        sum += Wide{CountDown(law, node, now_ms)} * ExactSpread(law, d2);
      }
    }
    // round(4096 * Q * sum / 65 536), Q in millionths
    const Wide numerator = 4096 * Wide{law.quantum_micro} * sum;
    const Wide denominator = Wide{65536} * 1'000'000;
    return static_cast<int64_t>((2 * numerator + denominator) / (2 * denominator));
  }

  FieldConfig config_;
  std::map<uint8_t, std::vector<Node>> layers_;
};

}  // namespace pheromone::field::testing
