#include "server/foxglove/scene.h"

#include <array>
#include <cmath>
#include <numbers>

namespace pheromone::foxglove {
namespace {

constexpr double kLabelPx = 14;
constexpr double kLinePx = 2;
constexpr Colour kLeft{0.84, 0.37, 0.0, 1};
constexpr Colour kRight{0.0, 0.45, 0.70, 1};
constexpr Colour kInk{0.5, 0.5, 0.5, 1};

}  // namespace

std::string RobotName(std::string_view link, uint8_t id) {
  return std::string(link) + '/' + std::to_string(id);
}

std::string RobotFrame(std::string_view link, uint8_t id) {
  return "robot/" + RobotName(link, id);
}

Colour RobotColour(uint8_t id) {
  // Okabe and Ito 2008, "Color Universal Design", without black.
  constexpr std::array<Colour, 7> kColours = {{{0.00, 0.45, 0.70, 1},
                                               {0.90, 0.60, 0.00, 1},
                                               {0.00, 0.62, 0.45, 1},
                                               {0.80, 0.47, 0.65, 1},
                                               {0.34, 0.71, 0.91, 1},
                                               {0.84, 0.37, 0.00, 1},
                                               {0.94, 0.89, 0.26, 1}}};
  return kColours[(id + kColours.size() - 1) % kColours.size()];
}

Entity RobotEntity(const RobotLook& robot) {
  Entity entity;
  entity.id = RobotName(robot.link, robot.id);
  entity.lifetime_ns = kRobotLifetimeNs;
  entity.metadata = {{"link", robot.link}, {"id", std::to_string(robot.id)}};
  entity.metadata.insert(entity.metadata.end(), robot.facts.begin(), robot.facts.end());
  const double length = robot.size_m;
  Arrow arrow{robot.pose,   0.6 * length, 0.3 * length,
              0.4 * length, 0.6 * length, RobotColour(robot.id)};
  arrow.tail.position.x -= length / 2 * std::cos(robot.pose.yaw_rad);
  arrow.tail.position.y -= length / 2 * std::sin(robot.pose.yaw_rad);
  entity.arrows.push_back(arrow);
  entity.spheres = {{robot.left, 0.2 * length, kLeft}, {robot.right, 0.2 * length, kRight}};
  Point above = robot.pose.position;
  above.z += length;
  entity.texts.push_back({above, std::to_string(robot.id), kLabelPx, true, kInk});
  return entity;
}

Entity TrailEntity(std::string_view link, uint8_t id, std::vector<Point> points) {
  Entity entity;
  entity.id = RobotName(link, id);
  Colour colour = RobotColour(id);
  colour.a = 0.6;
  entity.lines.push_back({std::move(points), kLinePx, true, false, colour});
  return entity;
}

Entity PlaceEntity(std::string id, std::string label, Point centre, double radius_m,
                   const Colour& colour) {
  constexpr int kCorners = 32;
  Entity entity;
  entity.id = std::move(id);
  LineStrip circle{{}, kLinePx, true, true, colour};
  for (int i = 0; i < kCorners; ++i) {
    const double angle = 2 * std::numbers::pi * i / kCorners;
    circle.points.push_back(
        {centre.x + radius_m * std::cos(angle), centre.y + radius_m * std::sin(angle), centre.z});
  }
  entity.lines.push_back(std::move(circle));
  entity.texts.push_back({centre, std::move(label), kLabelPx, true, colour});
  return entity;
}

}  // namespace pheromone::foxglove
