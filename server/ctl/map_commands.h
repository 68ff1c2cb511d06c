// pheromonectl map ...: what lies on a map, drawn and exported without a server; rasters converted.
//
// Each prints what it did to standard output, or what is wrong to standard error, and returns the
// exit status: 0, 1 for a file that cannot be read, understood or written, 2 for a mistake in the
// command line or the configuration.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/ctl/server_call.h"

namespace pheromone::ctl {

/// Which part of which map, and of what on it.
struct MapSource {
  std::string config;          ///< empty: the default configuration
  std::string field;           ///< a saved field (maps/field_file.h); empty: as the map begins
  std::string type;            ///< number or name; empty: the first type with something on the map
  std::vector<double> area_m;  ///< x, y of two opposite corners; empty: all of it
  int32_t nodes_per_cell = 1;
};

/// In colours from nothing to the type's maximum, obstacles gray. `pixels_per_cell` 0: as many as
/// make a picture of about a thousand.
int DrawMap(const MapSource& source, int pixels_per_cell, const std::string& out);

/// Pheromone in units as .npy or .csv, unknown where there are obstacles; or the obstacles as a ROS
/// map, .yaml.
int ExportMap(const MapSource& source, const std::string& out);

int ConvertRaster(const std::string& in, const std::string& out, std::optional<double> white,
                  std::optional<double> cell_m);

/// A saved field for a map of another origin, size or cell size (maps/resample.h). `types`: numbers
/// or names of those to take along; empty: all.
int ResampleField(const std::string& config, const std::vector<std::string>& types,
                  const std::string& in, const std::string& out);

/// What a raster or a saved field holds.
int DescribeFile(const std::string& path);

}  // namespace pheromone::ctl
