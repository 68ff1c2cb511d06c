// What the echo image and the tests that run it have to agree on.
#pragma once

#include <stdint.h>

namespace pheromone {
namespace sim {

/// Bytes of stack that command 's' uses, besides what the calls take.
constexpr uint8_t kDeepStack = 200;

}  // namespace sim
}  // namespace pheromone
