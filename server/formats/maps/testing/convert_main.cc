// maps_convert FROM TO [WHITE]: from one format of a raster to another, by the files' endings, for
// foreign_tools_test.py to compare with what other programs make of the same files.
//
//   .pgm .png       gray pictures; black is 0 and white WHITE (default: the picture's own maximum)
//   .npy            float64
//   .csv            a grid
//   .yaml           a ROS map, its occupancy; a cell is 50 mm
//   .viridis.png    in colours from 0 to WHITE (only written)

#include <cstdlib>
#include <iostream>
#include <string>
#include <utility>

#include "server/formats/maps/csv_grid.h"
#include "server/formats/maps/npy.h"
#include "server/formats/maps/pgm.h"
#include "server/formats/maps/png_picture.h"
#include "server/formats/maps/ros_map.h"

namespace pheromone::maps {
namespace {

Result<Raster> Load(const std::string& path, double white) {
  if (path.ends_with(".npy")) {
    return LoadNpy(path);
  }
  if (path.ends_with(".csv")) {
    return LoadCsvGrid(path);
  }
  if (path.ends_with(".yaml")) {
    return LoadRosMap(path);
  }
  PHEROMONE_TRY(GrayImage image, path.ends_with(".pgm") ? LoadPgm(path) : LoadPng(path));
  const double maximum = image.maximum;
  return ValuesOf(std::move(image), white > 0 ? white : maximum);
}

Status Save(const std::string& path, Raster raster, double white) {
  const auto maximum = static_cast<uint16_t>(white > 255 ? 65535 : 255);
  const double scale = white > 0 ? white : maximum;
  if (path.ends_with(".npy")) {
    return SaveNpy(path, raster);
  }
  if (path.ends_with(".csv")) {
    return SaveCsvGrid(path, raster);
  }
  if (path.ends_with(".yaml")) {
    raster.cell_um = 50'000;
    return SaveRosMap(path, raster);
  }
  if (path.ends_with(".pgm")) {
    return SavePgm(path, GrayOf(std::move(raster), scale, maximum));
  }
  if (path.ends_with(".viridis.png")) {
    return SavePicture(path, raster, {.low = 0, .high = scale, .pixels_per_cell = 2});
  }
  return SaveGrayPng(path, GrayOf(std::move(raster), scale, maximum));
}

}  // namespace
}  // namespace pheromone::maps

int main(int argc, char** argv) {
  if (argc < 3) {
    std::cerr << "usage: maps_convert FROM TO [WHITE]\n";
    return 2;
  }
  const double white = argc > 3 ? std::atof(argv[3]) : 0;
  const auto raster = pheromone::maps::Load(argv[1], white);
  if (!raster.ok()) {
    std::cerr << raster.error() << '\n';
    return 1;
  }
  const auto saved = pheromone::maps::Save(argv[2], raster.value(), white);
  if (!saved.ok()) {
    std::cerr << saved.error() << '\n';
    return 1;
  }
  return 0;
}
