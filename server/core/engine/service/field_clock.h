// Field time. It advances with the boot-time clock of the machine, which includes suspended time
// and has no steps; it never decreases; and after a restart it continues from the last logged
// value. UTC is used for display and, once, to measure the downtime: a clock that is a day off, or
// a machine that boots in 1970, must not evaporate a map.
#pragma once

#include <cstdint>
#include <optional>

#include "server/core/engine/event.h"

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

  /// The field time to resume with after `last` was logged: later by the downtime according to UTC,
  /// but never earlier.
  static uint64_t ResumeAt(const Stamp& last, int64_t utc_ms, bool evaporate_while_down);

  /// The stamp of a batch. If the boot-time reading decreases, no time passes.
  Stamp Read(const ClockReading& reading);

  /// Goes on from the stamp of another server's clock, which has just come in; what was read
  /// before remains the least that is read.
  void Follow(const Stamp& stamp, const ClockReading& reading);

 private:
  uint64_t now_ms_;
  uint64_t read_ms_ = 0;  // the last
  std::optional<uint64_t> last_boottime_ms_;
};

}  // namespace pheromone::engine
