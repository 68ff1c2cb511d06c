// One query: eq. (4) at any number of antennas. Internal to this folder; use Field or FieldReader
// elsewhere.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "server/core/field/cell_map.h"
#include "server/core/field/diffusion.h"
#include "server/core/field/heading.h"
#include "server/core/field/setup.h"

namespace pheromone::field {

/// The contents of all types; they outlive every query.
struct Layers {
  std::array<std::unique_ptr<CellMap>, kTypes> cells;
  std::array<std::unique_ptr<DiffusionLayer>, kTypes> diffusing;
};

/// The level that an antenna senses of a diffusing node's content (in 1/65 536 quantum, below
/// 2^31), to nearest.
inline uint32_t LevelOfDiffusing(uint32_t content_q16) {
  constexpr uint32_t kHalf = 1u << (15 - kLevelBits);
  return (content_q16 + kHalf) >> (16 - kLevelBits);
}

/// P at each of `antennas`, in 1/4096 of a pheromone unit, for a type that exists and a robot on
/// the map. Reads words that a writer may be changing.
void SenseAt(const Setup& setup, const Layers& layers, const Kernel& kernel, uint8_t type,
             const PoseUm& pose, DirectionQ14 heading, std::span<const PointUm> antennas,
             uint64_t now_ms, std::span<int64_t> intensities);

}  // namespace pheromone::field
