// Whether a swarm can work on its radio channels, and what helps if it cannot.
//
//   const std::string trouble = WhyItDoesNotFit({.robots = 12, .period_ms = 200});
//   if (!trouble.empty()) { ... }
//
// By contention robots stretch their period to what the channel holds
// (client_fw/core/medium). Rounds answer several robots with one frame: 1.2 times as many
// as exchanges without any wait (channel_model.h), as client_fw/experiments/channel measured. Pure;
// any thread.
#pragma once

#include <cstdint>
#include <string>

#include "client_fw/swarm/channel_model.h"
#include "client_fw/swarm/scenario/run.h"
#include "server/robots/links/link_config.h"

namespace pheromone::swarm {

constexpr int64_t kMaxPeriodMs = 15'000;  ///< the fail-safe time, twice that, is at most 30 s

/// Robots on one channel, all with the same period.
struct ChannelLoad {
  int robots = 1;
  int64_t period_ms = 200;
  int64_t fail_safe_ms = 480;
  LinkKind access = LinkKind::kBuffered;
  bool is_signed = false;     ///< frames are longer
  ChannelTiming timing = {};  ///< for contention, only the baud rate
  // What the server announces; for contention. A link without medium_access, if not configured:
  uint8_t window_ms = static_cast<uint8_t>(links::LinkConfig().response_window_ms);
  uint8_t slot_ms = links::LinkConfig().slot_ms;

  bool operator==(const ChannelLoad&) const = default;
};

/// The least period in which each robot is answered once.
int64_t LeastPeriodMs(const ChannelLoad& load);

/// The same in steps of 50 ms, rounded up. With a fail-safe time of twice that, it fits.
int64_t FittingPeriodMs(const ChannelLoad& load);

/// Whether each robot is answered before its fail-safe stops it.
bool Fits(const ChannelLoad& load);

/// Empty if it fits; else why not, and what helps, in a few sentences.
std::string WhyItDoesNotFit(const ChannelLoad& load);

}  // namespace pheromone::swarm
