// The capacity of a half-duplex channel: the times of medium access (protocol/README.md) for a
// modem and a server, and the ideal throughput of stations that contend for it.
//
//   const ChannelTiming timing{.turnaround_ns = 2'000'000, .server_delay_ns = 2'000'000};
//   const engine::LinkSettings link = timing.Link("radio-a");     // sent to clients in HELLO's
//   answer const double share = answers_per_second / timing.PeakRate(kSenseExchange); const double
//   bound = timing.IdealRate(kSenseExchange, 8);
//
// The bound is that of slotted CSMA with the optimal transmission probability, after G. Bianchi,
// "Performance Analysis of the IEEE 802.11 Distributed Coordination Function", IEEE J. Sel. Areas
// Commun. 18(3), 2000, eq. (13): n stations always have something to send, each begins in any slot
// with probability p, and the channel carries
//
//   S(p) = n p q / (q (1 - p) s + n p q T_s + (1 - q (1 - p) - n p q) T_c),    q = (1 - p)^(n-1)
//
// exchanges a second, where s is an idle slot, T_s a whole exchange, and T_c a collision: a request
// lost, and the time in which the others still wait for its answer. The bound is the greatest S(p).
// Stations know n and choose p; no station is hidden; only collisions damage frames. It bounds
// random contention; robots that send periodically and have shifted their periods apart no longer
// contend, and may exceed it slightly.
//
// All times in ns. Pure; any thread.
#pragma once

#include <cstdint>
#include <string>

#include "server/core/engine/event.h"
#include "server/robots/radio/timing.h"

namespace pheromone::swarm {

/// Bytes on the air, nothing stuffed.
struct ExchangeSize {
  int request = 14;
  int answer = 12;
};
constexpr ExchangeSize kSenseExchange{14, 12};

struct ChannelTiming {
  int64_t baud = 9600;
  int64_t turnaround_ns = 2'000'000;    ///< T_t
  int64_t server_delay_ns = 2'000'000;  ///< D_s
  bool carrier_detect = true;
  int64_t adapter_ns = 0;  ///< for how long the server's adapter holds back what it received
  bool keyed = false;      ///< the server's modem is keyed by a line
  int64_t lead_ns = 0;     ///< keyed: from keying to the first byte

  /// As the server's medium access uses it.
  radio::Timing Server() const;

  int64_t byte_ns() const;             ///< B, rounded down
  int64_t response_window_ns() const;  ///< W
  int64_t slot_ns() const;             ///< T_t with carrier detect, T_t + B without

  /// The values in HELLO's answer: window and slot in whole milliseconds, rounded up.
  engine::LinkSettings Link(std::string name) const;

  /// C_1: exchanges a second if they followed each other without any wait except the two
  /// turnarounds.
  double PeakRate(const ExchangeSize& size) const;
  /// The bound above for `stations` >= 1. A single station has nobody to wait for: 1 / T_s.
  double IdealRate(const ExchangeSize& size, int stations) const;

  bool operator==(const ChannelTiming&) const = default;
};

}  // namespace pheromone::swarm
