// Occupancy maps of ROS (map_server, nav2_map_server): a YAML file beside a picture.
// Format: https://wiki.ros.org/map_server, "Map format"; for `raw`, nav2_map_server.
//
//   image: lab.pgm            PGM or PNG; relative to the YAML file
//   resolution: 0.05          metres a pixel
//   origin: [-10.0, -5.0, 0]  the lower left corner, metres; the yaw must be 0
//   negate: 0                 1: white is occupied
//   occupied_thresh: 0.65
//   free_thresh: 0.196
//   mode: trinary             or scale, raw; may be missing
//
//   Result<Raster> lab = LoadRosMap("lab.yaml");
//   ForEachBlockedRun(lab.value(), geometry, {}, [&mask](int32_t row, int32_t first, int32_t last)
//   {
//     mask.BlockRow(row, first, last);
//   });
//
// An occupancy is a raster of percents as in nav_msgs/OccupancyGrid, 0 free to 100 occupied; what
// has -1 there, unknown, is NaN as in every raster.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "server/base/result.h"
#include "server/field/geometry.h"
#include "server/maps/raster.h"

namespace pheromone::maps {

constexpr double kFree = 0;
constexpr double kOccupied = 100;

enum class RosMapMode { kTrinary, kScale, kRaw };

struct RosMapInfo {
  std::string image;
  int64_t resolution_um = 0;  ///< exact: a resolution that is no whole number of um is refused
  field::PointUm origin;      ///< rounded to the nearest um
  bool negate = false;
  double occupied_thresh = 0.65;
  double free_thresh = 0.196;
  RosMapMode mode = RosMapMode::kTrinary;
};

/// The YAML file. `name` is what errors call it: `name:line:column: ...`. Other keys are ignored,
/// as ROS does.
Result<RosMapInfo> ParseRosMapInfo(std::string_view yaml, std::string_view name);

/// What the picture says. With x a pixel's level in [0, 1] and p = 1 - x, or x if negated:
///
///   trinary  p > occupied_thresh: 100; p < free_thresh: 0; otherwise unknown
///   scale    the same, but floor(99 (p - free_thresh) / (occupied_thresh - free_thresh)) between
///   raw      the level itself, 0 to 255; above 100: unknown
///
/// What is transparent in the picture is unknown in all modes.
Raster OccupancyOf(const RosMapInfo& info, GrayImage image);

/// Both files. The picture is a PGM or a PNG, whatever it is called.
Result<Raster> LoadRosMap(const std::string& yaml_path);

struct ObstacleOptions {
  bool unknown_blocks = false;
  double occupied_from = kOccupied;  ///< lower for maps in mode scale or raw
};

/// The nodes whose square, of side a and centred on the node, an occupied cell overlaps by however
/// little; touching is not overlapping. So no wall is lost, thin as it may be. Calls `block` for
/// each unbroken run of them along a row, first and last column included, row by row from the
/// bottom. Fails if the raster's cell_um is not known.
Status ForEachBlockedRun(
    const Raster& occupancy, const field::MapGeometry& map, const ObstacleOptions& options,
    const std::function<void(int32_t row, int32_t first_column, int32_t last_column)>& block);

/// The bytes of both files. A map of free, occupied and unknown alone is `trinary`, as map_saver
/// writes it; otherwise `raw`. Values are rounded; what is not from 0 to 100 is unknown. The
/// raster's cell_um is known.
struct RosMapFiles {
  std::string yaml;
  std::string pgm;
};
RosMapFiles EncodeRosMap(const Raster& occupancy, std::string_view image_name);

/// Writes NAME.pgm and then, as `yaml_path` says, NAME.yaml beside it.
Status SaveRosMap(const std::string& yaml_path, const Raster& occupancy);

}  // namespace pheromone::maps
