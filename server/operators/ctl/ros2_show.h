// A recording as a bag of ROS 2: what `ros2 bag play` publishes.
//
//   /pheromone/NAME                nav_msgs/msg/OccupancyGrid     when it has changed
//   /obstacles                     nav_msgs/msg/OccupancyGrid     100 where one is
//   /robots/LINK/robot_ID/pose     geometry_msgs/msg/PoseStamped  ten times a second
//   /tf                            tf2_msgs/msg/TFMessage         the frames robot/LINK/ID in "map"
//
// A cell of a pheromone is 0 to 98, which is the pheromone's maximum, but at least 1 where there is
// something, and -1 where an obstacle is: below 99 and 100, which cost maps show as walls.
#pragma once

#include <map>
#include <string>

#include "server/operators/ctl/mcap_show.h"

namespace pheromone::ctl {

class Ros2Show : public McapShow {
 public:
  using McapShow::McapShow;

 protected:
  void Show(const Moment& moment) override;
  void ShowGrid(const field::PheromoneLaw& law, const web::PheromoneRaster& raster,
                uint64_t time_ns) override;
  mcap::Channel ChannelOf(const std::string& topic, std::string_view schema) const override;

 private:
  /// The part of topics that stands for a name, and for no other one.
  const std::string& PartOf(const std::string& name);

  std::map<std::string, std::string> parts_;  // by name
};

}  // namespace pheromone::ctl
