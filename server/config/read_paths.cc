// [[path]]: predefined trails, turned into polylines.
#include <algorithm>
#include <cmath>
#include <optional>

#include "server/config/sections.h"

namespace pheromone::config {
namespace {

enum Shape : size_t { kPolyline, kCircle, kSpline };
constexpr std::string_view kShapes[] = {"polyline", "circle", "spline"};

constexpr int64_t kMaxCoordinateUm = 2'000'000'000'000;
constexpr double kMaxPathCells = 1e6;  // all paths together

std::string Format(field::PointUm point) {
  return "(" + FormatScaled(point.x, kMetresToUm) + ", " + FormatScaled(point.y, kMetresToUm) + ")";
}

// [x, y] in metres, somewhere on the map.
std::optional<field::PointUm> ReadPoint(const TableReader& table, const Value& value,
                                        const std::string& key, const field::MapGeometry& map) {
  if (value.kind != Value::Kind::kArray || value.items.size() != 2) {
    table.Expected(key, value, "a point [x, y] in metres");
    return std::nullopt;
  }
  const auto coordinate = [&](size_t i) {
    return table.ScaledValue(value.items[i], key, kMetresToUm, -kMaxCoordinateUm, kMaxCoordinateUm);
  };
  const auto x_um = coordinate(0);
  const auto y_um = coordinate(1);
  if (!x_um || !y_um) {
    return std::nullopt;
  }
  const field::PointUm point{*x_um, *y_um};
  if (!map.Contains(point)) {
    table.Expected(key, value,
                   "a point on the map, which reaches from " + Format(map.origin) + " to " +
                       Format({map.origin.x + map.width_um, map.origin.y + map.height_um}));
    return std::nullopt;
  }
  return point;
}

std::optional<std::vector<field::PointUm>> ReadPoints(const TableReader& table, size_t least,
                                                      const field::MapGeometry& map) {
  const std::string expected = "at least " + std::to_string(least) + " points [x, y] in metres";
  const Value* value = table.Find("points_m");
  if (value == nullptr) {
    table.Missing("points_m", expected);
    return std::nullopt;
  }
  if (value->kind != Value::Kind::kArray || value->items.size() < least) {
    table.Expected("points_m", *value, expected);
    return std::nullopt;
  }
  std::vector<field::PointUm> points;
  for (size_t i = 0; i < value->items.size(); ++i) {
    if (const auto point = ReadPoint(table, value->items[i], PathOf("points_m", i), map)) {
      points.push_back(*point);
    }
  }
  return points.size() == value->items.size() ? std::optional(points) : std::nullopt;
}

// The pheromone that a path names by its type or its name.
const field::PheromoneLaw* ReadPheromoneOf(const TableReader& table,
                                           const field::FieldConfig& field) {
  const Value* value = table.Find("pheromone");
  std::string known;
  for (const field::PheromoneLaw& law : field.pheromones) {
    const bool by_type = value != nullptr && value->kind == Value::Kind::kInteger;
    const bool by_name = value != nullptr && value->kind == Value::Kind::kString;
    if ((by_type && value->integer == law.type) || (by_name && value->text == law.name)) {
      return &law;
    }
    known += (known.empty() ? "" : ", ") + std::to_string(law.type) + " or \"" + law.name + '"';
  }
  if (value == nullptr) {
    table.Missing("pheromone", known);
  } else {
    table.Expected("pheromone", *value, known);
  }
  return nullptr;
}

std::optional<uint16_t> ReadCount(const TableReader& table, const field::PheromoneLaw& law) {
  const int64_t maximum = law.max_count * law.quantum_micro;
  const auto intensity = table.Scaled("intensity", kToMicro, law.quantum_micro, maximum, maximum);
  if (!intensity) {
    return std::nullopt;
  }
  if (*intensity % law.quantum_micro != 0) {
    table.Report("intensity", "found " + FormatScaled(*intensity, kToMicro) +
                                  ", expected a multiple of the quantum " +
                                  FormatScaled(law.quantum_micro, kToMicro) + " of \"" + law.name +
                                  '"');
    return std::nullopt;
  }
  return static_cast<uint16_t>(*intensity / law.quantum_micro);
}

// Paths are worked out node by node when the map is made: their length, in cells, is limited.
class LengthBudget {
 public:
  explicit LengthBudget(int64_t cell_um) : cell_um_(static_cast<double>(cell_um)) {}

  bool Take(const TableReader& table, std::string_view key, double length_um) {
    left_ -= length_um / cell_um_ + 1;
    if (left_ < 0) {
      table.Report(key, "the paths are more than 1000000 cells long, expected shorter paths");
    }
    return left_ >= 0;
  }

 private:
  double cell_um_;
  double left_ = kMaxPathCells;
};

// The sides of a curve that is made of straight pieces.
int64_t StepOf(const field::MapGeometry& map) {
  return std::max<int64_t>(1, map.cell_um / 2);
}

std::optional<std::vector<field::PointUm>> ReadCircle(const TableReader& table,
                                                      const field::MapGeometry& map,
                                                      LengthBudget* budget) {
  const Value* value = table.Find("center_m");
  const auto radius_um = table.Scaled("radius_m", kMetresToUm, 1, kMaxCoordinateUm);
  if (value == nullptr) {
    table.Missing("center_m", "a point [x, y] in metres");
    return std::nullopt;
  }
  const auto centre = ReadPoint(table, *value, "center_m", map);
  if (!centre || !radius_um) {
    return std::nullopt;
  }
  if (!map.Contains({centre->x - *radius_um, centre->y - *radius_um}) ||
      !map.Contains({centre->x + *radius_um, centre->y + *radius_um})) {
    table.Report("radius_m", "found " + FormatScaled(*radius_um, kMetresToUm) +
                                 ", with which the circle leaves the map");
    return std::nullopt;
  }
  if (!budget->Take(table, "radius_m", 6.3 * static_cast<double>(*radius_um))) {
    return std::nullopt;
  }
  return field::CirclePoints(*centre, *radius_um, StepOf(map));
}

std::optional<std::vector<field::PointUm>> ReadLine(const TableReader& table, Shape shape,
                                                    bool closed, const field::MapGeometry& map,
                                                    LengthBudget* budget) {
  auto knots = ReadPoints(table, closed ? 3 : 2, map);
  if (!knots ||
      !budget->Take(table, "points_m", field::LengthOf({.closed = closed, .points = *knots}))) {
    return std::nullopt;
  }
  if (shape == kPolyline) {
    return knots;
  }
  std::vector<field::PointUm> curve = field::SplinePoints(*knots, closed, StepOf(map));
  const auto off = std::find_if(curve.begin(), curve.end(),
                                [&map](field::PointUm point) { return !map.Contains(point); });
  if (off != curve.end()) {
    table.Report("points_m", "the curve leaves the map at " + Format(*off) +
                                 ", expected points further from the edge");
    return std::nullopt;
  }
  return curve;
}

void ReadPath(const TableReader& table, LengthBudget* budget, field::FieldConfig* field) {
  const auto shape = table.OneOf("shape", kShapes, kPolyline);
  if (!shape) {
    return;
  }
  if (*shape == kCircle) {
    table.AllowOnly({"name", "pheromone", "shape", "center_m", "radius_m", "intensity"});
  } else {
    table.AllowOnly({"name", "pheromone", "shape", "points_m", "closed", "intensity"});
  }
  const auto name = table.String("name", "");
  const field::PheromoneLaw* law = ReadPheromoneOf(table, *field);
  const auto closed = table.Boolean("closed", false);
  const auto count = law != nullptr ? ReadCount(table, *law) : std::nullopt;
  const auto points = *shape == kCircle ? ReadCircle(table, field->map, budget)
                                        : ReadLine(table, static_cast<Shape>(*shape),
                                                   closed.value_or(false), field->map, budget);
  if (name && law != nullptr && closed && count && points) {
    field->paths.push_back({law->type, *count, *closed || *shape == kCircle, *points});
  }
}

}  // namespace

void ReadPaths(const Value& root, Notes* notes, field::FieldConfig* field) {
  LengthBudget budget(field->map.cell_um);
  const std::vector<const Value*> tables = TablesOf(root, "path", notes);
  for (size_t i = 0; i < tables.size(); ++i) {
    const TableReader table(*tables[i], PathOf("path", i), &notes->problems);
    ReadPath(table, &budget, field);
  }
}

}  // namespace pheromone::config
