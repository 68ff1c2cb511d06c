#include "server/core/field/law.h"

#include <bit>

#include "server/core/field/kernel_table.h"

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
  if (node.level == 0) {
    return node.time_ms;
  }
  const auto tau = static_cast<uint64_t>(law.tau_ms);
  const uint64_t level = node.level;
  switch (law.evaporation) {
    case Evaporation::kExponential: {
      // L 2^-n < 1/2 needs n > log2(L) + 1; and of L = 2^k (1 + f), log2(L) is at least k + f.
      const auto k = static_cast<uint64_t>(std::bit_width(level)) - 1;
      const uint64_t f_tau = ((level - (uint64_t{1} << k)) * tau) >> k;
      return node.time_ms + (k + 1) * tau + f_tau;
    }
    case Evaporation::kLinear:
      return node.time_ms + (level * tau + kLevelsPerQuantum - 1) / kLevelsPerQuantum;
    case Evaporation::kCounter:
      break;
  }
  return node.time_ms + (level + kLevelsPerQuantum - 1) / kLevelsPerQuantum * tau;
}

}  // namespace pheromone::field
