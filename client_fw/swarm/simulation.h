// A swarm with one engine at the other end of its radio channels, in virtual time.
//
//   SimulationConfig config;
//   config.engine = ...;                     // a link for each channel
//   config.robots = {robot, another};
//   Simulation simulation(config);
//   simulation.RunTo(10'000);
//   simulation.robot(1).true_pose();
//
// One thread. The same configuration gives the same bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "client_fw/swarm/server_station.h"
#include "client_fw/swarm/swarm.h"
#include "server/core/engine/service/ordered_log.h"
#include "server/core/engine/service/service.h"
#include "server/robots/signing/keys.h"
#include "server/robots/signing/signing.h"

namespace pheromone::swarm {

struct SimulationConfig : SwarmConfig {
  engine::EngineConfig engine;  ///< at least `channels` links: channel i is link i
  ServerTiming server;
  /// By the robots' IDs. If there are any, all channels require signed frames, and `client.key` of
  /// each robot is set.
  signing::Keys keys;
};

class Simulation {
 public:
  /// The configuration must be one that the engine accepts. Throws as Swarm does.
  explicit Simulation(const SimulationConfig& config);
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  /// Advances virtual time to `ms` since the start.
  void RunTo(int64_t ms);

  const Swarm& swarm() const { return *swarm_; }
  int64_t now_ms() const { return swarm_->now_ms(); }
  size_t robot_count() const { return swarm_->robot_count(); }
  const sim::MobileRobot& robot(size_t index = 0) const { return swarm_->robot(index); }
  const sim::RadioMedium& medium(size_t channel = 0) const { return swarm_->medium(channel); }
  const ServerStation& server(size_t channel = 0) const { return stations_[channel]; }
  /// Of a channel with signed frames.
  const signing::Signing& signing(size_t channel = 0) const { return signing_[channel]; }
  uint64_t state_hash() const { return service_.StateHash(); }
  /// For an operator's actions: commands (see Issue), edits of the map, queries of the engine.
  engine::Service& service() { return service_; }
  /// Sends a command to a robot. Errors: those of engine::Service::Issue.
  Status Issue(const engine::CommandIssued& command);

 private:
  void AdvanceEngine();
  void Distribute(const std::vector<engine::Outgoing>& out);

  SwarmConfig Signed(const SimulationConfig& config);

  engine::VolatileLog log_;
  engine::Service service_;
  signing::Keys keys_;                    // robots point to them
  std::deque<signing::Signing> signing_;  // one per channel, if they are signed
  std::deque<ServerStation> stations_;    // one per channel; a deque, because media point to them
  std::optional<Swarm> swarm_;            // made last, once the engine is configured
};

}  // namespace pheromone::swarm
