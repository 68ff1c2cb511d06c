// A swarm whose odometry is wrong by 5 %, on a path like a
// stadium, in virtual time: a camera above it
// keeps it on the path, and without it the swarm leaves it. Every picture is rendered and searched
// for tags, and what pheromone-tracker would send is read as the daemon reads it.
//
//   tracker_swarm_test --seconds 3600     # with the camera for so long; without: 40 s
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <deque>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "client_fw/swarm/scenario/scenario.h"
#include "client_fw/swarm/simulation.h"
#include "client_fw/tracker/rendering.h"
#include "client_fw/tracker/tracking.h"
#include "server/robots/links/tracker_message.h"

namespace pheromone {
namespace {

constexpr int64_t kPicturePeriodMs = 250;
constexpr int64_t kPictureAgeMs = 100;  // from the exposure until the pose is at the server
constexpr int64_t kSettledMs = 15'000;
constexpr double kX = 2;
constexpr double kY = 1.5;
constexpr double kHalfM = 0.7;   // of the straights
constexpr double kRadius = 0.8;  // of the bends
constexpr double kOnPathM = 0.1;
constexpr double kOffPathM = 0.4;
constexpr size_t kRobots = 6;

int64_t camera_ms = 40'000;  // set by main

constexpr char kScenario[] = R"(
[map]
width_m = 4.0
height_m = 3.0
cell_m = 0.05
[antennas]
bias_m = 0.33
[[pheromone]]
type = 2
name = "path"
core_m = 0.1
sigma_m = 0.3
tau_s = 0
quantum = 0.125
maximum = 1.0
directional = true
[[robots]]
pheromone = "path"
starts = [[2, 0.7, 0]]
speed_m_per_s = 0.15
[[path]]
name = "stadium"
pheromone = "path"
shape = "polyline"
points_m = )";

// The place `part` of the way around, counter-clockwise, and its heading.
sim::PlanePose PlaceOnPath(double part) {
  constexpr double kBend = std::numbers::pi * kRadius;
  constexpr double kStraight = 2 * kHalfM;
  double rest = part * 2 * (kBend + kStraight);
  double side = 1;  // first the lower straight and the right bend, then the others
  if (rest >= kBend + kStraight) {
    rest -= kBend + kStraight;
    side = -1;
  }
  const double turned = std::max(0.0, rest - kStraight) / kRadius;
  const double along = std::min(rest, kStraight) - kHalfM;
  return {kX + side * (along + kRadius * std::sin(turned)), kY - side * kRadius * std::cos(turned),
          turned + (side < 0 ? std::numbers::pi : 0)};
}

std::string ScenarioText() {
  constexpr int kPoints = 160;
  std::string points;
  for (int i = 0; i <= kPoints; ++i) {
    const sim::PlanePose place = PlaceOnPath(static_cast<double>(i % kPoints) / kPoints);
    points += fmt::format("{}[{:.4f}, {:.4f}]", i == 0 ? "" : ", ", place.x_m, place.y_m);
  }
  return fmt::format("{}[{}]\n", kScenario, points);
}

const tracker::RenderedCamera kCamera{.width = 640,
                                      .height = 480,
                                      .lens = {450, {320, 240}, -0.1, 0},
                                      .x_m = 2,
                                      .y_m = 1.4,
                                      .z_m = 3.3,
                                      .turn_rad = 0.1,
                                      .tilt_rad = 0.03};
constexpr double kTagHeightM = 0.25;
constexpr double kRobotEdgeM = 0.16;
constexpr double kFloorEdgeM = 0.24;

swarm::SimulationConfig SwarmOnThePath() {
  const auto scenario = swarm::ParseScenario(ScenarioText(), "stadium.toml");
  EXPECT_TRUE(scenario.ok()) << scenario.ErrorOr("");
  swarm::SimulationConfig config;
  config.engine = scenario.value().engine;
  config.radio.baud = scenario.value().timing.baud;
  config.radio.turnaround_ns = scenario.value().timing.turnaround_ns;
  config.server.delay_ns = scenario.value().timing.server_delay_ns;
  for (size_t i = 0; i < kRobots; ++i) {
    swarm::RobotConfig robot;
    robot.client = scenario.value().groups.front().client;
    robot.client.id = static_cast<uint8_t>(i + 1);
    robot.start = PlaceOnPath(static_cast<double>(i) / kRobots);
    // In turn, one wheel is taken for larger than it is.
    (i % 2 == 0 ? robot.drive.left_scale : robot.drive.right_scale) = 1.05;
    config.robots.push_back(robot);
  }
  return config;
}

// The camera with its program, beside a simulation.
class CameraAbove {
 public:
  explicit CameraAbove(swarm::Simulation* simulation)
      : simulation_(simulation),
        link_(simulation->service().Inspect(
            [](const auto& engine) { return engine.config().links.front().name; })),
        renderer_(kCamera, Floor(), {}, {}),
        detector_(1),
        tracking_(SettingsOf(link_)) {}

  void Look() {
    std::vector<tracker::RenderedTag> tags;
    for (size_t i = 0; i < kRobots; ++i) {
      const sim::PlanePose pose = simulation_->robot(i).true_pose();
      tags.push_back({static_cast<int>(i) + 1, pose.x_m, pose.y_m, pose.heading_rad, kRobotEdgeM,
                      kTagHeightM});
    }
    const tracker::View view = tracking_.Locate(detector_.Detect(renderer_.Render(tags)));
    seen_ += view.seen.size();
    possible_ += kRobots;
    for (std::string& datagram : tracker::Datagrams(view.seen)) {
      sent_.emplace_back(simulation_->now_ms() + kPictureAgeMs, std::move(datagram));
    }
  }

  // What has arrived by now.
  void Deliver() {
    while (!sent_.empty() && sent_.front().first <= simulation_->now_ms()) {
      std::vector<engine::PoseObserved> poses;
      links::ForEachTrackerLine(sent_.front().second, [&](std::string_view line) {
        const auto parsed = links::ParseTrackerLine(line);
        ASSERT_TRUE(std::holds_alternative<links::TrackerLine>(parsed)) << line;
        const auto& robot = std::get<links::TrackerLine>(parsed);
        EXPECT_EQ(robot.link, link_);
        const auto& fix = std::get<links::PoseFix>(robot.fix);
        poses.push_back({0,
                         robot.id,
                         {{std::llround(fix.x_m * 1e6), std::llround(fix.y_m * 1e6)},
                          static_cast<uint16_t>(std::llround(fix.heading_deg * 65536 / 360))},
                         1000});
      });
      simulation_->service().Observe(poses);
      sent_.pop_front();
    }
  }

  double seen() const { return static_cast<double>(seen_) / static_cast<double>(possible_); }

 private:
  static std::vector<tracker::RenderedTag> Floor() {
    std::vector<tracker::RenderedTag> floor;
    for (const double x : {0.3, 3.7}) {
      for (const double y : {0.2, 2.7}) {
        floor.push_back({500 + static_cast<int>(floor.size()), x, y, 0, kFloorEdgeM, 0});
      }
    }
    return floor;
  }

  static tracker::Settings SettingsOf(const std::string& link) {
    tracker::Settings settings;
    settings.lens = kCamera.lens;
    settings.floor_edge_m = kFloorEdgeM;
    settings.robot_edge_m = kRobotEdgeM;
    for (const tracker::RenderedTag& it : Floor()) {
      settings.floor.push_back({it.id, {it.x_m, it.y_m}, it.heading_rad});
    }
    for (int id = 1; id <= static_cast<int>(kRobots); ++id) {
      settings.robots.push_back({id, link, id, kTagHeightM});
    }
    return settings;
  }

  swarm::Simulation* simulation_;
  std::string link_;
  tracker::Renderer renderer_;
  tracker::Detector detector_;
  tracker::Tracking tracking_;
  std::deque<std::pair<int64_t, std::string>> sent_;
  size_t seen_ = 0;
  size_t possible_ = 0;
};

// How far a robot is from the path.
double AwayFromPath(const swarm::Simulation& simulation, size_t robot) {
  const sim::PlanePose pose = simulation.robot(robot).true_pose();
  const double beyond_m = std::max(0.0, std::abs(pose.x_m - kX) - kHalfM);
  return std::abs(std::hypot(beyond_m, pose.y_m - kY) - kRadius);
}

TEST(TrackedSwarm, StaysOnThePathAlthoughItsOdometryIsWrong) {
  swarm::Simulation simulation(SwarmOnThePath());
  CameraAbove camera(&simulation);
  double most_m = 0;
  double moved_m = 0;
  sim::PlanePose last = simulation.robot(0).true_pose();
  for (int64_t ms = 0; ms <= camera_ms; ++ms) {
    simulation.RunTo(ms);
    if (ms % kPicturePeriodMs == 0) {
      camera.Look();
      const sim::PlanePose pose = simulation.robot(0).true_pose();
      moved_m += std::hypot(pose.x_m - last.x_m, pose.y_m - last.y_m);
      last = pose;
      for (size_t i = 0; i < kRobots && ms >= kSettledMs; ++i) {
        const double away_m = AwayFromPath(simulation, i);
        most_m = std::max(most_m, away_m);
        ASSERT_LT(away_m, kOnPathM) << "robot " << i + 1 << " after " << ms << " ms";
      }
    }
    camera.Deliver();
  }
  RecordProperty("farthest_mm", static_cast<int>(1000 * most_m));
  RecordProperty("tags_seen_percent", static_cast<int>(100 * camera.seen()));
  EXPECT_GT(camera.seen(), 0.95);
  EXPECT_GT(moved_m, 0.1 * static_cast<double>(camera_ms) / 1000);  // and it does drive
}

TEST(TrackedSwarm, LeavesThePathWithoutTheCamera) {
  swarm::Simulation simulation(SwarmOnThePath());
  std::vector<double> most_m(kRobots);
  for (int64_t ms = 0; ms <= 300'000; ms += 100) {
    simulation.RunTo(ms);
    for (size_t i = 0; i < kRobots; ++i) {
      most_m[i] = std::max(most_m[i], AwayFromPath(simulation, i));
    }
  }
  for (size_t i = 0; i < kRobots; ++i) {
    EXPECT_GT(most_m[i], kOffPathM) << "robot " << i + 1;
  }
}

}  // namespace
}  // namespace pheromone

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  if (argc == 3 && std::string(argv[1]) == "--seconds") {
    pheromone::camera_ms = 1000 * std::atoll(argv[2]);
  }
  return RUN_ALL_TESTS();
}
