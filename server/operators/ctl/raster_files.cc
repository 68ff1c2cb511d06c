#include "server/operators/ctl/raster_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "server/base/text.h"
#include "server/formats/maps/csv_grid.h"
#include "server/formats/maps/npy.h"
#include "server/formats/maps/pgm.h"
#include "server/formats/maps/png_picture.h"
#include "server/formats/maps/ros_map.h"

namespace pheromone::ctl {
namespace {

enum class Format { kPgm, kPng, kNpy, kCsv, kRos, kUnknown };

Format FormatOf(const std::string& path) {
  const std::string ending = ToLower(std::filesystem::path(path).extension().string());
  constexpr std::pair<std::string_view, Format> kEndings[] = {
      {".pgm", Format::kPgm}, {".png", Format::kPng},  {".npy", Format::kNpy},
      {".csv", Format::kCsv}, {".yaml", Format::kRos}, {".yml", Format::kRos}};
  const auto* const found = std::find_if(std::begin(kEndings), std::end(kEndings),
                                         [&](const auto& it) { return it.first == ending; });
  return found != std::end(kEndings) ? found->second : Format::kUnknown;
}

// The raster as levels of a gray picture.
Result<maps::GrayImage> ToGray(const std::string& path, maps::Raster raster,
                               std::optional<double> white) {
  double largest = 0;
  for (int32_t row = 0; row < raster.rows; ++row) {
    for (int32_t column = 0; column < raster.columns; ++column) {
      const double value = raster.At(column, row);
      if (!white && !(value >= 0 && value <= 65535 && value == std::floor(value))) {
        return Error{fmt::format(
            "{}: found {} in column {}, row {} from below, expected whole numbers from 0 to 65535, "
            "or --white: the value of white",
            path, value, column, row)};
      }
      largest = std::max(largest, std::isnan(value) ? 0 : value);
    }
  }
  if (white) {
    return maps::GrayOf(std::move(raster), *white, 255);
  }
  return maps::GrayImage{std::move(raster), static_cast<uint16_t>(largest > 255 ? 65535 : 255)};
}

}  // namespace

Status CheckRasterEnding(const std::string& path) {
  return FormatOf(path) != Format::kUnknown
             ? Ok()
             : Error{path + ": unknown ending, expected .pgm, .png, .npy, .csv or .yaml"};
}

Result<maps::Raster> LoadRaster(const std::string& path, std::optional<double> white) {
  const Format format = FormatOf(path);
  switch (format) {
    case Format::kNpy:
      return maps::LoadNpy(path);
    case Format::kCsv:
      return maps::LoadCsvGrid(path);
    case Format::kRos:
      return maps::LoadRosMap(path);
    case Format::kPgm:
    case Format::kPng:
      break;
    case Format::kUnknown:
      return CheckRasterEnding(path).error();
  }
  PHEROMONE_TRY(maps::GrayImage image,
                format == Format::kPgm ? maps::LoadPgm(path) : maps::LoadPng(path));
  const double maximum = image.maximum;
  return maps::ValuesOf(std::move(image), white.value_or(maximum));
}

Status SaveRaster(const std::string& path, maps::Raster raster, const RasterStyle& style) {
  const Format format = FormatOf(path);
  switch (format) {
    case Format::kNpy:
      return maps::SaveNpy(path, raster);
    case Format::kCsv:
      return maps::SaveCsvGrid(path, raster);
    case Format::kRos:
      raster.cell_um = style.cell_um.value_or(raster.cell_um);
      return raster.cell_um > 0
                 ? maps::SaveRosMap(path, raster)
                 : Error{path + ": expected --cell: a ROS map needs the size of its cells"};
    case Format::kPgm:
    case Format::kPng:
      break;
    case Format::kUnknown:
      return CheckRasterEnding(path);
  }
  PHEROMONE_TRY(const maps::GrayImage image, ToGray(path, std::move(raster), style.white));
  return format == Format::kPgm ? maps::SavePgm(path, image) : maps::SaveGrayPng(path, image);
}

}  // namespace pheromone::ctl
