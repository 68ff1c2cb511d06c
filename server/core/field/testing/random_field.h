// Random maps, laws and places for the property tests, from a seed; and how to tell whether a
// case was of use as evidence.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <vector>

#include "server/base/hash.h"
#include "server/core/field/field.h"

namespace pheromone::field::testing {

using Random = std::mt19937_64;

inline int64_t Between(Random& random, int64_t low, int64_t high) {
  return low + static_cast<int64_t>(random() % static_cast<uint64_t>(high - low + 1));
}

inline bool OneIn(Random& random, int64_t n) {
  return Between(random, 1, n) == 1;
}

/// Which laws a test is about. The exact ones are defined by whole numbers alone; the others go
/// through an exponential, where the oracle may differ by a rounding.
enum class Laws { kExact, kRounded };

/// A law whose worth is such that the intensity on a map full of it fits into a message,
/// and one level of one node is less than one unit of P.
inline PheromoneLaw RandomLaw(Random& random, uint8_t type, int64_t cell_um, Laws laws) {
  PheromoneLaw law;
  law.type = type;
  law.core_um = OneIn(random, 4) ? 0 : Between(random, 0, 2 * cell_um);
  law.sigma_um = Between(random, 2 * cell_um, 5 * cell_um);
  law.tau_ms = OneIn(random, 3) ? 0 : Between(random, 100, 5000);
  law.evaporation = OneIn(random, 2) ? Evaporation::kLinear : Evaporation::kCounter;
  if (laws == Laws::kRounded) {
    law.evaporation = OneIn(random, 3) ? law.evaporation : Evaporation::kExponential;
    if (!OneIn(random, 3)) {
      law.profile = Profile::kGaussian;
      law.core_um = 0;
      law.sigma_um = Between(random, cell_um, 2 * cell_um);
      law.cutoff_um = Between(random, 2 * law.sigma_um, 4 * law.sigma_um);
    }
  }
  law.quantum_micro = Between(random, 2'000, 12'000);
  law.max_count = static_cast<uint16_t>(Between(random, 4, 15));
  law.directional = !OneIn(random, 4);
  law.weight_milli = OneIn(random, 3) ? static_cast<int32_t>(Between(random, -1200, 1200)) : 1000;
  return law;
}

inline PointUm RandomPoint(Random& random, const MapGeometry& map) {
  return {map.origin.x + Between(random, 0, map.width_um),
          map.origin.y + Between(random, 0, map.height_um)};
}

/// A map of 12 to 40 cells a side with the given pheromones, their antennas and nothing on it.
inline FieldConfig RandomConfig(Random& random, const std::vector<uint8_t>& types, Laws laws) {
  FieldConfig config;
  config.map.cell_um = Between(random, 20'000, 200'000);
  config.map.origin = {Between(random, -5'000'000, 5'000'000),
                       Between(random, -5'000'000, 5'000'000)};
  config.map.width_um = Between(random, 12 * config.map.cell_um, 40 * config.map.cell_um);
  config.map.height_um = Between(random, 12 * config.map.cell_um, 40 * config.map.cell_um);
  config.antennas.distance_um = Between(random, 0, 5 * config.map.cell_um);
  if (OneIn(random, 2)) {
    config.antennas.forward_um = Between(random, -config.map.cell_um, 3 * config.map.cell_um);
    config.antennas.angle = static_cast<uint16_t>(Between(random, 0, 32768));
  }
  config.memory_bytes = 64 << 20;
  for (const uint8_t type : types) {
    config.pheromones.push_back(RandomLaw(random, type, config.map.cell_um, laws));
  }
  return config;
}

inline PoseUm RandomPose(Random& random, const MapGeometry& map) {
  return {RandomPoint(random, map), static_cast<uint16_t>(Between(random, 0, 65535))};
}

/// How many cases were of use as evidence: both antennas sense something, and a message can hold
/// it.
struct Tally {
  int cases = 0;
  int telling = 0;

  void Add(const Intensities& p) {
    ++cases;
    const auto tells = [](int64_t v) { return v != 0 && std::abs(v) <= 32767; };
    telling += tells(p.left) && tells(p.right) ? 1 : 0;
  }
  int percent() const { return cases == 0 ? 0 : static_cast<int>(int64_t{100} * telling / cases); }
};

/// What Field::hash must be, from what lies on the map and the state of the sweep. For fields
/// without a diffusing type.
inline uint64_t HashFromADump(const Field& field) {
  const SweepState& sweep = field.sweep();
  uint64_t sum = Hash64({'W', sweep.type, static_cast<uint64_t>(sweep.leaf), sweep.earliest_ms,
                         sweep.cycle_ms, sweep.next_ms}) +
                 field.HashOfWork() + field.history().Hash();
  field.ForEach([&](uint8_t type, NodeIndex node, NodeState state) {
    sum += Field::NodeHash(field.StoredLaw(type, state), node, state);
  });
  return sum;
}

}  // namespace pheromone::field::testing
