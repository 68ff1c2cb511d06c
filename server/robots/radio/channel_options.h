// What a line is, on which the server answers robots.
#pragma once

#include <chrono>
#include <cstdint>

#include "protocol/decoder.h"
#include "server/robots/radio/timing.h"

namespace pheromone::radio {

struct ChannelOptions {
  uint16_t gap_timeout_ms = protocol::kNoGapTimeout;
  /// Whether several stations share the line, one sending at a time. The rest is about that.
  bool half_duplex = false;
  Timing timing;
  Duration response_window{};         ///< W, as announced
  std::chrono::milliseconds slot{1};  ///< of contention, as announced
  /// From the first HELLO to the first ROUND, at least. While robots may still await the ROUND of
  /// a server before this one, its numbers could be taken for those: kAwaitedRound then.
  Duration quiet_start{};
};

}  // namespace pheromone::radio
