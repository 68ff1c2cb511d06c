// The paper's algorithm, read off eq. (1)-(5) line by line. This file is compiled without
// vectorisation: one node after the other, as on the computers of the time.

#include <algorithm>
#include <cmath>

#include "server/core/field/bench/baselines.h"
#include "server/core/field/heading.h"

namespace pheromone::field::bench {

LiteralMap::LiteralMap(const MapGeometry& map, int64_t antenna_distance_um, const PheromoneLaw& law)
    : map_(map), antenna_distance_um_(antenna_distance_um), law_(law) {
  const size_t nodes = static_cast<size_t>(map.columns()) * static_cast<size_t>(map.rows());
  count_.resize(nodes);
  time_ms_.resize(nodes);
}

void LiteralMap::Deposit(PointUm point, uint16_t quanta, uint64_t now_ms) {
  const NodeIndex at = map_.NearestNode(point);
  const auto node = static_cast<size_t>(at.row) * static_cast<size_t>(map_.columns()) +
                    static_cast<size_t>(at.column);
  const auto count = static_cast<int32_t>(Count(node, static_cast<double>(now_ms)));
  count_[node] = std::min<int32_t>(count + quanta, law_.max_count);  // eq. (2)
  time_ms_[node] = static_cast<uint32_t>(now_ms);
}

// Eq. (3), as read at a node between deposits.
double LiteralMap::Count(size_t node, double now_ms) const {
  if (law_.tau_ms == 0) {
    return count_[node];
  }
  const double gone = std::floor((now_ms - time_ms_[node]) / static_cast<double>(law_.tau_ms));
  return std::max(0.0, count_[node] - gone);
}

// Eq. (1).
double LiteralMap::Spread(double distance_um) const {
  const auto core = static_cast<double>(law_.core_um);
  const auto sigma = static_cast<double>(law_.sigma_um);
  if (distance_um <= core) {
    return 1;
  }
  if (distance_um <= core + sigma) {
    return 1 - (distance_um - core) / sigma;
  }
  return 0;
}

// Eq. (4).
double LiteralMap::IntensityAt(double x, double y, const PoseUm& pose, double now_ms) const {
  const DirectionQ14 heading = DirectionOf(pose.heading);
  const double cos = heading.cos / 16384.0;
  const double sin = heading.sin / 16384.0;
  const auto centre_x = static_cast<double>(pose.position.x);
  const auto centre_y = static_cast<double>(pose.position.y);
  double intensity = 0;
  size_t node = 0;
  for (int32_t row = 0; row < map_.rows(); ++row) {
    const auto node_y = static_cast<double>(map_.origin.y + row * map_.cell_um);
    for (int32_t column = 0; column < map_.columns(); ++column, ++node) {
      const auto node_x = static_cast<double>(map_.origin.x + column * map_.cell_um);
      if (law_.directional && (node_x - centre_x) * cos + (node_y - centre_y) * sin < 0) {
        continue;  // in the invisible area of fig. 7
      }
      const double dx = node_x - x;
      const double dy = node_y - y;
      intensity += Count(node, now_ms) * Spread(std::sqrt(dx * dx + dy * dy));
    }
  }
  return intensity * static_cast<double>(law_.quantum_micro) / 1e6;
}

Smell LiteralMap::Sense(const PoseUm& pose, uint64_t now_ms) const {
  const AntennaPair antennas = AntennaPairOf(pose, antenna_distance_um_);
  const auto now = static_cast<double>(now_ms);
  return {IntensityAt(antennas.left_x, antennas.left_y, pose, now),
          IntensityAt(antennas.right_x, antennas.right_y, pose, now)};
}

}  // namespace pheromone::field::bench
