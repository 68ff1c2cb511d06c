// Coordinates in the configuration: arrays of numbers in metres, such as [x, y]. Internal to this
// folder.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/config/reader.h"
#include "server/core/field/geometry.h"

namespace pheromone::config {

constexpr int64_t kMaxCoordinateUm = 1'000'000'000'000;  ///< 1000 km

/// `count` numbers in metres, as whole micrometres within kMaxCoordinateUm; `expected` says what
/// they are.
std::optional<std::vector<int64_t>> ReadMetres(const TableReader& table, const Value& value,
                                               std::string_view key, size_t count,
                                               std::string_view expected);

/// [x, y]: anywhere, or on the map.
std::optional<field::PointUm> ReadPoint(const TableReader& table, const Value& value,
                                        std::string_view key);
std::optional<field::PointUm> ReadPointOnMap(const TableReader& table, const Value& value,
                                             std::string_view key, const field::MapGeometry& map);

/// The array of at least `least` points of a key, on `map` if that is given.
std::optional<std::vector<field::PointUm>> ReadPoints(const TableReader& table,
                                                      std::string_view key, size_t least,
                                                      const field::MapGeometry* map);

/// "(1, 2.5)", in metres.
std::string FormatPoint(field::PointUm point);

}  // namespace pheromone::config
