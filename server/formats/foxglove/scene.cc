#include "server/formats/foxglove/scene.h"

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

// A colour of its own for each of the first few IDs, distinguishable by the colour-blind: Okabe and
// Ito 2008, "Color Universal Design", without black.
Colour RobotColour(uint8_t id) {
  constexpr std::array<Colour, 7> kColours = {{{0.00, 0.45, 0.70, 1},
                                               {0.90, 0.60, 0.00, 1},
                                               {0.00, 0.62, 0.45, 1},
                                               {0.80, 0.47, 0.65, 1},
                                               {0.34, 0.71, 0.91, 1},
                                               {0.84, 0.37, 0.00, 1},
                                               {0.94, 0.89, 0.26, 1}}};
  return kColours[(id + kColours.size() - 1) % kColours.size()];
}

void Set(const Colour& colour, ::foxglove::Color* to) {
  to->set_r(colour.r);
  to->set_g(colour.g);
  to->set_b(colour.b);
  to->set_a(colour.a);
}

void AddSphere(const Point& centre, double diameter, const Colour& colour, SceneEntity* entity) {
  auto* const sphere = entity->add_spheres();
  Set(Pose{centre}, sphere->mutable_pose());
  Set(Point{diameter, diameter, diameter}, sphere->mutable_size());
  Set(colour, sphere->mutable_color());
}

// Faces the viewer.
void AddLabel(const Point& centre, std::string label, const Colour& colour, SceneEntity* entity) {
  auto* const text = entity->add_texts();
  Set(Pose{centre}, text->mutable_pose());
  text->set_billboard(true);
  text->set_font_size(kLabelPx);
  text->set_scale_invariant(true);
  Set(colour, text->mutable_color());
  text->set_text(std::move(label));
}

void AddLine(::foxglove::LinePrimitive::Type type, const std::vector<Point>& points,
             const Colour& colour, SceneEntity* entity) {
  auto* const line = entity->add_lines();
  line->set_type(type);
  Set(Pose{}, line->mutable_pose());
  line->set_thickness(kLinePx);
  line->set_scale_invariant(true);
  for (const Point& point : points) {
    auto* const to = line->add_points();
    to->set_x(point.x);
    to->set_y(point.y);
    to->set_z(point.z);
  }
  Set(colour, line->mutable_color());
}

}  // namespace

std::string RobotName(std::string_view link, uint8_t id) {
  return std::string(link) + '/' + std::to_string(id);
}

std::string RobotFrame(std::string_view link, uint8_t id) {
  return "robot/" + RobotName(link, id);
}

void AddRobot(const RobotLook& robot, uint64_t time_ns, SceneUpdate* update) {
  SceneEntity* const entity = AddEntity(RobotName(robot.link, robot.id), time_ns, update);
  entity->mutable_lifetime()->set_seconds(kRobotLifetimeS);
  const auto add_fact = [entity](const std::string& key, const std::string& value) {
    auto* const fact = entity->add_metadata();
    fact->set_key(key);
    fact->set_value(value);
  };
  add_fact("link", robot.link);
  add_fact("id", std::to_string(robot.id));
  for (const auto& [key, value] : robot.facts) {
    add_fact(key, value);
  }
  const double length = robot.size_m;
  Pose tail = robot.pose;
  tail.position.x -= length / 2 * std::cos(robot.pose.yaw_rad);
  tail.position.y -= length / 2 * std::sin(robot.pose.yaw_rad);
  auto* const arrow = entity->add_arrows();
  Set(tail, arrow->mutable_pose());
  arrow->set_shaft_length(0.6 * length);
  arrow->set_shaft_diameter(0.3 * length);
  arrow->set_head_length(0.4 * length);
  arrow->set_head_diameter(0.6 * length);
  Set(RobotColour(robot.id), arrow->mutable_color());
  AddSphere(robot.left, 0.2 * length, kLeft, entity);
  AddSphere(robot.right, 0.2 * length, kRight, entity);
  Point above = robot.pose.position;
  above.z += length;
  AddLabel(above, std::to_string(robot.id), kInk, entity);
}

void AddHeadings(std::string id, const std::vector<Pose>& poses, double size_m, uint64_t time_ns,
                 SceneUpdate* update) {
  std::vector<Point> ends;
  for (const auto& [at, yaw_rad] : poses) {
    ends.push_back(at);
    ends.push_back({at.x + size_m * std::cos(yaw_rad), at.y + size_m * std::sin(yaw_rad), at.z});
  }
  AddLine(::foxglove::LinePrimitive::LINE_LIST, ends, {1, 1, 1, 1},
          AddEntity(std::move(id), time_ns, update));
}

void AddTrail(std::string_view link, uint8_t id, const std::vector<Point>& points, uint64_t time_ns,
              SceneUpdate* update) {
  Colour colour = RobotColour(id);
  colour.a = 0.6;
  AddLine(::foxglove::LinePrimitive::LINE_STRIP, points, colour,
          AddEntity(RobotName(link, id), time_ns, update));
}

void AddPlace(const PlaceLook& place, uint64_t time_ns, SceneUpdate* update) {
  constexpr int kCorners = 32;
  std::vector<Point> circle;
  for (int i = 0; i < kCorners; ++i) {
    const double angle = 2 * std::numbers::pi * i / kCorners;
    circle.push_back({place.centre.x + place.radius_m * std::cos(angle),
                      place.centre.y + place.radius_m * std::sin(angle), place.centre.z});
  }
  SceneEntity* const entity = AddEntity(place.id, time_ns, update);
  AddLine(::foxglove::LinePrimitive::LINE_LOOP, circle, place.colour, entity);
  AddLabel(place.centre, place.label, place.colour, entity);
}

}  // namespace pheromone::foxglove
