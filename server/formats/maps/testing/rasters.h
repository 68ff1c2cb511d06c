// Rasters for tests: written down and compared as one sees them, the top row first.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "server/formats/maps/raster.h"

namespace pheromone::maps::testing {

using Rows = std::vector<std::vector<double>>;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

inline Raster RasterOf(const Rows& top_down) {
  Raster raster;
  raster.rows = static_cast<int32_t>(top_down.size());
  raster.columns = static_cast<int32_t>(top_down.front().size());
  for (size_t below = top_down.size(); below > 0; --below) {
    const std::vector<double>& row = top_down[below - 1];
    std::copy(row.begin(), row.end(), std::back_inserter(raster.values));
  }
  return raster;
}

inline Rows RowsOf(const Raster& raster) {
  Rows top_down;
  for (int32_t row = raster.rows - 1; row >= 0; --row) {
    auto& values = top_down.emplace_back();
    for (int32_t column = 0; column < raster.columns; ++column) {
      values.push_back(raster.At(column, row));
    }
  }
  return top_down;
}

/// Of the same size, and in each cell the same value or NaN in both.
inline bool Same(const Raster& one, const Raster& other) {
  bool same = one.columns == other.columns && one.rows == other.rows &&
              one.values.size() == other.values.size();
  for (size_t i = 0; same && i < one.values.size(); ++i) {
    same = one.values[i] == other.values[i] ||
           (std::isnan(one.values[i]) && std::isnan(other.values[i]));
  }
  return same;
}

/// Whole levels from 0 to `maximum`, all different sizes and shapes for different seeds.
inline GrayImage RandomGray(uint32_t seed, uint16_t maximum) {
  std::mt19937 random(seed);
  const auto upto = [&random](uint32_t last) {
    return static_cast<int32_t>(random() % (last + 1));
  };
  GrayImage image{MakeRaster(1 + upto(19), 1 + upto(19)), maximum};
  for (double& value : image.raster.values) {
    value = upto(maximum);
  }
  return image;
}

/// No beginning of a file is taken for the whole, and each refusal names the file.
template <typename Parse>
void ExpectEveryBeginningRefused(std::string_view bytes, const Parse& parse) {
  for (size_t size = 0; size < bytes.size(); ++size) {
    const auto parsed = parse(bytes.substr(0, size), "cut");
    ASSERT_FALSE(parsed.ok()) << size << " of " << bytes.size() << " bytes";
    EXPECT_EQ(parsed.error().substr(0, 4), "cut:") << parsed.error();
  }
}

template <typename T>
std::string ErrorOf(const Result<T>& result) {
  return result.ErrorOr("no error");
}

}  // namespace pheromone::maps::testing
