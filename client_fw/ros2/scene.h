// Robots, their antennas, trails, names and states, and tags, as markers for RViz.
//
//   Scene scene("map");
//   scene.SetLaws(laws);                        // of /api/v1/laws: where the antennas are
//   scene.SetTags(tags);                        // of /api/v1/tags
//   scene.Publish(clients, publisher);          // of /api/v1/clients
//
// Markers that are not published again vanish after kMarkerS. One thread.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include <boost/json/value.hpp>

#include "client_fw/ros2/node.h"
#include "client_fw/ros2/text.h"

namespace pheromone::ros2 {

constexpr int32_t kMarkerS = 3;

class Scene {
 public:
  explicit Scene(std::string frame) : frame_(std::move(frame)) {}

  void SetLaws(const boost::json::value& laws);
  void SetTags(const boost::json::value& tags);
  void Publish(const boost::json::value& clients, const Publisher<MarkerArray>& publisher);

 private:
  using Point = geometry_msgs_msg_dds__Point_;
  using Marker = visualization_msgs_msg_dds__Marker_;
  struct Tag {
    std::string name;
    Point at;
  };

  /// A new marker, valid until the next.
  Marker* Add(const std::string& kind, int32_t id, int32_t type,
              const std_msgs_msg_dds__ColorRGBA_& color);
  void AddLabel(const std::string& kind, int32_t id, const Point& at, std::string text);
  void AddRobot(const boost::json::value& client);
  std::string* Keep(std::string text);

  const std::string frame_;
  double antenna_m_ = 0;  // from the middle
  double forward_m_ = 0;
  double antenna_angle_ = 0;
  std::vector<Tag> tags_;
  std::map<std::string, int32_t> ids_;            // of robots, by link and ID
  std::map<int32_t, std::vector<Point>> trails_;  // of robots
  // Of the message in the making.
  std::vector<Marker> markers_;
  std::deque<std::string> texts_;
  std::deque<std::vector<Point>> points_;
};

}  // namespace pheromone::ros2
