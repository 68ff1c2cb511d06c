#include "client_fw/tracker/tracking.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

namespace pheromone::tracker {
namespace {

constexpr size_t kMinFloorSeen = 3;
constexpr double kMovedPx = 3;
constexpr int kMaxWeight = 50;  // pictures that a mean remembers
constexpr double kMaxEdgeError = 0.1;
constexpr double kMaxRmsPx = 2;
constexpr size_t kMaxDatagram = 1400;
constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

// The tags of a picture. One that is there twice is not known to be either.
std::map<int, Corners> ByNumber(std::span<const Detection> found) {
  std::map<int, Corners> tags;
  std::set<int> twice;
  for (const Detection& it : found) {
    if (!tags.emplace(it.id, it.corners).second) {
      twice.insert(it.id);
    }
  }
  for (const int tag : twice) {
    tags.erase(tag);
  }
  return tags;
}

double FarthestOf(const Corners& a, const Corners& b) {
  double most = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    most = std::max(most, (a[i] - b[i]).norm());
  }
  return most;
}

}  // namespace

View Tracking::Locate(std::span<const Detection> found) {
  View view;
  const std::map<int, Corners> tags = ByNumber(found);
  LocateCamera(tags, &view);
  LocateRobots(tags, &view);
  return view;
}

void Tracking::LocateCamera(const std::map<int, Corners>& tags, View* view) {
  for (const FloorTag& it : settings_.floor) {
    const auto tag = tags.find(it.tag);
    if (tag != tags.end()) {
      view->floor_seen.push_back(it.tag);
      const auto mean = floor_.find(it.tag);
      view->moved |=
          mean != floor_.end() && FarthestOf(mean->second.corners, tag->second) > kMovedPx;
    }
  }
  if (view->moved) {
    floor_.clear();
  }
  for (const int tag : view->floor_seen) {
    Mean& mean = floor_[tag];
    mean.count = std::min(mean.count + 1, kMaxWeight);
    for (size_t i = 0; i < mean.corners.size(); ++i) {
      const Point last = mean.count > 1 ? mean.corners[i] : tags.at(tag)[i];
      mean.corners[i] = last + (tags.at(tag)[i] - last) / mean.count;
    }
  }
  if (floor_.size() < kMinFloorSeen) {
    view->why_no_camera =
        fmt::format("{} floor tags were seen, expected at least {}", floor_.size(), kMinFloorSeen);
    return;
  }
  blind_ = view->floor_seen.empty() ? std::min(blind_ + 1, kMaxBlind + 1) : 0;
  if (blind_ > kMaxBlind) {
    view->why_no_camera = fmt::format(
        "no floor tag was seen in the last {} pictures, expected at least one", kMaxBlind);
    return;
  }
  std::vector<Match> matches;
  for (const FloorTag& it : settings_.floor) {
    const auto mean = floor_.find(it.tag);
    if (mean != floor_.end()) {
      const Corners square = SquareAt(it.place, it.heading_rad, settings_.floor_edge_m);
      for (size_t i = 0; i < square.size(); ++i) {
        matches.push_back({square[i], mean->second.corners[i]});
      }
    }
  }
  Result<CameraFit> camera = FitCamera(settings_.lens, matches);
  if (camera.ok()) {
    view->camera = camera.value();
  } else {
    view->why_no_camera = camera.error();
  }
}

void Tracking::LocateRobots(const std::map<int, Corners>& tags, View* view) const {
  for (const RobotTag& robot : settings_.robots) {
    const auto found = tags.find(robot.tag);
    if (found == tags.end() || !view->camera) {
      view->missed.push_back(robot);
      continue;
    }
    const auto tag =
        FitTag(view->camera->camera, found->second, settings_.robot_edge_m, robot.height_m);
    if (!tag) {
      view->rejected.push_back({robot, found->second, "it is not on the plane of its height"});
    } else if (std::abs(tag->edge_m / settings_.robot_edge_m - 1) > kMaxEdgeError) {
      view->rejected.push_back(
          {robot, found->second,
           fmt::format("its edge seems to be {:.3f} m, expected robot_edge_m, {:.3f} m, at "
                       "height_m, {:.3f} m",
                       tag->edge_m, settings_.robot_edge_m, robot.height_m)});
    } else if (tag->rms_px > kMaxRmsPx) {
      view->rejected.push_back(
          {robot, found->second,
           fmt::format("its corners are {:.1f} pixels from a square, expected at most {:.0f}",
                       tag->rms_px, kMaxRmsPx)});
    } else {
      const double heading = tag->heading_rad - robot.turn_rad;
      const Point ahead(std::cos(heading), std::sin(heading));
      const Point left(-ahead.y(), ahead.x());
      view->seen.push_back({robot, tag->centre - robot.forward_m * ahead - robot.left_m * left,
                            std::remainder(heading, 2 * std::numbers::pi), *tag, found->second});
    }
  }
}

std::vector<std::string> Datagrams(std::span<const SeenRobot> seen) {
  std::vector<std::string> datagrams;
  for (const SeenRobot& it : seen) {
    const std::string line =
        fmt::format("pose {} {} {:.4f} {:.4f} {:.2f}\n", it.robot.link, it.robot.id, it.place.x(),
                    it.place.y(), it.heading_rad * kDegreesPerRadian);
    if (datagrams.empty() || datagrams.back().size() + line.size() > kMaxDatagram) {
      datagrams.emplace_back();
    }
    datagrams.back() += line;
  }
  return datagrams;
}

}  // namespace pheromone::tracker
