#include "server/operators/ctl/ros2_show.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "server/base/units.h"
#include "server/formats/foxglove/scene.h"
#include "server/formats/ros/messages.h"
#include "server/operators/control/scenes.h"
#include "server/operators/control/views.h"

namespace pheromone::ctl {
namespace {

ros::Pose RosPose(const field::PoseUm& pose) {
  return {.x_m = Metres(pose.position.x),
          .y_m = Metres(pose.position.y),
          .yaw_rad = Radians(pose.heading)};
}

}  // namespace

mcap::Channel Ros2Show::ChannelOf(const std::string& topic, std::string_view schema) const {
  return {.topic = topic,
          .encoding = "cdr",
          .schema_name = std::string(schema),
          .schema_encoding = "ros2msg",
          .schema = ros::DefinitionOf(schema)};
}

void Ros2Show::Show(const Moment& moment) {
  std::vector<ros::Transform> transforms;
  for (const control::ClientView& client : moment.clients) {
    if (client.pose_source == control::PoseSource::kNone) {
      continue;
    }
    const ros::Pose pose = RosPose(client.pose);
    transforms.push_back({foxglove::RobotFrame(client.link, client.id), pose});
    Write("/robots/" + links_.PartOf(client.link) + "/robot_" + std::to_string(client.id) + "/pose",
          ros::kPoseStamped, moment.time_ns, ros::EncodePose(moment.time_ns, pose));
  }
  Write("/tf", ros::kTransforms, moment.time_ns, ros::EncodeTransforms(moment.time_ns, transforms));
  if (moment.is_new) {
    const web::ObstacleRaster obstacles = web::ObstaclesOf(moment.view.config);
    std::string cells = obstacles.cells;
    std::replace(cells.begin(), cells.end(), '\1', static_cast<char>(ros::kObstacle));
    Write(std::string(ros::kObstaclesTopic), ros::kOccupancyGrid, moment.time_ns,
          ros::EncodeGrid(moment.time_ns,
                          {.columns = obstacles.layout.columns,
                           .cell_m = obstacles.layout.cell_m,
                           .x_m = obstacles.layout.corner.x,
                           .y_m = obstacles.layout.corner.y},
                          cells));
  }
}

void Ros2Show::ShowGrid(const field::PheromoneLaw& law, const web::PheromoneRaster& raster,
                        uint64_t time_ns) {
  std::array<char, 256> cell_of{};
  const double per_byte = raster.scale() / web::PheromoneRaster::kFullScale / web::MaximumOf(law);
  for (size_t byte = 1; byte <= web::PheromoneRaster::kFullScale; ++byte) {
    cell_of[byte] = static_cast<char>(ros::LevelOf(static_cast<double>(byte) * per_byte));
  }
  cell_of[web::PheromoneRaster::kBlocked] = static_cast<char>(ros::kUnknown);
  std::string cells(raster.bytes());
  for (char& cell : cells) {
    cell = cell_of[static_cast<uint8_t>(cell)];
  }
  const field::PointUm corner = raster.twice_corner_um();
  Write("/pheromone/" + pheromones_.PartOf(law.name), ros::kOccupancyGrid, time_ns,
        ros::EncodeGrid(time_ns,
                        {.columns = static_cast<uint32_t>(raster.columns()),
                         .cell_m = Metres(raster.cell_um()),
                         .x_m = Metres(corner.x) / 2,
                         .y_m = Metres(corner.y) / 2},
                        cells));
}

}  // namespace pheromone::ctl
