// Occupancy maps of ROS (map_server, nav2_map_server): a YAML file beside an image. Format:
// https://wiki.ros.org/map_server, "Map format"; for `raw`, nav2_map_server.
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
// An occupancy grid is a raster of percentages as in nav_msgs/OccupancyGrid, 0 free to 100
// occupied; unknown, -1 there, is NaN as in every raster.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "server/base/result.h"
#include "server/core/field/geometry.h"
#include "server/formats/maps/raster.h"

namespace pheromone::maps {

constexpr double kFree = 0;
constexpr double kOccupied = 100;

enum class RosMapMode { kTrinary, kScale, kRaw };

struct RosMapInfo {
  std::string image;
  int64_t resolution_um = 0;  ///< exact: a resolution that is not a whole number of um is refused
  field::PointUm origin;      ///< rounded to the nearest um
  bool negate = false;
  double occupied_thresh = 0.65;
  double free_thresh = 0.196;
  RosMapMode mode = RosMapMode::kTrinary;
};

/// Parses the YAML file. `name` is its name in errors: `name:line:column: ...`. Other keys are
/// ignored, as in ROS.
Result<RosMapInfo> ParseRosMapInfo(std::string_view yaml, std::string_view name);

/// The meaning of the image. With x a pixel's level in [0, 1] and p = 1 - x, or x if negated:
///
///   trinary  p > occupied_thresh: 100; p < free_thresh: 0; otherwise unknown
///   scale    the same, but floor(99 (p - free_thresh) / (occupied_thresh - free_thresh)) between
///   raw      the level itself, 0 to 255; above 100: unknown
///
/// Transparent pixels are unknown in all modes.
Raster OccupancyOf(const RosMapInfo& info, GrayImage image);

/// Loads both files. The image is a PGM or a PNG, regardless of its name.
Result<Raster> LoadRosMap(const std::string& yaml_path);

struct ObstacleOptions {
  bool unknown_blocks = false;
  double occupied_from = kOccupied;  ///< lower for maps in mode scale or raw
};

/// The nodes whose square, of side a and centred on the node, overlaps an occupied cell at all;
/// touching is not overlapping. So no wall is lost, however thin. Calls `block` for each unbroken
/// run of them along a row, first and last column included, row by row from the bottom. Fails if
/// the raster's cell_um is unknown.
Status ForEachBlockedRun(
    const Raster& occupancy, const field::MapGeometry& map, const ObstacleOptions& options,
    const std::function<void(int32_t row, int32_t first_column, int32_t last_column)>& block);

/// The bytes of both files. A map with only free, occupied and unknown cells is `trinary`, as
/// written by map_saver; otherwise `raw`. Values are rounded; those not from 0 to 100 are unknown.
/// The raster's cell_um must be known.
struct RosMapFiles {
  std::string yaml;
  std::string pgm;
};
RosMapFiles EncodeRosMap(const Raster& occupancy, std::string_view image_name);

/// Writes NAME.pgm and then NAME.yaml, given by `yaml_path`, beside it.
Status SaveRosMap(const std::string& yaml_path, const Raster& occupancy);

}  // namespace pheromone::maps
