#include "client_fw/tracker/simulated_swarm.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pheromone::tracker {
namespace {

constexpr double kTiltRad = 0.05;
constexpr double kTurnRad = 0.1;
constexpr double kRoom = 1.15;  // around the floor tags
constexpr double kAxes = 0.7;
constexpr double kRadiansPerSecond = 0.1;

}  // namespace

SimulatedSwarm::SimulatedSwarm(const Settings& settings, const Blemishes& blemishes)
    : settings_(settings) {
  Point least = settings.floor.front().place;
  Point most = least;
  std::vector<RenderedTag> floor;
  for (const FloorTag& it : settings.floor) {
    least = least.cwiseMin(it.place);
    most = most.cwiseMax(it.place);
    floor.push_back({it.tag, it.place.x(), it.place.y(), it.heading_rad, settings.floor_edge_m, 0});
  }
  middle_ = (least + most) / 2;
  axes_ = kAxes * (most - least) / 2;
  const Point sides = kRoom * (most - least) + Point(2, 2) * settings.floor_edge_m;
  RenderedCamera camera;
  camera.width = settings.width;
  camera.height = settings.height;
  camera.lens = settings.lens;
  camera.z_m =
      settings.lens.focal_px * std::max(sides.x() / settings.width, sides.y() / settings.height);
  camera.turn_rad = kTurnRad;
  camera.tilt_rad = kTiltRad;
  // It looks ahead of its foot.
  camera.x_m = middle_.x() + camera.z_m * std::tan(kTiltRad) * std::sin(kTurnRad);
  camera.y_m = middle_.y() - camera.z_m * std::tan(kTiltRad) * std::cos(kTurnRad);
  renderer_.emplace(camera, floor, std::span<const RenderedCable>(), blemishes);
}

TruePose SimulatedSwarm::PoseAt(double seconds, size_t index) const {
  const double angle = 2 * std::numbers::pi * static_cast<double>(index) /
                           static_cast<double>(settings_.robots.size()) +
                       kRadiansPerSecond * seconds;
  return {middle_ + Point(axes_.x() * std::cos(angle), axes_.y() * std::sin(angle)),
          std::atan2(axes_.y() * std::cos(angle), -axes_.x() * std::sin(angle))};
}

Picture SimulatedSwarm::PictureAt(double seconds) {
  std::vector<RenderedTag> tags;
  for (size_t i = 0; i < settings_.robots.size(); ++i) {
    const RobotTag& robot = settings_.robots[i];
    const TruePose pose = PoseAt(seconds, i);
    const double cosine = std::cos(pose.heading_rad);
    const double sine = std::sin(pose.heading_rad);
    tags.push_back({robot.tag, pose.place.x() + robot.forward_m * cosine - robot.left_m * sine,
                    pose.place.y() + robot.forward_m * sine + robot.left_m * cosine,
                    pose.heading_rad + robot.turn_rad, settings_.robot_edge_m, robot.height_m});
  }
  return renderer_->Render(tags);
}

}  // namespace pheromone::tracker
