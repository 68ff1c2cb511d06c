// The messages for viewers, and their encoding as protobuf: grids, scenes, frame transforms and log
// entries (schema.h).
//
//   Grid grid{.time_ns = now, .corner = {{0, 0, 0}}, .columns = 512, .cell_m = 0.01, .data =
//   bytes}; std::string payload = Encode(grid);
//
// Lengths are metres, angles radians counter-clockwise from +x, times nanoseconds since 1970, and
// the frame is "map" unless it is given. Functions of their arguments; any thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace pheromone::foxglove {

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

struct Colour {
  double r = 0;  ///< each from 0 to 1
  double g = 0;
  double b = 0;
  double a = 1;
};

/// One byte for each cell, row by row from the bottom.
struct Grid {
  uint64_t time_ns = 0;
  Pose corner = {};  ///< the lower left corner of the lower left cell
  uint32_t columns = 0;
  double cell_m = 0;
  std::string_view field = "level";  ///< the name of the value
  std::string_view meaning = {};     ///< another name of the same value, which may change
  std::string_view data = {};        ///< columns * rows
};

struct Arrow {
  Pose tail = {};
  double shaft_length = 0;
  double shaft_diameter = 0;
  double head_length = 0;
  double head_diameter = 0;
  Colour colour = {};
};

struct Sphere {
  Point centre = {};
  double diameter = 0;
  Colour colour = {};
};

/// A straight line from each point to the next one.
struct LineStrip {
  std::vector<Point> points = {};
  double thickness = 0;
  bool in_pixels = false;  ///< of the thickness
  bool closed = false;     ///< a last line leads back to the first point
  Colour colour = {};
};

/// Faces the viewer.
struct Text {
  Point centre = {};
  std::string text = {};
  double font_size = 0;
  bool in_pixels = false;  ///< of the font's size
  Colour colour = {};
};

/// Replaces the entity with the same ID on the same topic.
struct Entity {
  std::string id = {};
  std::string frame = std::string(kMapFrame);
  uint64_t lifetime_ns = 0;  ///< 0: until it is replaced or deleted
  std::vector<std::pair<std::string, std::string>> metadata = {};
  std::vector<Arrow> arrows = {};
  std::vector<Sphere> spheres = {};
  std::vector<LineStrip> lines = {};
  std::vector<Text> texts = {};
};

struct SceneUpdate {
  uint64_t time_ns = 0;
  bool delete_all = false;                ///< first, all earlier entities of the topic
  std::vector<std::string> deleted = {};  ///< IDs of entities that are gone
  std::vector<Entity> entities = {};
};

struct FrameTransform {
  std::string child = {};
  Pose pose = {};  ///< of the child in the parent
  std::string parent = std::string(kMapFrame);
};

struct FrameTransforms {
  uint64_t time_ns = 0;
  std::vector<FrameTransform> transforms = {};
};

enum class LogLevel : uint8_t { kUnknown, kDebug, kInfo, kWarning, kError, kFatal };

struct Log {
  uint64_t time_ns = 0;
  LogLevel level = LogLevel::kInfo;
  std::string message = {};
  std::string name = {};  ///< of what it is about
};

std::string Encode(const Grid& grid);
std::string Encode(const SceneUpdate& update);
std::string Encode(const FrameTransforms& transforms);
std::string Encode(const Log& log);

}  // namespace pheromone::foxglove
