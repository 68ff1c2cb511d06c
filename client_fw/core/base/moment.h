// A point of time on a board's clock, in milliseconds.
//
//   const Moment now_ms = board->millis();
//   const Moment passed_ms = now_ms - before_ms;
#pragma once

namespace pheromone {
namespace client {

/// Wraps. As wide as the processor's int, 16 bits on an AVR: whoever takes differences looks more
/// often than once a minute, which an AVR's watchdog sees to.
using Moment = unsigned;

}  // namespace client
}  // namespace pheromone
