// The field's own time. It advances with the machine's boot-time clock, which counts suspended time
// and knows no steps; it never decreases; and after a restart it goes on from the last logged
// value. UTC is carried along for display and, once, to bridge a restart: a clock set wrong by a
// day, or a machine that wakes up in 1970, must not evaporate a map.
#pragma once

#include <cstdint>
#include <optional>

#include "server/engine/event.h"

namespace pheromone::engine {

/// One reading of the machine's clocks.
struct ClockReading {
  uint64_t boottime_ms = 0;  ///< CLOCK_BOOTTIME
  int64_t utc_ms = 0;        ///< CLOCK_REALTIME
};

class FieldClock {
 public:
  /// The first reading will be `start_ms`.
  explicit FieldClock(uint64_t start_ms = 0) : now_ms_(start_ms) {}

  /// Where to start again after `last` was logged: later by the time the server was down, as far as
  /// UTC tells; never earlier.
  static uint64_t ResumeAt(const Stamp& last, int64_t utc_ms, bool evaporate_while_down);

  /// The stamp of a batch. A boot-time reading smaller than one before counts as no time passing.
  Stamp Read(const ClockReading& reading);

 private:
  uint64_t now_ms_;
  std::optional<uint64_t> last_boottime_ms_;
};

}  // namespace pheromone::engine
