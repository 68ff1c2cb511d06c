// Robots on one or more radio channels, millisecond by millisecond. The server at the other end of
// a channel is an engine (simulation.h) or a running daemon (live.h).
//
//   Swarm swarm(config, [&](size_t channel, sim::RadioMedium* medium) {
//     servers.emplace_back(medium, ...);                 // the first station of each channel
//   });
//   swarm.Step([&](size_t channel, int64_t ns) { servers[channel].AdvanceTo(ns); });
//
// In each millisecond the channels advance with their servers, then the robots step, all in their
// order. Time is virtual. One thread. The same configuration gives the same bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "client_fw/sim/mobile_robot.h"
#include "client_fw/sim/radio_medium.h"
#include "client_fw/swarm/robots.h"

namespace pheromone::swarm {

struct SwarmConfig {
  sim::RadioConfig radio;           ///< of each channel, with the seed `radio.seed` + i
  RobotConfig robot;                ///< of a swarm of one
  std::vector<RobotConfig> robots;  ///< if there are any, instead of `robot`
  size_t channels = 1;              ///< robot i is on channel i modulo this
  /// Pairs of robots (by index in `robots`) out of each other's range. All are in range of the
  /// server. Robots on different channels never receive each other.
  std::vector<std::pair<size_t, size_t>> hidden_pairs;
  /// Called for each channel once its server is there; for stations that only listen.
  std::function<void(size_t channel, sim::RadioMedium* medium)> add_listener = {};
};

class Swarm {
 public:
  /// `add_server` is called for each channel, in their order, before there is any robot; what it
  /// puts on the medium must outlive the medium's last event. Throws std::runtime_error if a robot
  /// cannot be made (MakeRobot).
  Swarm(const SwarmConfig& config,
        const std::function<void(size_t channel, sim::RadioMedium* medium)>& add_server);
  Swarm(const Swarm&) = delete;
  Swarm& operator=(const Swarm&) = delete;

  /// Lets a millisecond pass. `advance(channel, time_ns)` advances a channel with its server.
  void Step(const std::function<void(size_t channel, int64_t time_ns)>& advance);

  /// Of several channels the first is the clock: within a step the others lag.
  int64_t now_ms() const { return media_.front().now_ns() / 1'000'000; }
  size_t robot_count() const { return robots_.size(); }
  const sim::MobileRobot& robot(size_t index) const { return *robots_[index]; }
  size_t channel_count() const { return media_.size(); }
  const sim::RadioMedium& medium(size_t channel) const { return media_[channel]; }

 private:
  std::deque<sim::RadioMedium> media_;  // a deque, because media are pointed at
  std::vector<std::unique_ptr<sim::MobileRobot>> robots_;
};

}  // namespace pheromone::swarm
