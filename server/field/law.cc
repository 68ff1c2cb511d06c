#include "server/field/law.h"

#include "server/field/kernel_table.h"

namespace pheromone::field {

uint32_t LevelAt(const PheromoneLaw& law, NodeState node, uint64_t now_ms) {
  if (law.tau_ms == 0 || now_ms <= node.time_ms || node.level == 0) {
    return node.level;
  }
  const uint64_t dt = now_ms - node.time_ms;
  const auto tau = static_cast<uint64_t>(law.tau_ms);
  if (law.evaporation == Evaporation::kExponential) {
    const double left = node.level * Exp2Minus(static_cast<double>(dt) / static_cast<double>(tau));
    return static_cast<uint32_t>(left + 0.5);  // NOLINT(bugprone-incorrect-roundings): defined so
  }
  const bool linear = law.evaporation == Evaporation::kLinear;
  const uint64_t unit = linear ? 1 : kLevelsPerQuantum;
  const uint64_t steps = (linear ? dt * kLevelsPerQuantum : dt) / tau;
  return steps * unit >= node.level ? 0 : node.level - static_cast<uint32_t>(steps * unit);
}

uint64_t LivesUntil(const PheromoneLaw& law, NodeState node) {
  if (law.tau_ms == 0) {
    return UINT64_MAX;
  }
  const auto tau = static_cast<uint64_t>(law.tau_ms);
  switch (law.evaporation) {
    case Evaporation::kExponential: {
      // L 2^-n < 1/2 needs n > log2(L) + 1.
      uint64_t halvings = 0;
      for (uint32_t rest = node.level; rest != 0; rest >>= 1) {
        ++halvings;
      }
      return node.time_ms + halvings * tau;
    }
    case Evaporation::kLinear:
      return node.time_ms + node.level * tau / kLevelsPerQuantum;
    case Evaporation::kCounter:
      break;
  }
  return node.time_ms + node.level / kLevelsPerQuantum * tau;
}

}  // namespace pheromone::field
