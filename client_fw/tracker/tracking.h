// From the tags in a picture to the poses of robots.
//
//   Tracking tracking(settings);
//   const View view = tracking.Locate(detector.Detect(picture));
//   for (const std::string& datagram : Datagrams(view.seen)) { Send(datagram); }
//
// The camera's place follows from the floor tags, anew in each picture: from the mean of where each
// of them was seen so far, so one that a robot hides still counts. If one is seen elsewhere, the
// camera was moved, and the means begin again; while none is seen, nobody knows, so after
// kMaxBlind pictures there is no camera. Sans I/O. One thread; the same tags give the same poses.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client_fw/tracker/detector.h"
#include "client_fw/tracker/geometry.h"
#include "client_fw/tracker/settings.h"

namespace pheromone::tracker {

/// So many pictures without any floor tag, one after the other, still have a camera.
constexpr int kMaxBlind = 10;

struct SeenRobot {
  RobotTag robot;
  Point place = {0, 0};    ///< of the robot, on the map
  double heading_rad = 0;  ///< likewise
  TagPose tag;
  Corners corners;
};

/// A robot's tag that was found but cannot be it.
struct RejectedTag {
  RobotTag robot;
  Corners corners;
  std::string why;
};

struct View {
  std::optional<CameraFit> camera;
  std::string why_no_camera;  ///< if there is none: no robot is seen then
  std::vector<SeenRobot> seen;
  std::vector<RejectedTag> rejected;
  std::vector<RobotTag> missed;  ///< the other robots
  std::vector<int> floor_seen;   ///< tags of the floor in this picture
  bool moved = false;            ///< a floor tag is elsewhere than before
};

class Tracking {
 public:
  explicit Tracking(Settings settings) : settings_(std::move(settings)) {}

  View Locate(std::span<const Detection> found);

 private:
  struct Mean {
    Corners corners;
    int count = 0;
  };

  void LocateCamera(const std::map<int, Corners>& tags, View* view);
  void LocateRobots(const std::map<int, Corners>& tags, View* view) const;

  Settings settings_;
  std::map<int, Mean> floor_;
  int blind_ = 0;  // pictures since a floor tag was seen
};

/// The messages to a [[tracker]] (server/robots/links/tracker_message.h), no datagram longer than
/// what Ethernet carries in one piece.
std::vector<std::string> Datagrams(std::span<const SeenRobot> seen);

}  // namespace pheromone::tracker
