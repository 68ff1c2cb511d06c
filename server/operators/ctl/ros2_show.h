// A recording as a bag of ROS 2: what `ros2 bag play` publishes.
//
//   /pheromone/NAME                nav_msgs/msg/OccupancyGrid     when it has changed
//   /pheromone/obstacles           nav_msgs/msg/OccupancyGrid     100 where one is
//   /robots/LINK/robot_ID/pose     geometry_msgs/msg/PoseStamped  ten times a second
//   /tf                            tf2_msgs/msg/TFMessage         the frames robot/LINK/ID in "map"
//
// Names and cells are those of live topics (server/formats/ros/names.h).
#pragma once

#include <string>

#include "server/formats/ros/names.h"
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
  ros::TopicNames links_;
  ros::TopicNames pheromones_ = ros::PheromoneNames();
};

}  // namespace pheromone::ctl
