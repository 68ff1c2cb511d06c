// Timers that run down to 0 and stay there, in milliseconds, rather than points of time: a timer
// cannot wrap, needs no flag for validity, and after a pause of the whole loop all of them have
// expired, which is the right thing for a robot.
//
//   uint16_t timers_[kTimers];
//   RunDown(timers_, kTimers, elapsed_ms);
#pragma once

#include <stdint.h>

#include "client_fw/core/base/outlined.h"

namespace pheromone {
namespace client {

PHEROMONE_OUTLINED inline void RunDown(uint16_t* timers, uint8_t count, uint16_t elapsed_ms) {
  for (; count != 0; --count, ++timers) {
    *timers = *timers > elapsed_ms ? static_cast<uint16_t>(*timers - elapsed_ms) : uint16_t{0};
  }
}

}  // namespace client
}  // namespace pheromone
