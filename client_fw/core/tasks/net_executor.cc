#include "client_fw/core/tasks/net_executor.h"

namespace pheromone {
namespace client {

Firing Fire(const NetTransition& transition, uint32_t* marking) {
  if ((*marking & transition.takes) != transition.takes) {
    return Firing::kNotEnabled;
  }
  if ((*marking & transition.inhibited_by) != 0) {
    return Firing::kInhibited;
  }
  const uint32_t left = *marking & ~transition.takes;
  if ((left & transition.gives) != 0) {
    return Firing::kUnsafe;
  }
  *marking = left | transition.gives;
  return Firing::kFired;
}

}  // namespace client
}  // namespace pheromone
