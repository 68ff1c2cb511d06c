// Robots on the double bridge, in virtual time: what the experiment (bridge_experiment.h) runs.
//
//   BridgeExperiment experiment;
//   experiment.tau_ms = 30'000;
//   BridgeSimulation simulation(experiment, /*seed=*/1);
//   simulation.RunTo(60'000);
//   simulation.choices();            // who went which way, so far
//
// Robots go to and fro between nest and food (bridge_arena.h). Each is the firmware's own code;
// once per period it sends TRACE, senses the trail at its two antennas, deposits one quantum, and
// steers by the differential law. A branch is chosen only by that law and the random component of
// the wheels (bridge_robot.h).
//
// The link is ideal unless `radio` is set: a frame arrives in the next step, and none is lost. With
// `radio`, all robots share one half-duplex channel at 9600 baud.
//
// One thread. Everything is determined by the experiment and the seed.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client_fw/experiments/bridge/arena.h"
#include "client_fw/experiments/bridge/robot.h"
#include "client_fw/sim/radio_medium.h"
#include "client_fw/swarm/server_station.h"
#include "protocol/decoder.h"
#include "server/core/engine/service/ordered_log.h"
#include "server/core/engine/service/service.h"

namespace pheromone::swarm {

struct BridgeExperiment {
  static constexpr uint8_t kTrail = 1;  ///< the pheromone's type

  std::string name = "base";
  int robots = 8;
  bool lay_trail = true;  ///< false: SENSE on an empty map, for purely random choices
  field::Evaporation evaporation = field::Evaporation::kCounter;
  int64_t tau_ms = 20'000;     ///< 0: the trail never evaporates
  uint16_t max_count = 32;     ///< C_max; a full node is one pheromone unit, so Q = 1 / C_max
  int64_t short_opens_ms = 0;  ///< until then only the long branch is open
  /// Quanta deposited on the branches' centre lines before the start, by Branch; if there are any,
  /// the stems are full.
  std::array<uint16_t, 2> laid{};
  bool radio = false;
  int16_t speed_mm_s = 300;  ///< K
  uint16_t period_ms = 200;
  int64_t release_ms = 5'000;  ///< robots leave the nest at random within this time
  int64_t duration_ms = 1'200'000;
  double core_m = 0.1;
  double sigma_m = 0.4;
  double antenna_distance_m = 0.33;  ///< b
  Wandering wandering;
  BridgeShape shape;
};

engine::EngineConfig EngineConfigOf(const BridgeExperiment& experiment);

/// A robot at a fork entered a branch.
struct Choice {
  int64_t time_ms = 0;
  bool outbound = false;  ///< to the food
  Branch branch = Branch::kShort;
  /// The trail on the first half metre of the branches: the short one's share of both, 1/2 if there
  /// is none.
  double short_trail = 0.5;
};

/// Nest, food, bridge, robots and the server.
class BridgeSimulation {
 public:
  /// Of virtual time, on the ideal link; the radio's is 1 ms.
  static constexpr int64_t kStepMs = 10;

  BridgeSimulation(const BridgeExperiment& experiment, uint64_t seed);
  BridgeSimulation(const BridgeSimulation&) = delete;
  BridgeSimulation& operator=(const BridgeSimulation&) = delete;

  /// Advances virtual time to `ms` since the start.
  void RunTo(int64_t ms);

  int64_t now_ms() const { return now_ms_; }
  const BridgeArena& arena() const { return arena_; }
  const std::vector<Choice>& choices() const { return choices_; }
  /// Robot-milliseconds spent between the forks.
  int64_t time_on_ms(Branch branch) const { return time_on_ms_[static_cast<size_t>(branch)]; }
  const std::deque<BridgeRobot>& robots() const { return robots_; }
  /// False before its release: until then other robots do not notice it.
  bool released(size_t robot) const { return now_ms_ >= releases_ms_[robot]; }
  const engine::Service& service() const { return service_; }

 private:
  void Drive(size_t number, int64_t step_ms);
  void ExchangeIdeally(BridgeRobot* robot, std::span<const uint8_t> request);
  double ShortTrail(bool outbound) const;

  BridgeExperiment experiment_;
  BridgeArena arena_;
  int64_t now_ms_ = 0;
  engine::VolatileLog log_;
  engine::Service service_;
  std::optional<sim::RadioMedium> medium_;
  std::optional<ServerStation> server_;
  std::deque<BridgeRobot> robots_;  // a deque: stations of the medium must not move
  std::vector<int64_t> releases_ms_;
  std::vector<int> stations_;
  protocol::FrameDecoder decoder_;  // the server's, on the ideal link
  std::array<std::array<std::vector<field::NodeIndex>, 2>, 2> entries_;  // of [outbound][branch]
  std::vector<Choice> choices_;
  std::array<int64_t, 2> time_on_ms_{};
};

}  // namespace pheromone::swarm
