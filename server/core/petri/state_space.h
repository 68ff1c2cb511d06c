// All reachable markings of a net, breadth first, and what is true of them.
//
//   StateSpace* space = ...MakeStateSpace(net, layout, {});
//   const Explored found = space->Explore(goals, limits, nullptr);
//   if (found.deadlock) trace = space->TraceTo(*found.deadlock);   // a shortest one
//
// A state is a marking; it is known by its number, in the order in which they were found. Memory is
// that of state_store.h, and with eager transitions 4 bytes more; without, a trace is found by
// firing backwards. Not thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "server/core/petri/layout.h"
#include "server/core/petri/net.h"
#include "server/core/petri/property.h"

namespace pheromone::petri {

struct SearchLimits {
  uint64_t max_bytes = uint64_t{4} << 30;
  uint64_t max_states = 4'000'000'000;
  /// Ends with kGivenUp as soon as all goals are reached or, without goals, a deadlock is.
  bool stops_at_first = false;
  /// Leaves out markings with more tokens than the layout has bits for, and ends with kTruncated if
  /// there are any, instead of at the first one.
  bool truncates = false;
};

/// Called now and then with the number of states found and of those whose successors are known;
/// false: give up.
using Progress = std::function<bool(uint64_t states, uint64_t expanded)>;

struct Explored {
  enum class End { kComplete, kMemory, kStates, kGivenUp, kOverflow, kTruncated };

  End end = End::kComplete;
  uint64_t states = 0;
  uint64_t transitions = 0;  ///< edges of the graph
  uint64_t bytes = 0;
  std::optional<uint32_t> deadlock;              ///< the first state in which nothing is enabled
  std::vector<std::optional<uint32_t>> reached;  ///< by goal: the first state in which it holds
  std::vector<bool> fired;                       ///< by transition
  std::vector<uint64_t> most;                    ///< by place: the most tokens in any state
  /// kOverflow: a place would have more tokens than the layout has bits for.
  uint32_t overflow_place = 0;
  uint32_t overflow_state = 0;       ///< after it,
  uint32_t overflow_transition = 0;  ///< this transition was fired
};

/// How often transitions can be fired while something holds; see Property::Kind::kOvertaken.
struct Overtaking {
  std::optional<uint64_t> most;  ///< nothing: without bound
  bool complete = true;          ///< false: given up for want of memory
  std::vector<uint32_t> trace;  ///< transitions to it; without bound: then through `cycle` for ever
  std::vector<uint32_t> cycle;
};

struct Recurrence {
  bool complete = true;     ///< false: given up for want of memory
  uint64_t components = 0;  ///< strongly connected ones
  bool reversible = false;  ///< the first state can be reached from each
  /// By transition: a state from which it can never be fired again.
  std::vector<std::optional<uint32_t>> dies_at;
};

class StateSpace {
 public:
  virtual ~StateSpace() = default;

  /// Once, and before the others.
  virtual Explored Explore(const std::vector<Expression>& goals, const SearchLimits& limits,
                           const Progress& progress) = 0;

  /// A shortest sequence of transitions to a state. With `eager` ones: shortest among those that
  /// were tried.
  virtual std::vector<uint32_t> TraceTo(uint32_t state) const = 0;

  /// After a complete search.
  virtual Recurrence FindRecurrence(const SearchLimits& limits) const = 0;
  virtual Overtaking FindOvertaking(const Property& property, const SearchLimits& limits) const = 0;
};

/// Transitions of `eager` are fired as soon as they are enabled, and states in which one is are
/// left out: see reduction.h. Nothing if a marking needs more than 2048 bits. `net` and `layout`
/// are kept by reference.
std::unique_ptr<StateSpace> MakeStateSpace(const Net& net, const Layout& layout,
                                           const std::vector<uint32_t>& eager);

}  // namespace pheromone::petri
