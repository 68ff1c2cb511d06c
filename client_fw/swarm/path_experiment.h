// The paper's experiment: a robot follows a predefined, time-invariant path; its position is
// recorded every 0.2 s for 10 s, and the mean distance from the path is the figure of merit (Susnea
// et al. 2009, "General Conditions"). In virtual time, over the modelled 9600-baud channel.
//
// The robot starts 0.2 m beside the path and 20 degrees off. The side, the sign of the heading
// error, the position between two nodes, and the radio's random delays come from the seed.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "client_fw/core/steering/steering.h"
#include "client_fw/swarm/simulation.h"
#include "client_fw/swarm/track.h"
#include "server/core/field/path.h"

namespace pheromone::swarm {

/// kCircuit is the path of the server's default configuration.
enum class Shape { kLine, kCircle, kSCurve, kCircuit };

std::string_view NameOf(Shape shape);
std::string_view NameOf(client::Law law);

struct PathExperiment {
  Shape shape = Shape::kLine;
  /// With the default law, kCareful, a robot also does the default where it senses nothing; with
  /// the others it drives straight on.
  client::Law law = client::Law::kDifferential;
  int16_t speed_mm_s = 300;  ///< K
  uint16_t period_ms = 200;  ///< five requests a second
  int64_t duration_ms = 10'000;
  int64_t sample_ms = 200;
  double cell_m = 0.1;               ///< a
  double core_m = 0.1;               ///< c
  double sigma_m = 0.4;              ///< sigma
  double antenna_distance_m = 0.33;  ///< b
  double offset_m = 0.2;             ///< beside the path at the start
  double heading_error_deg = 20;
  bool lay_trail = false;  ///< TRACE instead of SENSE: the robot adds to the path
  double frame_loss = 0;   ///< probability that a listener misses a frame
  const sim::PioneerModel* pioneer = nullptr;  ///< null: an ideal drive
  std::string image = {};  ///< of an AVR, which drives the Pioneer; empty: the core
  int64_t erase_ms = 0;    ///< the path is taken away at this time; 0: never
};

/// The path of an experiment, on a map of 10 m x 10 m: an oblique line; a circle of radius 1.5 m;
/// two quarter arcs of radius 1 m, left then right, with a straight way out; a closed circuit of
/// 22 m with bends of at least 0.9 m.
field::Path PathOf(Shape shape);

/// The map in the server's configuration: the path on permanent pheromone type 2.
engine::EngineConfig EngineConfigOf(const PathExperiment& experiment);

struct PathRun {
  std::vector<Sample> track;
  double mean_error_m = 0;       ///< over the whole run
  double late_mean_error_m = 0;  ///< over its second half
  double progress = 0;           ///< along the path, as a share of K * t
  double on_its_own_m = 0;       ///< driven since the path was taken away
  client::Counters counters{};
  double utilisation = 0;   ///< of the channel
  uint64_t state_hash = 0;  ///< of the engine, at the end
};

PathRun FollowPath(const PathExperiment& experiment, uint64_t seed);

/// Figures over the runs of one shape and law: means, and the worst run.
struct PathSummary {
  PathExperiment experiment;
  int runs = 0;
  double mean_error_m = 0;
  double worst_mean_error_m = 0;
  double late_mean_error_m = 0;
  double worst_late_mean_error_m = 0;
  double progress = 0;
  double worst_progress = 0;
  uint64_t requests = 0;
  uint64_t timeouts = 0;
  uint64_t fail_safe_stops = 0;
  double utilisation = 0;
  uint64_t state_hash = 0;  ///< of all runs together
};

PathSummary Summarise(const PathExperiment& experiment, const std::vector<PathRun>& runs);

/// A header line, then one line per summary.
std::string ToCsv(const std::vector<PathSummary>& summaries);

}  // namespace pheromone::swarm
