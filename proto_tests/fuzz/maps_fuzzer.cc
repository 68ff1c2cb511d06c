// Any bytes as a picture, an array, a grid or a ROS map: understood whole or refused with words
// that begin with the file's name; what is understood comes back from our own files as it was.
// The first byte chooses the format.

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>

#include "proto_tests/fuzz/require.h"
#include "server/formats/maps/csv_grid.h"
#include "server/formats/maps/npy.h"
#include "server/formats/maps/pgm.h"
#include "server/formats/maps/png_picture.h"
#include "server/formats/maps/ros_map.h"

namespace {

using pheromone::Result;
using pheromone::fuzz::Require;
using pheromone::maps::GrayImage;
using pheromone::maps::Raster;

template <typename T>
bool Understood(const Result<T>& result) {
  Require(result.ok() || (result.error().starts_with("fuzz:") && result.error().size() > 10));
  return result.ok();
}

bool Same(const Raster& one, const Raster& other) {
  const auto alike = [](double a, double b) { return a == b || (a != a && b != b); };
  return one.columns == other.columns && one.rows == other.rows &&
         std::equal(one.values.begin(), one.values.end(), other.values.begin(), other.values.end(),
                    alike);
}

void CheckSound(const Raster& raster) {
  Require(pheromone::maps::SizeProblem(static_cast<uint64_t>(raster.columns),
                                       static_cast<uint64_t>(raster.rows))
              .empty());
  Require(raster.values.size() ==
          static_cast<size_t>(raster.columns) * static_cast<size_t>(raster.rows));
}

void CheckRaster(const Result<Raster>& read) {
  if (!Understood(read)) {
    return;
  }
  CheckSound(read.value());
  if (read.value().values.size() > 10'000) {
    return;  // not the same again and again
  }
  Require(Same(pheromone::maps::ParseNpy(pheromone::maps::EncodeNpy(read.value()), "fuzz").value(),
               read.value()));
}

void CheckImage(const Result<GrayImage>& read) {
  if (!Understood(read)) {
    return;
  }
  CheckSound(read.value().raster);
  if (read.value().raster.values.size() > 10'000) {
    return;
  }
  for (const double level : read.value().raster.values) {
    Require(level != level || (level >= 0 && level <= read.value().maximum));
  }
  const std::string pgm = pheromone::maps::EncodePgm(read.value());
  const Result<GrayImage> back = pheromone::maps::ParsePgm(pgm, "fuzz");
  Require(back.ok() && pheromone::maps::EncodePgm(back.value()) == pgm);
  CheckSound(OccupancyOf(pheromone::maps::RosMapInfo(), read.value()));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) {
    return 0;
  }
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  switch (data[0] % 5) {
    case 0:
      CheckImage(pheromone::maps::ParsePgm(bytes, "fuzz"));
      break;
    case 1:
      CheckImage(pheromone::maps::ParsePng(bytes, "fuzz"));
      break;
    case 2:
      CheckRaster(pheromone::maps::ParseNpy(bytes, "fuzz"));
      break;
    case 3: {
      const Result<Raster> grid = pheromone::maps::ParseCsvGrid(bytes, "fuzz");
      CheckRaster(grid);
      if (grid.ok()) {
        const std::string csv = EncodeCsvGrid(grid.value());
        Require(Same(pheromone::maps::ParseCsvGrid(csv, "fuzz").value(), grid.value()));
      }
      break;
    }
    default:
      if (const auto info = pheromone::maps::ParseRosMapInfo(bytes, "fuzz"); Understood(info)) {
        Require(info.value().resolution_um >= 1 &&
                info.value().free_thresh < info.value().occupied_thresh);
      }
  }
  return 0;
}
