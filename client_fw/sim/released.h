// The parameters of a simulated robot. On a real floor a robot starts halted and waits for a
// resume; in a simulation nobody can be run over, and nobody is there to release it.
#pragma once

#include "client_fw/core/steering/parameters.h"

namespace pheromone::sim {

/// The defaults, but for a robot that drives as soon as it is answered.
inline client::Parameters ReleasedParameters() {
  client::Parameters parameters;
  parameters.start_released = true;
  return parameters;
}

}  // namespace pheromone::sim
