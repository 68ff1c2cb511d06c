// pheromonectl map ...: draws and exports maps without a server, and converts rasters.
//
// Each prints what it did to standard output, or errors to standard error, and returns the exit
// status: 0, 1 for a file that cannot be read, parsed or written, 2 for an error in the command
// line or the configuration.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {

/// Selects a map, a pheromone and an area.
struct MapSource {
  std::string config;          ///< empty: the default configuration
  std::string field;           ///< a saved field (maps/field_file.h); empty: the initial contents
  std::string type;            ///< number or name; empty: the first type with content on the map
  std::vector<double> area_m;  ///< x, y of two opposite corners; empty: all of it
  int32_t nodes_per_cell = 1;
};

/// Draws in colours from zero to the type's maximum, obstacles gray. `pixels_per_cell` 0: chosen
/// for an image of about a thousand pixels.
int DrawMap(const MapSource& source, int pixels_per_cell, const std::string& out);

/// Exports pheromone in units as .npy or .csv, with obstacles as unknown; or the obstacles as a ROS
/// map, .yaml.
int ExportMap(const MapSource& source, const std::string& out);

int ConvertRaster(const std::string& in, const std::string& out, std::optional<double> white,
                  std::optional<double> cell_m);

/// Converts a saved field to a map of another origin, size or cell size (maps/resample.h). `types`:
/// numbers or names of those to include; empty: all.
int ResampleField(const std::string& config, const std::vector<std::string>& types,
                  const std::string& in, const std::string& out);

/// Prints the contents of a raster or a saved field.
int DescribeFile(const std::string& path);

}  // namespace pheromone::ctl
