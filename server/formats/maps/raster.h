// A raster: the common form of images, arrays and grids in files, a rectangle of square cells with
// a number in each.
//
//   Result<Raster> raster = LoadNpy("trail.npy");
//   if (!raster.ok()) { return raster.error(); }
//   const double value = raster.value().At(3, 0);  // fourth column of the bottom row
//
// Rows count from the bottom up, as y does on the map. In a file the first row is the top one, as
// displayed; this holds for PGM, PNG, .npy and CSV alike, and each reader and writer reverses the
// order of rows. So a NumPy array a[i][j] is cell (j, rows - 1 - i).
//
// All functions of this folder depend only on their arguments (Load and Save: and on a file) and
// may be called from any thread. Readers return everything or an Error with the file, the line or
// byte, what was found and what was expected; kMaxCells bounds the memory that a malicious file can
// make them allocate.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/core/field/geometry.h"

namespace pheromone::maps {

constexpr int64_t kMaxSide = 30'000;             ///< cells along one side
constexpr int64_t kMaxCells = int64_t{1} << 26;  ///< cells in all: 512 MiB of values

struct Raster {
  int32_t columns = 0;
  int32_t rows = 0;
  field::PointUm origin;       ///< the lower left *corner* of cell (0, 0), the lower left cell
  int64_t cell_um = 0;         ///< the side of a cell; 0: unknown, not in the file
  std::vector<double> values;  ///< columns * rows, the bottom row first; NaN: unknown

  size_t IndexOf(int32_t column, int32_t row) const {
    return static_cast<size_t>(row) * static_cast<size_t>(columns) + static_cast<size_t>(column);
  }
  double& At(int32_t column, int32_t row) { return values[IndexOf(column, row)]; }
  double At(int32_t column, int32_t row) const { return values[IndexOf(column, row)]; }
};

/// The error in a size given by a file ("found 40000 x 2, expected ..."); empty: none. To be called
/// before anything of that size is allocated.
std::string SizeProblem(uint64_t columns, uint64_t rows);

/// All cells 0. The size has no SizeProblem.
Raster MakeRaster(int32_t columns, int32_t rows);

/// The value of the cell that contains a point, its left and lower edges included. Empty outside
/// the raster, or if its cell_um is unknown.
std::optional<double> ValueAt(const Raster& raster, field::PointUm point);

/// A gray image: levels from 0, black, to `maximum`, white. Colours may give fractional levels.
struct GrayImage {
  Raster raster;
  uint16_t maximum = 255;
};

/// Converts levels to values: black is 0, white is `white`, linear between.
Raster ValuesOf(GrayImage image, double white);

/// The reverse, rounded to whole levels: values below 0, and NaN, are black, those above `white`
/// (> 0) white.
GrayImage GrayOf(Raster raster, double white, uint16_t maximum);

/// The whole level nearest to any value: 0 for NaN and values below 0, `maximum` for values above
/// it.
uint16_t NearestLevel(double value, uint16_t maximum);

}  // namespace pheromone::maps
