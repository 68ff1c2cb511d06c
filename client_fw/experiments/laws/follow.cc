#include "client_fw/experiments/laws/follow.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <random>

#include "client_fw/swarm/path_experiment.h"
#include "client_fw/swarm/server_station.h"
#include "server/core/engine/service/ordered_log.h"
#include "server/core/engine/service/service.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kNsPerMs = 1'000'000;
constexpr int64_t kSampleMs = 100;
constexpr double kEndOfCurveM = 0.5;
constexpr int kWindowMs = 20;  // W beyond the server's delay

uint8_t WindowMs(const FollowConditions& conditions) {
  return static_cast<uint8_t>(kWindowMs + std::lround(conditions.latency_ms));
}

engine::EngineConfig EngineConfigOf(const FollowConditions& conditions) {
  PathExperiment experiment;
  experiment.cell_m = conditions.cell_m;
  experiment.core_m = conditions.core_m;
  experiment.sigma_m = conditions.sigma_m;
  engine::EngineConfig config = EngineConfigOf(experiment);
  config.field.paths = {PathOf(conditions.curve)};
  config.links[0].response_window_ms = WindowMs(conditions);
  return config;
}

// The pose at `along_m` of the path, `left_m` beside it and turned by `turn_rad`.
sim::PlanePose PoseBeside(const field::Path& path, double along_m, double left_m, double turn_rad) {
  double rest_um = along_m * 1e6;
  for (size_t i = 1; i < path.points.size(); ++i) {
    const auto x = static_cast<double>(path.points[i - 1].x);
    const auto y = static_cast<double>(path.points[i - 1].y);
    const double dx = static_cast<double>(path.points[i].x) - x;
    const double dy = static_cast<double>(path.points[i].y) - y;
    const double length = std::hypot(dx, dy);
    if (length > 0 && (rest_um <= length || i + 1 == path.points.size())) {
      const double share = rest_um / length;
      return {(x + dx * share - left_m * 1e6 * dy / length) / 1e6,
              (y + dy * share + left_m * 1e6 * dx / length) / 1e6, std::atan2(dy, dx) + turn_rad};
    }
    rest_um -= length;
  }
  return {};
}

// The server, a robot and the channel between them.
class World {
 public:
  World(const FollowConditions& conditions, const sim::SimulatedRobotConfig& robot,
        uint64_t radio_seed)
      : medium_(RadioOf(conditions, radio_seed)),
        service_(&log_,
                 [this] {
                   const auto ms = static_cast<uint64_t>(medium_.now_ns() / kNsPerMs);
                   return engine::ClockReading{ms, static_cast<int64_t>(ms)};
                 }),
        server_(&service_, 0, EngineConfigOf(conditions).links[0], &medium_, TimingOf(conditions)),
        robot_(robot, conditions.steering, &medium_) {
    const auto configured = service_.Configure(EngineConfigOf(conditions), /*new_epoch=*/1);
    assert(configured.ok());
    (void)configured;
  }

  void RunTo(int64_t ms) {
    std::vector<engine::Outgoing> due;
    for (int64_t at = medium_.now_ns() / kNsPerMs + 1; at <= ms; ++at) {
      server_.AdvanceTo(at * kNsPerMs);
      robot_.Step();
    }
  }

  const LawRobot& robot() const { return robot_; }

 private:
  static sim::RadioConfig RadioOf(const FollowConditions& conditions, uint64_t seed) {
    sim::RadioConfig radio;
    radio.seed = seed;
    radio.block_loss = conditions.frame_loss;
    return radio;
  }

  static ServerTiming TimingOf(const FollowConditions& conditions) {
    ServerTiming timing;
    timing.delay_ns = std::llround(conditions.latency_ms * static_cast<double>(kNsPerMs));
    return timing;
  }

  sim::RadioMedium medium_;
  engine::VolatileLog log_;
  engine::Service service_;
  ServerStation server_;
  LawRobot robot_;
};

// Along the curve, in metres. Where it crosses itself the nearest point may jump to the other
// branch and back: a step that no robot can make is not counted.
double WayAlong(const std::vector<Sample>& track, const field::Path& path) {
  constexpr double kLongestStepM = 0.3;
  const double length_m = field::LengthOf(path) / 1e6;
  double way_m = 0;
  for (size_t i = 1; i < track.size(); ++i) {
    double step_m = track[i].along_m - track[i - 1].along_m;
    if (path.closed) {
      step_m = std::remainder(step_m, length_m);
    }
    way_m += std::abs(step_m) <= kLongestStepM ? step_m : 0;
  }
  return way_m;
}

}  // namespace

FollowResult Follow(const FollowConditions& conditions, uint64_t seed) {
  assert(conditions.latency_ms >= 0 && conditions.latency_ms <= 200);
  std::mt19937_64 random(seed);
  const double side = (seed & 1) != 0 ? 1 : -1;
  const double turn = (seed & 2) != 0 ? 1 : -1;
  const double along_m = static_cast<double>(random() % 1000) / 1000 * conditions.cell_m;
  const field::Path path = PathOf(conditions.curve);
  const uint64_t radio_seed = random();

  sim::SimulatedRobotConfig robot;
  robot.client.id = static_cast<uint8_t>(1 + random() % 254);
  robot.client.boot_counter = static_cast<uint16_t>(random());
  robot.client.type = path.type;
  robot.client.lost_trail = client::LostTrail::kStraight;  // the laws by themselves
  robot.client.period_ms = conditions.period_ms;
  robot.client.fail_safe_ms = static_cast<uint16_t>(std::max(500, 2 * conditions.period_ms + 100));
  robot.client.first_window_ms = std::max(robot.client.first_window_ms, WindowMs(conditions));
  robot.drive.right_scale = 1 + conditions.odometry_drift;
  robot.start = PoseBeside(path, along_m, side * conditions.offset_m,
                           turn * conditions.heading_error_deg * std::numbers::pi / 180);

  World world(conditions, robot, radio_seed);
  FollowResult result;
  const double end_m = field::LengthOf(path) / 1e6 - kEndOfCurveM;
  for (int64_t ms = 0; ms <= conditions.duration_ms; ms += kSampleMs) {
    world.RunTo(ms);
    result.track.push_back(Observe(world.robot(), path, ms));
    if (!path.closed && result.track.back().along_m >= end_m) {
      break;
    }
  }
  const int64_t end_ms = result.track.back().time_ms;
  result.mean_error_m = MeanDistance(result.track, 0);
  result.late_mean_error_m = MeanDistance(result.track, end_ms / 2);
  result.progress_mm_s =
      end_ms > 0 ? WayAlong(result.track, path) * 1e6 / static_cast<double>(end_ms) : 0;
  return result;
}

Spread SpreadOf(const std::vector<double>& values) {
  Spread spread;
  if (values.empty()) {
    return spread;
  }
  const auto count = static_cast<double>(values.size());
  for (const double value : values) {
    spread.mean += value / count;
  }
  double squares = 0;
  for (const double value : values) {
    squares += (value - spread.mean) * (value - spread.mean);
  }
  spread.deviation = values.size() > 1 ? std::sqrt(squares / (count - 1)) : 0;
  spread.least = *std::min_element(values.begin(), values.end());
  spread.most = *std::max_element(values.begin(), values.end());
  return spread;
}

FollowSummary FollowSeeds(const FollowConditions& conditions, uint64_t first_seed, int runs) {
  std::vector<double> errors_mm;
  std::vector<double> late_errors_mm;
  std::vector<double> progress_mm_s;
  for (int i = 0; i < runs; ++i) {
    const FollowResult result = Follow(conditions, first_seed + static_cast<uint64_t>(i));
    errors_mm.push_back(result.mean_error_m * 1000);
    late_errors_mm.push_back(result.late_mean_error_m * 1000);
    progress_mm_s.push_back(result.progress_mm_s);
  }
  return {conditions, runs, SpreadOf(errors_mm), SpreadOf(late_errors_mm), SpreadOf(progress_mm_s)};
}

}  // namespace pheromone::swarm
