// Features that an image may omit, decided when it is compiled: a robot's flash is small.
// Everything is on unless the build disables it; hosts leave it on.
//
//   avr-g++ -DPHEROMONE_COUNTERS=0 -DPHEROMONE_BUFFERED_LINK=0 -DPHEROMONE_SHORT_CLOCK=1
//           -DPHEROMONE_START_POSE=0 ...
//
// All sources of one image must be compiled with the same choice.
#pragma once

#include <stdint.h>

#ifndef PHEROMONE_COUNTERS
#define PHEROMONE_COUNTERS 1
#endif
#ifndef PHEROMONE_BUFFERED_LINK
#define PHEROMONE_BUFFERED_LINK 1
#endif
#ifndef PHEROMONE_SHORT_CLOCK
#define PHEROMONE_SHORT_CLOCK 0
#endif
#ifndef PHEROMONE_WIDE
#define PHEROMONE_WIDE 1
#endif
#ifndef PHEROMONE_START_POSE
#define PHEROMONE_START_POSE 1
#endif
#ifndef PHEROMONE_FUZZY_LAW
#define PHEROMONE_FUZZY_LAW 1
#endif

namespace pheromone {
namespace client {

/// Conversation counts what happens (counters.h); off, its counters are all zero and take no
/// memory.
constexpr bool kHasCounters = PHEROMONE_COUNTERS != 0;
/// Links whose answers may be late, or that have no gap timeout: pty, TCP, UDP, USB.
constexpr bool kHasBufferedLink = PHEROMONE_BUFFERED_LINK != 0;
/// Parameters::wide; off, the map must fit 16-bit coordinates.
constexpr bool kHasWide = PHEROMONE_WIDE != 0;
/// Parameters::start; off, the drive itself counts from where the robot stands on the map.
constexpr bool kHasStartPose = PHEROMONE_START_POSE != 0;
/// Law::kFuzzy; if off, it steers like Law::kDifferential.
constexpr bool kHasFuzzyLaw = PHEROMONE_FUZZY_LAW != 0;

/// A board's clock. With 16 bits, a pause of the loop of 65 536 ms is not noticed: only for boards
/// with a watchdog.
#if PHEROMONE_SHORT_CLOCK
using Milliseconds = uint16_t;
#else
using Milliseconds = uint32_t;
#endif

}  // namespace client
}  // namespace pheromone
