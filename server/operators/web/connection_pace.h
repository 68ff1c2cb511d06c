// How soon a new connection is served: one client that connects again and again must not take the
// processor from the robots. Each may make `burst` connections at once and then one every
// `interval`; what comes faster waits, and what would wait longer than `longest_wait` is to be
// closed.
//
//   const auto wait = pace.Next(NetworkOf(client), steady_clock::now());
//   if (!wait) { close } else if (*wait > 0) { serve it after that time }
//
// One thread. The generic cell rate algorithm (ITU-T I.371): a client costs one time.
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <optional>
#include <string>

namespace pheromone::web {

class ConnectionPace {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::steady_clock::duration;

  struct Limits {
    Duration interval = std::chrono::milliseconds(2);
    int burst = 100;
    Duration longest_wait = std::chrono::milliseconds(128);
    size_t clients = 1'024;  ///< told apart at a time; more of them share one pace
  };

  ConnectionPace() = default;
  explicit ConnectionPace(const Limits& limits) : limits_(limits) {}

  /// The time until a connection that comes now is to be served; empty: never. `now` does not go
  /// back.
  std::optional<Duration> Next(const std::string& client, Time now);

 private:
  Time* Find(const std::string& client, Time now);

  const Limits limits_ = {};
  std::map<std::string, Time> next_;  // when the pace of a client is due
  Time next_of_others_{};
};

/// What counts as one client: an IPv4 address, or the first 64 bits of an IPv6 address, of which a
/// single machine has all; but a link-local address (fe80::/10) as a whole, since all neighbours
/// share its first 64 bits.
std::string NetworkOf(const std::string& address);

}  // namespace pheromone::web
