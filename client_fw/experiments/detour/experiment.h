// A robot follows a path with a repellent on it: it drives around the repellent and comes back to
// the path behind it, with the usual request and the usual steering. Only the map is different:
// type "way" is a blend, path - weight * repellent, which the robot senses.
//
//   const DetourRun run = MakeDetour({}, /*seed=*/1);
//   run.least_distance_m;  // from the core of the patch; negative inside
//
// Three types: kPathType, permanent, deposited along a straight path; kRepellentType, permanent,
// deposited on a disc, the *core*, whose centre is `patch_offset_m` to the left of the path;
// kWayType, their blend. The comparison senses kPathType on the same map and drives through.
//
// P_L - P_R points to the side of the way around, and head-on there is one on both sides: the
// differential law drives through a patch whose centre is close to the path. The careful law turns
// aside where P_L and P_R are negative (README.md).
//
// The robot starts as in the path experiment: 0.2 m beside the path and 20 degrees off; sides,
// place and the radio's delays come from the seed. The run ends after `duration_ms`, or shortly
// before the path does. Virtual time. Distances are of the robot's centre.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client_fw/swarm/simulation.h"
#include "client_fw/swarm/track.h"
#include "server/core/field/path.h"

namespace pheromone::swarm {

struct DetourExperiment {
  static constexpr uint8_t kPathType = 2;
  static constexpr uint8_t kRepellentType = 3;
  static constexpr uint8_t kWayType = 4;

  uint8_t sensed_type = kWayType;  ///< kPathType: without the repellent
  client::Law law = client::Law::kDifferential;
  int16_t speed_mm_s = 300;  ///< K
  uint16_t period_ms = 200;
  int64_t duration_ms = 40'000;
  int64_t sample_ms = 100;
  double core_m = 0.1;   ///< c and sigma of both pheromones: the path must be sensed from as far
  double sigma_m = 0.8;  ///< away as the repellent drives a robot
  double weight = 0.3;   ///< of the repellent in the blend, which subtracts it
  double patch_radius_m = 0.3;       ///< of the core
  double patch_offset_m = 0.2;       ///< its centre, to the left of the path
  double patch_along_m = 4.5;        ///< and from the beginning of the path
  double antenna_distance_m = 0.33;  ///< b
};

/// A straight path of 9 m, oblique to the map's axes: no row of nodes runs along it.
field::Path PathOfDetour();

/// The centre of the patch.
field::PointUm PatchCentre(const DetourExperiment& experiment);

/// The map in the server's configuration: three types, the path, and the patch as an initial
/// raster.
engine::EngineConfig EngineConfigOf(const DetourExperiment& experiment);

struct DetourRun {
  static constexpr double kOnPathM = 0.1;

  std::vector<Sample> track;
  double least_distance_m = 0;  ///< from the edge of the core; negative inside
  int64_t inside_ms = 0;        ///< in the core, to a sample
  double largest_detour_m = 0;  ///< from the path, from where the repellent can be sensed
  /// How far behind the patch's centre, along the path, the robot was back: from there to the end
  /// it stays within kOnPathM. Nothing if it did not come back.
  std::optional<double> rejoined_m;
  double progress = 0;      ///< along the path, as a share of K * t
  uint64_t state_hash = 0;  ///< of the engine, at the end
};

DetourRun MakeDetour(const DetourExperiment& experiment, uint64_t seed);

/// Runs of one experiment, of seed 1, 2, ...
struct DetourSeries {
  DetourExperiment experiment;
  std::vector<DetourRun> runs;
};

DetourSeries MakeDetours(const DetourExperiment& experiment, int seeds);

/// The worst of a series.
struct DetourSummary {
  int entered = 0;  ///< runs that were in the core
  int rejoined = 0;
  double least_distance_m = 0;
  int64_t inside_ms = 0;
  double largest_detour_m = 0;
  double rejoined_m = 0;  ///< of the runs that did
  double progress = 0;
};

DetourSummary Summarise(const DetourSeries& series);

/// A readable table: one line per series, with its DetourSummary.
std::string ToTable(const std::vector<DetourSeries>& all);

/// A header line, then one line per run.
std::string ToCsv(const std::vector<DetourSeries>& all);

/// The tracks of all runs; the path and the core of the repellent.
std::string TracksToCsv(const std::vector<DetourSeries>& all);
std::string MapToCsv(const DetourExperiment& experiment);

}  // namespace pheromone::swarm
