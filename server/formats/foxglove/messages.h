// The messages for viewers, which protoc makes from the .proto files of this folder, and what fills
// them in.
//
//   SceneUpdate update;
//   AddDeletion("radio-a/7", now_ns, &update);
//   std::string payload = update.SerializeAsString();
//
// Lengths are metres, angles radians counter-clockwise from +x, times nanoseconds since 1970, and
// the frame is "map" unless it is given. Functions of their arguments; any thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/formats/foxglove/grid.pb.h"
#include "server/formats/foxglove/log.pb.h"
#include "server/formats/foxglove/scene.pb.h"
#include "server/formats/foxglove/transforms.pb.h"

namespace pheromone::foxglove {

using ::foxglove::FrameTransforms;
using ::foxglove::Log;
using ::foxglove::SceneEntity;
using ::foxglove::SceneUpdate;

constexpr std::string_view kMapFrame = "map";

struct Point {
  double x = 0;
  double y = 0;
  double z = 0;
};

/// A position in the plane and a heading about the z axis.
struct Pose {
  Point position = {};
  double yaw_rad = 0;
};

void Set(const Point& point, ::foxglove::Vector3* to);
void Set(const Pose& pose, ::foxglove::Pose* to);

/// A raster of one byte for each cell, row by row from the bottom.
struct GridLayout {
  Point corner = {};  ///< the lower left corner of the lower left cell
  uint32_t columns = 0;
  double cell_m = 0;
  std::vector<std::string> names = {};  ///< of the value
};
std::string EncodeGrid(uint64_t time_ns, const GridLayout& layout, std::string_view cells);
/// Message pheromone.Tiles.
std::string EncodeTiles(std::string_view data);

/// An entity replaces the one with the same ID on the same topic.
SceneEntity* AddEntity(std::string id, uint64_t time_ns, SceneUpdate* update);
void AddDeletion(std::string id, uint64_t time_ns, SceneUpdate* update);
/// Of all earlier entities of the topic.
void AddDeletionOfAll(uint64_t time_ns, SceneUpdate* update);

/// `pose` is that of the child in the parent.
void AddTransform(std::string parent, std::string child, const Pose& pose, uint64_t time_ns,
                  FrameTransforms* transforms);

/// `name` is what it is about.
Log MakeLog(Log::Level level, std::string name, std::string message, uint64_t time_ns);

}  // namespace pheromone::foxglove
