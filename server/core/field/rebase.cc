#include "server/core/field/rebase.h"

#include <algorithm>

#include "server/core/field/geometry.h"

namespace pheromone::field {

bool SameSubstance(const PheromoneLaw& a, const PheromoneLaw& b) {
  return a.evaporation == b.evaporation && a.tau_ms == b.tau_ms &&
         a.quantum_micro == b.quantum_micro && a.max_count == b.max_count &&
         a.diffuses() == b.diffuses() && a.is_blend() == b.is_blend();
}

uint32_t LevelUnder(const PheromoneLaw& from, const PheromoneLaw& to, uint32_t level) {
  const bool whole = to.evaporation == Evaporation::kCounter && !to.diffuses();
  const int64_t unit = whole ? int64_t{kLevelsPerQuantum} : 1;
  const int64_t value = int64_t{level} * from.quantum_micro;
  const int64_t next = RoundDiv(value, to.quantum_micro * unit) * unit;
  return static_cast<uint32_t>(std::min<int64_t>(next, to.max_level()));
}

}  // namespace pheromone::field
