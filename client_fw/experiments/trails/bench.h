// The two-trail bench: where its lines and tags are, as in deploy/examples/bench.toml, which is a
// daemon's configuration.
//
//   Result<TrailsBench> bench = LoadBench("deploy/examples/bench.toml");
//   bench.value().QueuePlace(3);            // where the fourth robot starts, in the nest's queue
//   bench.value().LengthBetween(2, "N5", "S1");
//
// Lines are pheromone types with one [[path]] each: 1 the nest, from N4 to P; 2 and 4 from P to the
// source by trail A and B; 3 and 5 back; 6 from P to N4. Tags are found by their names, N1 to N6,
// S1 to S4, P and Src. Units: metres. Pure except for reading the file; any thread.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client_fw/sim/differential_drive.h"
#include "server/base/result.h"
#include "server/config/config.h"
#include "server/core/field/path.h"

namespace pheromone::swarm {

/// Of a robot's body: a Pioneer P3-DX.
constexpr double kBenchRobotRadiusM = 0.25;

struct BenchTag {
  std::string name;
  double x_m = 0;
  double y_m = 0;
  double range_m = 0;
};

struct BenchLine {
  std::string name;  ///< of its pheromone
  field::Path path;
};

struct TrailsBench {
  std::string name;              ///< of the file, in messages
  std::filesystem::path folder;  ///< of the file, where its nets/ are
  config::Config config;
  std::map<int, BenchLine> lines;  ///< by pheromone type
  std::vector<BenchTag> tags;

  /// Null if there is none.
  const BenchTag* FindTag(std::string_view tag_name) const;
  /// Along a line from one tag to another, both of which are near it.
  double LengthBetween(int line, std::string_view from, std::string_view to) const;
  /// Poses on a line, `along_m` from its begin.
  sim::PlanePose PlaceOn(int line, double along_m) const;
  /// Poses from one place to another, at most `step_m` apart; both ends included.
  std::vector<sim::PlanePose> PlacesOn(int line, double from_m, double to_m, double step_m) const;
  double AlongOf(int line, const BenchTag& tag) const;
  double DistanceFrom(int line, const BenchTag& tag) const;

  /// Where robot `number`, counted from 0, waits at first: the first one a little before N1, the
  /// others behind it, `spacing_m` apart.
  sim::PlanePose QueuePlace(int number, double spacing_m = 0.8) const;
  /// How many find a place there.
  int QueuePlaces(double spacing_m = 0.8) const;
};

/// The lines of the bench.
enum BenchLineType : uint8_t {
  kNestLine = 1,
  kTrailAOut = 2,
  kTrailABack = 3,
  kTrailBOut = 4,
  kTrailBBack = 5,
  kHomeLine = 6,
};

/// Errors: those of the configuration; a line or a tag is missing.
Result<TrailsBench> LoadBench(const std::string& file);
/// The same of a text, whose files are relative to `folder`.
Result<TrailsBench> ParseBench(std::string_view text, std::string_view name,
                               const std::optional<std::filesystem::path>& folder);

}  // namespace pheromone::swarm
