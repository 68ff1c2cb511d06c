// Robots, one or more radio channels, and one engine, in virtual time.
//
//   SimulationConfig config;
//   config.engine = ...;                     // a link for each channel
//   config.robots = {robot, another};
//   Simulation simulation(config);
//   simulation.RunTo(10'000);
//   simulation.robot(1).true_pose();
//
// In each millisecond the channels advance and their servers step, in their order, then the robots
// step in theirs. One thread. The same configuration gives the same bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include "client_fw/sim/radio_medium.h"
#include "client_fw/sim/simulated_robot.h"
#include "client_fw/swarm/engine_station.h"
#include "server/engine/ordered_log.h"
#include "server/engine/service.h"

namespace pheromone::swarm {

struct SimulationConfig {
  engine::EngineConfig engine;  ///< at least `channels` links: channel i is link i
  sim::RadioConfig radio;       ///< of each channel, with the seed `radio.seed` + i
  ServerTiming server;
  sim::SimulatedRobotConfig robot;                ///< of a simulation with one robot
  std::vector<sim::SimulatedRobotConfig> robots;  ///< if there are any, instead of `robot`
  size_t channels = 1;                            ///< robot i is on channel i modulo this
  /// Robots (by their place in `robots`) that do not hear each other. All hear the server, and it
  /// hears all. Robots on different channels never hear each other.
  std::vector<std::pair<size_t, size_t>> hidden_pairs;
};

class Simulation {
 public:
  /// The configuration must be one that the engine accepts.
  explicit Simulation(const SimulationConfig& config);
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  /// Lets virtual time pass up to `ms` since the start.
  void RunTo(int64_t ms);

  int64_t now_ms() const { return channels_.front().medium.now_ns() / 1'000'000; }
  size_t robot_count() const { return robots_.size(); }
  const sim::SimulatedRobot& robot(size_t index = 0) const { return robots_[index]; }
  size_t channel_count() const { return channels_.size(); }
  const sim::RadioMedium& medium(size_t channel = 0) const { return channels_[channel].medium; }
  const EngineStation& server(size_t channel = 0) const { return channels_[channel].station; }
  uint64_t state_hash() const { return service_.StateHash(); }
  /// For what an operator does: commands (see Issue), edits of the map, a look at the engine.
  engine::Service& service() { return service_; }
  /// Has a command sent to a robot. Errors: those of engine::Service::Issue.
  Status Issue(const engine::CommandIssued& command);

 private:
  struct Channel {
    Channel(const SimulationConfig& config, size_t index, engine::Service* service);
    sim::RadioMedium medium;
    EngineStation station;
  };

  void Distribute(const std::vector<engine::Outgoing>& out);

  engine::VolatileLog log_;
  engine::Service service_;
  // Deques, because stations and media are pointed at.
  std::deque<Channel> channels_;
  std::deque<sim::SimulatedRobot> robots_;
};

}  // namespace pheromone::swarm
