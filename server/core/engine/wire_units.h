// Converts between the units of the wire and those of the field.
#pragma once

#include <cstdint>
#include <optional>

#include "protocol/messages.h"
#include "server/core/field/field.h"

namespace pheromone::engine {

/// A coordinate in pose units (of `pose_unit_10um` times 10 um) in micrometres.
inline int64_t ToMicrometres(int32_t coordinate, uint16_t pose_unit_10um) {
  return int64_t{coordinate} * pose_unit_10um * 10;
}

/// The first edge of the map, in micrometres, that messages cannot represent, since it is more than
/// 32 767 pose units from (0, 0), or 2 147 483 647 of the wide messages.
std::optional<int64_t> NotAddressable(const field::MapGeometry& map, uint16_t pose_unit_10um,
                                      bool wide);
inline bool NeedsWide(const field::MapGeometry& map, uint16_t pose_unit_10um) {
  return NotAddressable(map, pose_unit_10um, false).has_value();
}

field::PoseUm ToField(const protocol::WirePose& pose, uint16_t pose_unit_10um);

/// P_L and P_R as a message carries them.
struct WireIntensities {
  int16_t left = 0;
  int16_t right = 0;
};

/// If the larger of |P_L|, |P_R| exceeds 32 767, both become floor(|P| * 32 767 / max) with their
/// sign, so that their ratio, by which robots steer, survives.
WireIntensities ToWire(const field::Intensities& p);

}  // namespace pheromone::engine
