#include "client_fw/ros2/scene.h"

#include <cmath>
#include <numbers>
#include <utility>

#include <boost/json/array.hpp>

#include "client_fw/ros2/state_style.h"
#include "server/operators/ctl/json_read.h"

namespace pheromone::ros2 {
namespace {

namespace json = boost::json;

// Types of visualization_msgs/Marker.
constexpr int32_t kArrow = 0;
constexpr int32_t kCube = 1;
constexpr int32_t kLineStrip = 4;
constexpr int32_t kSphereList = 7;
constexpr int32_t kText = 9;

constexpr double kRadPerDegree = std::numbers::pi / 180;
constexpr double kTrailStepM = 0.02;
constexpr size_t kTrailPoints = 500;

}  // namespace

void Scene::SetLaws(const json::value& laws) {
  const json::value& antennas = ctl::At(laws, "antennas");
  antenna_m_ = ctl::NumberAt(antennas, "distance_m") / 2;
  forward_m_ = ctl::NumberAt(antennas, "forward_m");
  antenna_angle_ = ctl::NumberAt(antennas, "angle_deg") * kRadPerDegree;
}

void Scene::SetTags(const json::value& tags) {
  tags_.clear();
  for (const json::value& tag : ctl::ItemsAt(tags, "tags")) {
    if (ctl::At(tag, "x_m").is_number() && ctl::At(tag, "y_m").is_number()) {
      tags_.push_back(
          {ctl::TextAt(tag, "name"), {ctl::NumberAt(tag, "x_m"), ctl::NumberAt(tag, "y_m"), 0}});
    }
  }
}

std::string* Scene::Keep(std::string text) {
  texts_.push_back(std::move(text));
  return &texts_.back();
}

Scene::Marker* Scene::Add(const std::string& kind, int32_t id, int32_t type, const Color& color) {
  Marker marker{};
  marker.header = MakeHeader(frame_);
  marker.ns = Text(*Keep(kind));
  marker.id = id;
  marker.type = type;
  marker.pose.orientation.w = 1;
  marker.color = color;
  marker.lifetime.sec = kMarkerS;
  markers_.push_back(marker);
  return &markers_.back();
}

void Scene::AddLabel(const std::string& kind, int32_t id, const Point& at, std::string text) {
  Marker* label = Add(kind, id, kText, kBlue);
  label->pose.position = {at.x, at.y, 0.3};
  label->scale.z = 0.12;
  label->text = Text(*Keep(std::move(text)));
}

void Scene::AddRobot(const json::value& client) {
  const json::value& pose = ctl::At(client, "pose");
  if (!pose.is_object()) {
    return;
  }
  const std::string number = std::to_string(ctl::CountAt(client, "id"));
  const std::string name = ctl::TextAt(client, "link") + "/" + number;
  const int32_t id = ids_.emplace(name, static_cast<int32_t>(ids_.size())).first->second;
  const std::string state = ctl::TextAt(ctl::At(client, "state"), "is");
  const Point at{ctl::NumberAt(pose, "x_m"), ctl::NumberAt(pose, "y_m"), 0};
  const double yaw = ctl::NumberAt(pose, "heading_deg") * kRadPerDegree;

  Marker* arrow = Add("robots", id, kArrow, StyleOf(state).color);
  arrow->pose = {at, ToQuaternion(yaw)};
  arrow->scale = {0.3, 0.08, 0.08};

  Marker* antennas = Add("antennas", id, kSphereList, kBlue);
  antennas->scale = {0.06, 0.06, 0.06};
  std::vector<Point>& ends = points_.emplace_back();
  for (const double side : {1.0, -1.0}) {
    const double angle = yaw + side * antenna_angle_;
    ends.push_back({at.x + forward_m_ * std::cos(yaw) + antenna_m_ * std::cos(angle),
                    at.y + forward_m_ * std::sin(yaw) + antenna_m_ * std::sin(angle), 0});
  }
  PointAt(&antennas->points, &ends);

  std::vector<Point>& trail = trails_[id];
  if (trail.empty() || std::hypot(at.x - trail.back().x, at.y - trail.back().y) > kTrailStepM) {
    trail.push_back(at);
  }
  if (trail.size() > kTrailPoints) {
    trail.erase(trail.begin());
  }
  if (trail.size() > 1) {
    Marker* line = Add("trails", id, kLineStrip, StyleOf(state).color);
    line->scale.x = 0.02;
    PointAt(&line->points, &trail);
  }
  AddLabel("labels", id, at, name + ": " + state);
}

void Scene::Publish(const json::value& clients, const Publisher<MarkerArray>& publisher) {
  markers_.clear();
  texts_.clear();
  points_.clear();
  for (const json::value& client : ctl::ItemsAt(clients, "clients")) {
    AddRobot(client);
  }
  int32_t id = 0;
  for (const Tag& tag : tags_) {
    Marker* cube = Add("tags", id, kCube, kOrange);
    cube->pose.position = tag.at;
    cube->scale = {0.1, 0.1, 0.02};
    AddLabel("tag labels", id, tag.at, tag.name);
    ++id;
  }
  MarkerArray message{};
  PointAt(&message.markers, &markers_);
  publisher.Publish(message);
}

}  // namespace pheromone::ros2
