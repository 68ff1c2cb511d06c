#include "server/formats/maps/raster.h"

#include <cmath>
#include <utility>

namespace pheromone::maps {

std::string SizeProblem(uint64_t columns, uint64_t rows) {
  constexpr auto kSide = static_cast<uint64_t>(kMaxSide);
  const bool fits = columns >= 1 && rows >= 1 && columns <= kSide && rows <= kSide &&
                    columns * rows <= static_cast<uint64_t>(kMaxCells);
  if (fits) {
    return {};
  }
  return "found " + std::to_string(columns) + " columns and " + std::to_string(rows) +
         " rows, expected 1 to " + std::to_string(kMaxSide) + " of each and at most " +
         std::to_string(kMaxCells) + " cells";
}

Raster MakeRaster(int32_t columns, int32_t rows) {
  Raster raster;
  raster.columns = columns;
  raster.rows = rows;
  raster.values.resize(static_cast<size_t>(columns) * static_cast<size_t>(rows));
  return raster;
}

std::optional<double> ValueAt(const Raster& raster, field::PointUm point) {
  if (raster.cell_um <= 0) {
    return std::nullopt;
  }
  const int64_t column = field::FloorDiv(point.x - raster.origin.x, raster.cell_um);
  const int64_t row = field::FloorDiv(point.y - raster.origin.y, raster.cell_um);
  if (column < 0 || column >= raster.columns || row < 0 || row >= raster.rows) {
    return std::nullopt;
  }
  return raster.At(static_cast<int32_t>(column), static_cast<int32_t>(row));
}

Raster ValuesOf(GrayImage image, double white) {
  Raster raster = std::move(image.raster);
  for (double& value : raster.values) {
    value = value * white / image.maximum;
  }
  return raster;
}

GrayImage GrayOf(Raster raster, double white, uint16_t maximum) {
  GrayImage image{std::move(raster), maximum};
  for (double& value : image.raster.values) {
    value = NearestLevel(value / white * maximum, maximum);
  }
  return image;
}

uint16_t NearestLevel(double value, uint16_t maximum) {
  if (!(value > 0)) {  // NaN included
    return 0;
  }
  return value >= maximum ? maximum : static_cast<uint16_t>(std::lround(value));
}

}  // namespace pheromone::maps
