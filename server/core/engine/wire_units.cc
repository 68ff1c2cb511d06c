#include "server/core/engine/wire_units.h"

#include <algorithm>
#include <cstdlib>

namespace pheromone::engine {
namespace {

__extension__ using Int128 = __int128;

constexpr int64_t kLargest = 32767;

int16_t Scaled(int64_t p, int64_t max) {
  const auto magnitude = static_cast<int16_t>(static_cast<Int128>(std::abs(p)) * kLargest / max);
  return static_cast<int16_t>(p < 0 ? -magnitude : magnitude);
}

}  // namespace

std::optional<int64_t> NotAddressable(const field::MapGeometry& map, uint16_t pose_unit_10um,
                                      bool wide) {
  const int64_t reach_um = ToMicrometres(wide ? INT32_MAX : INT16_MAX, pose_unit_10um);
  for (const int64_t edge :
       {map.origin.x, map.origin.x + map.width_um, map.origin.y, map.origin.y + map.height_um}) {
    if (edge < -reach_um || edge > reach_um) {
      return edge;
    }
  }
  return std::nullopt;
}

field::PoseUm ToField(const protocol::WirePose& pose, uint16_t pose_unit_10um) {
  return {{ToMicrometres(pose.x, pose_unit_10um), ToMicrometres(pose.y, pose_unit_10um)},
          pose.heading};
}

WireIntensities ToWire(const field::Intensities& p) {
  const int64_t max = std::max(std::abs(p.left), std::abs(p.right));
  if (max <= kLargest) {
    return {static_cast<int16_t>(p.left), static_cast<int16_t>(p.right)};
  }
  return {Scaled(p.left, max), Scaled(p.right, max)};
}

}  // namespace pheromone::engine
