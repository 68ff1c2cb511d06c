#include "server/config/points.h"

namespace pheromone::config {
namespace {

constexpr std::string_view kPoint = "a point [x, y] in metres";

std::string NumberedKey(std::string_view key, size_t index) {
  return std::string(key) + '[' + std::to_string(index + 1) + ']';
}

}  // namespace

std::optional<std::vector<int64_t>> ReadMetres(const TableReader& table, const Value& value,
                                               std::string_view key, size_t count,
                                               std::string_view expected) {
  if (value.kind != Value::Kind::kArray || value.items.size() != count) {
    table.Expected(key, value, expected);
    return std::nullopt;
  }
  std::vector<int64_t> numbers;
  for (const Value& item : value.items) {
    if (const auto number =
            table.ScaledValue(item, key, kMetresToUm, -kMaxCoordinateUm, kMaxCoordinateUm)) {
      numbers.push_back(*number);
    }
  }
  return numbers.size() == count ? std::optional(numbers) : std::nullopt;
}

std::optional<field::PointUm> ReadPoint(const TableReader& table, const Value& value,
                                        std::string_view key) {
  const auto numbers = ReadMetres(table, value, key, 2, kPoint);
  return numbers ? std::optional(field::PointUm{(*numbers)[0], (*numbers)[1]}) : std::nullopt;
}

std::optional<field::PointUm> ReadPointOnMap(const TableReader& table, const Value& value,
                                             std::string_view key, const field::MapGeometry& map) {
  const auto point = ReadPoint(table, value, key);
  if (point && !map.Contains(*point)) {
    table.Expected(key, value,
                   "a point on the map, from " + FormatPoint(map.origin) + " to " +
                       FormatPoint({map.origin.x + map.width_um, map.origin.y + map.height_um}));
    return std::nullopt;
  }
  return point;
}

std::optional<std::vector<field::PointUm>> ReadPoints(const TableReader& table,
                                                      std::string_view key, size_t least,
                                                      const field::MapGeometry* map) {
  const std::string expected = "at least " + std::to_string(least) + " points [x, y] in metres";
  const Value* value = table.Find(key);
  if (value == nullptr) {
    table.Missing(key, expected);
    return std::nullopt;
  }
  if (value->kind != Value::Kind::kArray || value->items.size() < least) {
    table.Expected(key, *value, expected);
    return std::nullopt;
  }
  std::vector<field::PointUm> points;
  for (size_t i = 0; i < value->items.size(); ++i) {
    const Value& item = value->items[i];
    const std::string item_key = NumberedKey(key, i);
    const auto point = map != nullptr ? ReadPointOnMap(table, item, item_key, *map)
                                      : ReadPoint(table, item, item_key);
    if (point) {
      points.push_back(*point);
    }
  }
  return points.size() == value->items.size() ? std::optional(points) : std::nullopt;
}

std::string FormatPoint(field::PointUm point) {
  return "(" + FormatScaled(point.x, kMetresToUm) + ", " + FormatScaled(point.y, kMetresToUm) + ")";
}

}  // namespace pheromone::config
