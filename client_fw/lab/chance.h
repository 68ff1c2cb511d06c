// Chance in a world: PheromoneHash of seed, robot, step and what it is for (behaviour_abi.h).
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

#include "client_fw/lab/behaviour_abi.h"

namespace pheromone::lab {

/// What the world itself draws for; behaviours have numbers of their own, below.
enum Use : uint64_t {
  kRightOfWay = 1000,
  kLeftBias,
  kLeftNoise,
  kLeftSlip,
  kRightBias,
  kRightNoise,
  kRightSlip,
  kFixX,
  kFixY,
  kStartX,
  kStartY,
  kStartHeading,
  kFailure,
  kLinkGap,
  kLinkAge,
  kLinkPhase,
};

/// Normal with mean 0 and deviation 1 (Box and Muller 1958), of two draws: `use`, and the same
/// with its highest bit set.
inline double PheromoneNormal(uint64_t seed, uint64_t robot, uint64_t step, uint64_t use) {
  constexpr uint64_t kOther = uint64_t{1} << 63;
  const double radius = std::sqrt(-2 * std::log(1 - PheromoneUniform(seed, robot, step, use)));
  return radius *
         std::cos(2 * std::numbers::pi * PheromoneUniform(seed, robot, step, use | kOther));
}

}  // namespace pheromone::lab
