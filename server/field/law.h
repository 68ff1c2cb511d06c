// What a pheromone is: its numbers, in integers, as the paper's equations use them.
//
//   spread       eq. (1): full strength up to c from a source, falling to nothing at c + sigma
//   evaporation  eq. (2), (3): the count of quanta at a node falls by one every tau
//   strength     Q, the worth of one quantum; a node holds at most `max_count` of them
//
// All equations: Susnea et al. 2009; our readings of what they leave open: protocol/README.md.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

namespace pheromone::field {

struct PheromoneLaw {
  uint8_t type = 1;  ///< 1-15, as in the opcodes
  std::string name;
  int64_t core_um = 0;        ///< c
  int64_t sigma_um = 1;       ///< sigma, > 0
  int64_t tau_ms = 0;         ///< tau; 0 = never evaporates
  int64_t quantum_micro = 1;  ///< Q in millionths of a pheromone unit, > 0
  uint16_t max_count = 1;     ///< C_max = maximum / Q
  bool directional = true;    ///< only sources ahead of the axle line count
  bool operator==(const PheromoneLaw&) const = default;

  int64_t reach_um() const { return core_um + sigma_um; }
};

/// What a node remembers: C_n quanta at the time T_n of the last deposit.
struct NodeState {
  uint16_t count = 0;
  uint64_t time_ms = 0;
};

/// C(t) = max(0, C_n - floor((t - T_n) / tau)), the reading of eq. (2), (3) at a node between
/// deposits. A time before T_n counts as T_n.
inline uint16_t CountAt(const PheromoneLaw& law, NodeState node, uint64_t now_ms) {
  if (law.tau_ms == 0 || now_ms <= node.time_ms) {
    return node.count;
  }
  const uint64_t steps = (now_ms - node.time_ms) / static_cast<uint64_t>(law.tau_ms);
  return steps >= node.count ? uint16_t{0} : static_cast<uint16_t>(node.count - steps);
}

/// C_{n+1} = min(C_max, C(now) + quanta), T_{n+1} = now: a deposit, eq. (2).
inline NodeState AfterDeposit(const PheromoneLaw& law, NodeState node, uint16_t quanta,
                              uint64_t now_ms) {
  const uint32_t sum = uint32_t{CountAt(law, node, now_ms)} + quanta;
  return {static_cast<uint16_t>(std::min<uint32_t>(sum, law.max_count)),
          std::max(now_ms, node.time_ms)};
}

}  // namespace pheromone::field
