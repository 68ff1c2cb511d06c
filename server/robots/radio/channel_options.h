// What a line is, on which the server answers robots.
#pragma once

#include <chrono>
#include <cstdint>

#include "protocol/decoder.h"
#include "server/robots/radio/timing.h"
#include "server/robots/signing/signing.h"

namespace pheromone::radio {

/// A robot that takes part in rounds.
struct RoundMember {
  uint8_t id = 0;
  uint8_t period = 0;  ///< as in its HELLO; not 0
  bool operator==(const RoundMember&) const = default;
};

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
  /// Of the link; outlives the line. Null: nothing is signed.
  signing::Signing* signing = nullptr;
  /// Frames to all are the same on several lines, and come with their signature.
  bool to_all_is_signed = false;
};

}  // namespace pheromone::radio
