#include "client_fw/experiments/detour/experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include "server/core/field/edit.h"

namespace pheromone::swarm {
namespace {

constexpr double kPathLengthM = 9;
constexpr double kPathStartXM = 1;
constexpr double kPathStartYM = 2;
constexpr double kPathHeading = 20 * std::numbers::pi / 180;
constexpr double kEndOfRunM = 0.5;  // before the end of the path, where there is less of it ahead
constexpr double kStartOffsetM = 0.2;
constexpr double kStartTurn = 20 * std::numbers::pi / 180;
constexpr double kCellM = 0.1;
constexpr uint16_t kMaxCount = 8;

int64_t ToUm(double metres) {
  return std::llround(metres * 1e6);
}

double ToMm(double metres) {
  return metres * 1000;
}

// A position relative to the path: the distance along it, and to the left of it.
sim::PlanePose BesidePath(double along_m, double left_m, double turn_rad) {
  return {kPathStartXM + along_m * std::cos(kPathHeading) - left_m * std::sin(kPathHeading),
          kPathStartYM + along_m * std::sin(kPathHeading) + left_m * std::cos(kPathHeading),
          kPathHeading + turn_rad};
}

field::PointUm PointBesidePath(double along_m, double left_m) {
  const sim::PlanePose pose = BesidePath(along_m, left_m, 0);
  return {ToUm(pose.x_m), ToUm(pose.y_m)};
}

field::PheromoneLaw PermanentLaw(uint8_t type, const char* name,
                                 const DetourExperiment& experiment) {
  field::PheromoneLaw law;
  law.type = type;
  law.name = name;
  law.core_um = ToUm(experiment.core_m);
  law.sigma_um = ToUm(experiment.sigma_m);
  law.quantum_micro = 1'000'000 / kMaxCount;
  law.max_count = kMaxCount;
  return law;
}

// The core: a disc, full at each of its nodes.
field::InitialRaster PatchOf(const DetourExperiment& experiment, const field::MapGeometry& map) {
  field::FieldEdit disc;
  disc.shape = field::FieldEdit::Shape::kStroke;
  disc.radius_um = ToUm(experiment.patch_radius_m);
  disc.points = {PatchCentre(experiment)};
  const Result<std::vector<field::NodeIndex>> nodes = field::NodesOf(disc, map);
  assert(nodes.ok());
  std::vector<field::InitialNode> full;
  for (const field::NodeIndex node : nodes.value()) {
    full.push_back({node, uint32_t{kMaxCount} << field::kLevelBits});
  }
  return {DetourExperiment::kRepellentType,
          field::Shared<std::vector<field::InitialNode>>(std::move(full))};
}

void Measure(const DetourExperiment& experiment, DetourRun* run) {
  const field::PointUm centre = PatchCentre(experiment);
  const double smelled_from_m =
      experiment.patch_along_m - experiment.patch_radius_m - experiment.core_m - experiment.sigma_m;
  run->least_distance_m = kPathLengthM;
  for (const Sample& s : run->track) {
    const double distance_m = std::hypot(s.pose.x_m - static_cast<double>(centre.x) / 1e6,
                                         s.pose.y_m - static_cast<double>(centre.y) / 1e6) -
                              experiment.patch_radius_m;
    run->least_distance_m = std::min(run->least_distance_m, distance_m);
    run->inside_ms += distance_m < 0 ? experiment.sample_ms : 0;
    if (s.along_m >= smelled_from_m) {
      run->largest_detour_m = std::max(run->largest_detour_m, s.distance_m);
    }
  }
  // From the end backwards, for as long as the robot is on the path and behind the core.
  for (size_t i = run->track.size(); i-- > 0;) {
    const Sample& s = run->track[i];
    const double behind_m = s.along_m - experiment.patch_along_m;
    if (s.distance_m > DetourRun::kOnPathM || behind_m < experiment.patch_radius_m) {
      break;
    }
    run->rejoined_m = behind_m;
  }
  run->progress = Progress(run->track, PathOfDetour()) * 1e6 /
                  static_cast<double>(experiment.speed_mm_s * run->track.back().time_ms);
}

bool WithRepellent(const DetourExperiment& experiment) {
  return experiment.sensed_type == DetourExperiment::kWayType;
}

}  // namespace

field::Path PathOfDetour() {
  field::Path path;
  path.type = DetourExperiment::kPathType;
  path.count = kMaxCount;
  path.points = {PointBesidePath(0, 0), PointBesidePath(kPathLengthM, 0)};
  return path;
}

field::PointUm PatchCentre(const DetourExperiment& experiment) {
  return PointBesidePath(experiment.patch_along_m, experiment.patch_offset_m);
}

engine::EngineConfig EngineConfigOf(const DetourExperiment& experiment) {
  field::PheromoneLaw way;
  way.type = DetourExperiment::kWayType;
  way.name = "way";
  way.blend = {{DetourExperiment::kPathType, 1000},
               {DetourExperiment::kRepellentType,
                static_cast<int32_t>(-std::lround(experiment.weight * 1000))}};
  engine::EngineConfig config;
  config.field.map = {
      .origin = {0, 0}, .width_um = ToUm(10), .height_um = ToUm(8), .cell_um = ToUm(kCellM)};
  config.field.antennas.distance_um = ToUm(experiment.antenna_distance_m);
  config.field.pheromones = {
      PermanentLaw(DetourExperiment::kPathType, "path", experiment),
      PermanentLaw(DetourExperiment::kRepellentType, "repellent", experiment), way};
  config.field.paths = {PathOfDetour()};
  config.field.initial_rasters = {PatchOf(experiment, config.field.map)};
  config.field.memory_bytes = 64 << 20;
  config.links = {{"radio-a", 3, 20}};
  return config;
}

DetourRun MakeDetour(const DetourExperiment& experiment, uint64_t seed) {
  std::mt19937_64 random(seed);
  const double side = (seed & 1) != 0 ? 1 : -1;
  const double turn = (seed & 2) != 0 ? 1 : -1;
  const double along_m = static_cast<double>(random() % 1000) / 1000 * kCellM;

  SimulationConfig config;
  config.engine = EngineConfigOf(experiment);
  config.radio.seed = random();
  config.robot.client.id = static_cast<uint8_t>(1 + random() % 254);
  config.robot.client.boot_counter = static_cast<uint16_t>(random());
  config.robot.client.type = experiment.sensed_type;
  config.robot.client.law = experiment.law;
  if (experiment.law != client::Law::kCareful) {
    config.robot.client.lost_trail = client::LostTrail::kStraight;
  }
  config.robot.client.speed_mm_s = experiment.speed_mm_s;
  config.robot.client.period_ms = experiment.period_ms;
  config.robot.start = BesidePath(along_m, side * kStartOffsetM, turn * kStartTurn);

  const field::Path path = PathOfDetour();
  Simulation simulation(config);
  DetourRun run;
  for (int64_t ms = 0; ms <= experiment.duration_ms; ms += experiment.sample_ms) {
    simulation.RunTo(ms);
    run.track.push_back(Observe(simulation.robot(), path, ms));
    if (run.track.back().along_m > kPathLengthM - kEndOfRunM) {
      break;
    }
  }
  Measure(experiment, &run);
  run.state_hash = simulation.state_hash();
  return run;
}

DetourSeries MakeDetours(const DetourExperiment& experiment, int seeds) {
  DetourSeries series{experiment, {}};
  for (int seed = 1; seed <= seeds; ++seed) {
    series.runs.push_back(MakeDetour(experiment, static_cast<uint64_t>(seed)));
  }
  return series;
}

DetourSummary Summarise(const DetourSeries& series) {
  DetourSummary worst;
  worst.least_distance_m = kPathLengthM;
  worst.progress = 1;
  for (const DetourRun& run : series.runs) {
    worst.entered += run.inside_ms > 0 ? 1 : 0;
    worst.rejoined += run.rejoined_m ? 1 : 0;
    worst.least_distance_m = std::min(worst.least_distance_m, run.least_distance_m);
    worst.inside_ms = std::max(worst.inside_ms, run.inside_ms);
    worst.largest_detour_m = std::max(worst.largest_detour_m, run.largest_detour_m);
    worst.rejoined_m = std::max(worst.rejoined_m, run.rejoined_m.value_or(0));
    worst.progress = std::min(worst.progress, run.progress);
  }
  return worst;
}

std::string ToTable(const std::vector<DetourSeries>& all) {
  std::string table =
      "offset_mm  weight  senses  runs  entered  least_mm  inside_s  detour_mm  rejoined  "
      "behind_mm  "
      "progress\n";
  for (const DetourSeries& series : all) {
    const DetourSummary worst = Summarise(series);
    const bool with = WithRepellent(series.experiment);
    table += fmt::format(
        "{:9.0f}  {:>6}  {:<6}  {:4}  {:7}  {:8.0f}  {:8.1f}  {:9.0f}  {:8}  {:>9}  {:6.0f} %\n",
        ToMm(series.experiment.patch_offset_m),
        with ? fmt::format("{:.2f}", series.experiment.weight) : "-", with ? "way" : "path",
        series.runs.size(), worst.entered, ToMm(worst.least_distance_m),
        static_cast<double>(worst.inside_ms) / 1000, ToMm(worst.largest_detour_m), worst.rejoined,
        worst.rejoined > 0 ? fmt::format("{:.0f}", ToMm(worst.rejoined_m)) : "-",
        worst.progress * 100);
  }
  return table;
}

std::string ToCsv(const std::vector<DetourSeries>& all) {
  std::string csv =
      "patch_offset_mm,weight,senses,seed,least_distance_mm,inside_s,largest_detour_mm,"
      "rejoined_behind_mm,progress_percent,state_hash\n";
  for (const DetourSeries& series : all) {
    const bool with = WithRepellent(series.experiment);
    for (size_t i = 0; i < series.runs.size(); ++i) {
      const DetourRun& run = series.runs[i];
      csv += fmt::format("{:.0f},{},{},{},{:.1f},{:.1f},{:.1f},{},{:.1f},{:016x}\n",
                         ToMm(series.experiment.patch_offset_m),
                         with ? fmt::format("{:.3f}", series.experiment.weight) : "",
                         with ? "way" : "path", i + 1, ToMm(run.least_distance_m),
                         static_cast<double>(run.inside_ms) / 1000, ToMm(run.largest_detour_m),
                         run.rejoined_m ? fmt::format("{:.1f}", ToMm(*run.rejoined_m)) : "",
                         run.progress * 100, run.state_hash);
    }
  }
  return csv;
}

std::string TracksToCsv(const std::vector<DetourSeries>& all) {
  constexpr size_t kEach = 2;  // samples: enough for a figure
  std::string csv = "patch_offset_mm,weight,senses,seed,time_s,x_m,y_m\n";
  for (const DetourSeries& series : all) {
    const bool with = WithRepellent(series.experiment);
    for (size_t run = 0; run < series.runs.size(); ++run) {
      const std::vector<Sample>& track = series.runs[run].track;
      for (size_t i = 0; i < track.size(); i += kEach) {
        csv += fmt::format(
            "{:.0f},{},{},{},{:g},{:.3f},{:.3f}\n", ToMm(series.experiment.patch_offset_m),
            with ? fmt::format("{:.3f}", series.experiment.weight) : "", with ? "way" : "path",
            run + 1, static_cast<double>(track[i].time_ms) / 1000, track[i].pose.x_m,
            track[i].pose.y_m);
      }
    }
  }
  return csv;
}

std::string MapToCsv(const DetourExperiment& experiment) {
  std::string csv = "what,x_m,y_m,radius_m\n";
  const auto metres = [](int64_t um) { return static_cast<double>(um) / 1e6; };
  for (const field::PointUm& point : PathOfDetour().points) {
    csv += fmt::format("path,{:.3f},{:.3f},\n", metres(point.x), metres(point.y));
  }
  const field::PointUm patch = PatchCentre(experiment);
  return csv + fmt::format("repellent,{:.3f},{:.3f},{:g}\n", metres(patch.x), metres(patch.y),
                           experiment.patch_radius_m);
}

}  // namespace pheromone::swarm
