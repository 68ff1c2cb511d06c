#include "server/core/engine/service/field_clock.h"

#include <algorithm>

namespace pheromone::engine {

uint64_t FieldClock::ResumeAt(const Stamp& last, int64_t utc_ms, bool evaporate_while_down) {
  if (!evaporate_while_down || utc_ms <= last.utc_ms) {
    return last.field_time_ms;
  }
  const uint64_t down_ms = static_cast<uint64_t>(utc_ms) - static_cast<uint64_t>(last.utc_ms);
  return std::min(last.field_time_ms + std::min(down_ms, kMaxFieldTimeMs), kMaxFieldTimeMs);
}

Stamp FieldClock::Read(const ClockReading& reading) {
  if (last_boottime_ms_ && reading.boottime_ms > *last_boottime_ms_) {
    now_ms_ += std::min(reading.boottime_ms - *last_boottime_ms_, kMaxFieldTimeMs);
  }
  last_boottime_ms_ = reading.boottime_ms;
  now_ms_ = std::min(now_ms_, kMaxFieldTimeMs);
  read_ms_ = std::max(read_ms_, now_ms_);
  return {read_ms_, reading.utc_ms};
}

void FieldClock::Follow(const Stamp& stamp, const ClockReading& reading) {
  (void)Read(reading);
  now_ms_ = std::min(stamp.field_time_ms, kMaxFieldTimeMs);
}

}  // namespace pheromone::engine
