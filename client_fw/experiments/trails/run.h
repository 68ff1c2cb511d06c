// One run of the two-trail bench, however it was made (trails_experiment.h, trails_timetable.h,
// trails_live.h), and what it comes to. Plain values; any thread.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "client_fw/core/tasks/net_robot.h"
#include "client_fw/experiments/trails/bench.h"
#include "client_fw/experiments/trails/ledger.h"
#include "client_fw/sim/differential_drive.h"
#include "server/base/result.h"
#include "server/core/engine/engine.h"
#include "server/core/petri/live_net.h"

namespace pheromone::swarm {

/// What the environment does, beside the bench file.
struct TrailsRules {
  int robots = 4;
  petri::EvaporationLaw law = petri::EvaporationLaw::kE1;
  uint32_t rate_milli = 20'000;
  uint32_t dead_band_milli = 0;
  bool has_source = false;
  uint32_t source = 0;  ///< energy at the start, if the source can be emptied
  /// With transitions for robots that do not follow the advice (pheromone_exploring.toml).
  bool exploring = false;
};

/// Those of the bench's [[net]], which must be the only one.
Result<TrailsRules> RulesOf(const TrailsBench& bench);
/// The bench's configuration with these rules instead. Errors: a net that cannot be read, or has
/// no place "nest" for the robots.
Result<engine::EngineConfig> ConfigWith(const TrailsBench& bench, const TrailsRules& rules);

/// The rate at which one deposit of `amount` lasts for `lifetime_s` by a law, in thousandths; where
/// a law only approaches zero, until a hundredth is left. 0 for a counter, which does not
/// evaporate.
uint32_t RateForLifetime(petri::EvaporationLaw law, double amount, double lifetime_s);

struct TrailsSample {
  int64_t time_ms = 0;
  std::array<int64_t, kTrails> concentration_milli{};
  petri::Advice advice = petri::Advice::kAny;
  std::array<int, kTrails> robots_on{};
  uint32_t source_left = 0;
};

/// The engine's bench at one moment. The net is the first one.
TrailsSample SampleOf(const engine::Engine& engine, uint64_t now_ms);
/// Null if there is none.
const petri::LiveNet* NetIn(const engine::Engine& engine);

struct TrailsRun {
  int robots = 0;
  int64_t duration_ms = 0;
  TrailsLedger ledger{0};
  std::vector<TrailsSample> samples;
  petri::LiveCounts server{};  ///< by the environment's account
  // By the account of the robots that can be asked, which images cannot.
  uint64_t own_deposits = 0;
  uint64_t own_deposited = 0;
  uint64_t robot_exceptions = 0;
  uint64_t collisions = 0;  ///< two bodies touched, or one ran into the other
  double least_gap_m = 0;   ///< between two bodies
  uint64_t bumps = 0;
  uint64_t fail_safe_stops = 0;
  double utilisation = 0;  ///< of the fullest channel
  uint64_t state_hash = 0;
  std::vector<std::vector<sim::PlanePose>> snapshots;  ///< where robots were, now and then

  /// Adds a robot's account.
  void CountOwn(const client::NetRobot& robot);
};

struct TrailsSummary {
  double trips_per_hour = 0;
  std::array<uint64_t, kTrails> choices{};
  double late_share_b = 0;  ///< of the choices in the last quarter
  uint64_t late_choices = 0;
  /// At least nine of ten choices in the last quarter were for one trail.
  bool locked_on_a = false;
  bool locked_on_b = false;
};
TrailsSummary Summarise(const TrailsRun& run);

}  // namespace pheromone::swarm
