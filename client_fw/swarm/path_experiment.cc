#include "client_fw/swarm/path_experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <random>

#include "server/base/hash.h"
#include "server/config/config.h"
#include "server/core/field/edit.h"

namespace pheromone::swarm {
namespace {

constexpr uint8_t kType = 2;
constexpr int64_t kStepUm = 25'000;

int64_t ToUm(double metres) {
  return std::llround(metres * 1e6);
}

// Appends an arc around (x, y) from one angle to another, in degrees; the end included.
void AppendArc(std::vector<field::PointUm>* points, double x, double y, double radius_m,
               double from_deg, double to_deg) {
  constexpr int kSteps = 64;
  for (int i = 0; i <= kSteps; ++i) {
    const double angle = (from_deg + (to_deg - from_deg) * i / kSteps) * std::numbers::pi / 180;
    points->push_back({ToUm(x + radius_m * std::cos(angle)), ToUm(y + radius_m * std::sin(angle))});
  }
}

// The pose `along_m` after the path's beginning, facing along it, moved `offset_m` to the left and
// turned by `turn_rad`.
sim::PlanePose StartPose(const field::Path& path, double along_m, double offset_m,
                         double turn_rad) {
  double rest = along_m * 1e6;
  for (size_t i = 1; i < path.points.size(); ++i) {
    const field::PointUm a = path.points[i - 1];
    const field::PointUm b = path.points[i];
    const double dx = static_cast<double>(b.x - a.x);
    const double dy = static_cast<double>(b.y - a.y);
    const double length = std::hypot(dx, dy);
    if (rest <= length && length > 0) {
      const double heading = std::atan2(dy, dx);
      const double w = rest / length;
      return {(static_cast<double>(a.x) + dx * w) / 1e6 - offset_m * std::sin(heading),
              (static_cast<double>(a.y) + dy * w) / 1e6 + offset_m * std::cos(heading),
              heading + turn_rad};
    }
    rest -= length;
  }
  return {};
}

void Erase(Simulation* simulation) {
  field::FieldEdit all;
  all.type = kType;
  all.shape = field::FieldEdit::Shape::kAll;
  all.action = field::FieldEdit::Action::kErase;
  const auto erased = simulation->service().Edit(all);
  assert(erased.ok());
  (void)erased;
}

double Driven(const std::vector<Sample>& track, int64_t from_ms) {
  double driven_m = 0;
  for (size_t i = 1; i < track.size(); ++i) {
    if (track[i - 1].time_ms >= from_ms) {
      driven_m += std::hypot(track[i].pose.x_m - track[i - 1].pose.x_m,
                             track[i].pose.y_m - track[i - 1].pose.y_m);
    }
  }
  return driven_m;
}

}  // namespace

std::string_view NameOf(Shape shape) {
  switch (shape) {
    case Shape::kLine:
      return "line";
    case Shape::kCircle:
      return "circle";
    case Shape::kSCurve:
      return "s-curve";
    case Shape::kCircuit:
      return "circuit";
  }
  return "";
}

std::string_view NameOf(client::Law law) {
  switch (law) {
    case client::Law::kPaper:
      return "paper";
    case client::Law::kFuzzy:
      return "fuzzy";
    case client::Law::kCareful:
      return "careful";
    case client::Law::kDifferential:
      break;
  }
  return "differential";
}

field::Path PathOf(Shape shape) {
  field::Path path;
  if (shape == Shape::kCircuit) {
    const Result<config::Config> server =
        config::ParseConfig(config::DefaultConfigText(), "default.toml");
    assert(server.ok());
    path = server.value().engine.field.paths.front();
    assert(path.type == kType);
    return path;
  }
  path.type = kType;
  path.count = 8;
  switch (shape) {
    case Shape::kLine:
      path.points = {{ToUm(1), ToUm(2)}, {ToUm(9), ToUm(6)}};
      break;
    case Shape::kCircle:
      path.points = field::CirclePoints({ToUm(5), ToUm(5)}, ToUm(1.5), kStepUm);
      path.closed = true;
      break;
    case Shape::kSCurve:
      AppendArc(&path.points, 3, 5, 1, -90, 0);
      AppendArc(&path.points, 5, 5, 1, 180, 90);
      path.points.push_back({ToUm(8), ToUm(6)});
      break;
    case Shape::kCircuit:
      break;
  }
  return path;
}

engine::EngineConfig EngineConfigOf(const PathExperiment& experiment) {
  field::PheromoneLaw law;
  law.type = kType;
  law.name = "path";
  law.core_um = ToUm(experiment.core_m);
  law.sigma_um = ToUm(experiment.sigma_m);
  law.tau_ms = 0;
  law.quantum_micro = 125'000;
  law.max_count = 8;
  engine::EngineConfig config;
  config.field.map = {.origin = {0, 0},
                      .width_um = ToUm(10),
                      .height_um = ToUm(10),
                      .cell_um = ToUm(experiment.cell_m)};
  config.field.antennas.distance_um = ToUm(experiment.antenna_distance_m);
  config.field.pheromones = {law};
  config.field.paths = {PathOf(experiment.shape)};
  config.field.memory_bytes = 64 << 20;
  config.links = {{"radio-a", 3, 20}};
  return config;
}

PathRun FollowPath(const PathExperiment& experiment, uint64_t seed) {
  std::mt19937_64 random(seed);
  const double side = (seed & 1) != 0 ? 1 : -1;
  const double turn = (seed & 2) != 0 ? 1 : -1;
  const double along_m = static_cast<double>(random() % 1000) / 1000 * experiment.cell_m;
  const field::Path path = PathOf(experiment.shape);

  SimulationConfig config;
  config.engine = EngineConfigOf(experiment);
  config.radio.seed = random();
  config.radio.block_loss = experiment.frame_loss;
  config.robot.client.id = static_cast<uint8_t>(1 + random() % 254);
  config.robot.client.boot_counter = static_cast<uint16_t>(random());
  config.robot.client.type = kType;
  config.robot.client.law = experiment.law;
  if (experiment.law != client::Law::kCareful) {
    config.robot.client.lost_trail = client::LostTrail::kStraight;
  }
  config.robot.client.speed_mm_s = experiment.speed_mm_s;
  config.robot.client.period_ms = experiment.period_ms;
  config.robot.client.lay_trail = experiment.lay_trail;
  config.robot.start = StartPose(path, along_m, side * experiment.offset_m,
                                 turn * experiment.heading_error_deg * std::numbers::pi / 180);
  config.robot.pioneer = experiment.pioneer;
  config.robot.image = experiment.image;
  if (!experiment.image.empty()) {
    // An image's coordinates start where it is switched on; the server knows that pose.
    config.engine.frames = {
        engine::MakeFrame(config.engine.links[0].name, config.robot.client.id,
                          {ToUm(config.robot.start.x_m), ToUm(config.robot.start.y_m)},
                          config.robot.start.heading_rad * 180 / std::numbers::pi)};
  }

  Simulation simulation(config);
  PathRun run;
  for (int64_t ms = 0; ms <= experiment.duration_ms; ms += experiment.sample_ms) {
    simulation.RunTo(ms);
    run.track.push_back(Observe(simulation.robot(), path, ms));
    if (experiment.erase_ms > 0 && ms >= experiment.erase_ms &&
        ms < experiment.erase_ms + experiment.sample_ms) {
      Erase(&simulation);
    }
  }
  if (experiment.erase_ms > 0) {
    run.on_its_own_m = Driven(run.track, experiment.erase_ms);
  }
  run.mean_error_m = MeanDistance(run.track, 0);
  run.late_mean_error_m = MeanDistance(run.track, experiment.duration_ms / 2);
  run.progress = Progress(run.track, path) * 1e6 /
                 static_cast<double>(experiment.speed_mm_s * experiment.duration_ms);
  run.counters = simulation.robot().counters();
  run.utilisation = simulation.medium().Utilisation();
  run.state_hash = simulation.state_hash();
  return run;
}

PathSummary Summarise(const PathExperiment& experiment, const std::vector<PathRun>& runs) {
  PathSummary sum;
  sum.experiment = experiment;
  sum.runs = static_cast<int>(runs.size());
  sum.worst_progress = runs.empty() ? 0 : runs.front().progress;
  for (const PathRun& run : runs) {
    sum.mean_error_m += run.mean_error_m / sum.runs;
    sum.late_mean_error_m += run.late_mean_error_m / sum.runs;
    sum.progress += run.progress / sum.runs;
    sum.utilisation += run.utilisation / sum.runs;
    sum.worst_mean_error_m = std::max(sum.worst_mean_error_m, run.mean_error_m);
    sum.worst_late_mean_error_m = std::max(sum.worst_late_mean_error_m, run.late_mean_error_m);
    sum.worst_progress = std::min(sum.worst_progress, run.progress);
    sum.requests += run.counters.requests;
    sum.timeouts += run.counters.timeouts;
    sum.fail_safe_stops += run.counters.fail_safe_stops;
    sum.state_hash = HashStep(sum.state_hash, run.state_hash);
  }
  return sum;
}

std::string ToCsv(const std::vector<PathSummary>& summaries) {
  std::string csv =
      "path,law,runs,mean_error_mm,worst_mean_error_mm,late_mean_error_mm,"
      "worst_late_mean_error_mm,progress_percent,worst_progress_percent,requests,timeouts,"
      "fail_safe_stops,channel_percent,state_hash\n";
  for (const PathSummary& s : summaries) {
    csv +=
        fmt::format("{},{},{},{:.1f},{:.1f},{:.1f},{:.1f},{:.1f},{:.1f},{},{},{},{:.1f},{:016x}\n",
                    NameOf(s.experiment.shape), NameOf(s.experiment.law), s.runs,
                    s.mean_error_m * 1000, s.worst_mean_error_m * 1000, s.late_mean_error_m * 1000,
                    s.worst_late_mean_error_m * 1000, s.progress * 100, s.worst_progress * 100,
                    s.requests, s.timeouts, s.fail_safe_stops, s.utilisation * 100, s.state_hash);
  }
  return csv;
}

}  // namespace pheromone::swarm
