// [[path]]: predefined trails, turned into polylines.
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "server/config/points.h"
#include "server/config/sections.h"
#include "server/formats/maps/polyline_file.h"

namespace pheromone::config {
namespace {

enum Shape : size_t { kPolyline, kCircle, kSpline };
constexpr std::string_view kShapes[] = {"polyline", "circle", "spline"};

constexpr double kMaxPathCells = 1e6;         // all paths together
constexpr size_t kMaxPathPoints = 1'000'000;  // the same, of those that come from files

constexpr std::string_view kLineFiles[] = {".svg", ".geojson", ".json", ".csv"};

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

// Paths are rasterized node by node when the map is created: their length, in cells, is limited.
class PathBudget {
 public:
  explicit PathBudget(int64_t cell_um) : cell_um_(static_cast<double>(cell_um)) {}

  bool Take(const TableReader& table, std::string_view key, double length_um) {
    left_ -= length_um / cell_um_ + 1;
    if (left_ < 0) {
      table.Report(key, "the paths are more than 1000000 cells long, expected shorter paths");
    }
    return left_ >= 0;
  }

  bool TakePoints(const TableReader& table, std::string_view key, size_t points) {
    if (points > points_left_) {
      table.Report(key, "the files of all paths have more than 1000000 points, expected fewer");
      points_left_ = 0;
      return false;
    }
    points_left_ -= points;
    return true;
  }

 private:
  double cell_um_;
  double left_ = kMaxPathCells;
  size_t points_left_ = kMaxPathPoints;
};

// The context in which the [[path]] tables are read.
struct Surroundings {
  const field::FieldConfig& field;
  const std::optional<maps::Wgs84>& datum;
  const Notes& notes;
  PathBudget* budget;
};

// The sides of a curve that is made of straight pieces.
int64_t StepOf(const field::MapGeometry& map) {
  return std::max<int64_t>(1, map.cell_um / 2);
}

std::optional<std::vector<field::PointUm>> ReadCircle(const TableReader& table,
                                                      const field::MapGeometry& map,
                                                      PathBudget* budget) {
  const Value* value = table.Find("center_m");
  const auto radius_um = table.Scaled("radius_m", kMetresToUm, 1, kMaxCoordinateUm);
  if (value == nullptr) {
    table.Missing("center_m", "a point [x, y] in metres");
    return std::nullopt;
  }
  const auto centre = ReadPointOnMap(table, *value, "center_m", map);
  if (!centre || !radius_um) {
    return std::nullopt;
  }
  if (!map.Contains({centre->x - *radius_um, centre->y - *radius_um}) ||
      !map.Contains({centre->x + *radius_um, centre->y + *radius_um})) {
    table.Report("radius_m", "found " + FormatScaled(*radius_um, kMetresToUm) +
                                 ", expected a circle within the map");
    return std::nullopt;
  }
  if (!budget->Take(table, "radius_m", 6.3 * static_cast<double>(*radius_um))) {
    return std::nullopt;
  }
  return field::CirclePoints(*centre, *radius_um, StepOf(map));
}

std::optional<std::vector<field::PointUm>> ReadLine(const TableReader& table, Shape shape,
                                                    bool closed, const field::MapGeometry& map,
                                                    PathBudget* budget) {
  auto knots = ReadPoints(table, "points_m", closed ? 3 : 2, &map);
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
    table.Report("points_m", "the curve leaves the map at " + FormatPoint(*off) +
                                 ", expected points further from the edge");
    return std::nullopt;
  }
  return curve;
}

// How the file is to be read: some keys belong to one format.
std::optional<maps::PolylineOptions> ReadLineOptions(const TableReader& table,
                                                     const std::string& extension,
                                                     const std::optional<maps::Wgs84>& datum) {
  maps::PolylineOptions options;
  bool good = true;
  if (extension == ".svg") {
    const auto scale = table.Number("metres_per_unit", 1e-9, 1e6);
    const auto id = table.String("id", "");
    good = scale && id;
    options.metres_per_unit = scale.value_or(1);
    options.svg_id = id.value_or("");
  } else {
    good = table.Without({"metres_per_unit", "id"}, "a file other than .svg", "a .svg file");
  }
  if (extension == ".geojson" || extension == ".json") {
    const auto metres = table.Boolean("metres", false);
    good = good && metres;
    options.geojson_unit =
        metres.value_or(false) ? maps::GeoJsonUnit::kMetres : maps::GeoJsonUnit::kDegrees;
    options.datum = datum;
    if (metres && !*metres && !datum) {
      table.Report("file",
                   "has coordinates in degrees, expected a datum in [map] or metres = true");
      good = false;
    }
  } else {
    good = table.Without({"metres"}, "a file other than GeoJSON", "a .geojson file") && good;
  }
  return good ? std::optional(options) : std::nullopt;
}

std::optional<std::vector<maps::Polyline>> ReadLines(const TableReader& table,
                                                     const Surroundings& around) {
  const auto path = ReadFileName(table, "file", kLineFiles, around.notes);
  const auto options =
      path ? ReadLineOptions(table, ExtensionOf(*path), around.datum) : std::nullopt;
  if (!options) {
    return std::nullopt;
  }
  Result<std::vector<maps::Polyline>> lines = maps::LoadPolylines(*path, *options);
  if (!lines.ok()) {
    table.Report("file", lines.error());
    return std::nullopt;
  }
  const field::MapGeometry& map = around.field.map;
  for (const maps::Polyline& line : lines.value()) {
    for (const field::PointUm point : line.points) {
      if (!map.Contains(point)) {
        table.Report("file",
                     path->string() + " leaves the map at " + FormatPoint(point) +
                         ", expected points from " + FormatPoint(map.origin) + " to " +
                         FormatPoint({map.origin.x + map.width_um, map.origin.y + map.height_um}));
        return std::nullopt;
      }
    }
    const double length_um = field::LengthOf({.closed = line.closed, .points = line.points});
    if (!around.budget->Take(table, "file", length_um) ||
        !around.budget->TakePoints(table, "file", line.points.size())) {
      return std::nullopt;
    }
  }
  return std::move(lines).value();
}

void ReadPathFile(const TableReader& table, const Surroundings& around,
                  std::vector<field::Path>* paths) {
  table.AllowOnly({"name", "pheromone", "file", "metres_per_unit", "id", "metres", "intensity"});
  const auto name = table.String("name", "");
  const field::PheromoneLaw* law = ReadPheromoneOf(table, around.field);
  const auto count = law != nullptr ? ReadCount(table, *law) : std::nullopt;
  auto lines = ReadLines(table, around);
  if (!name || !count || !lines) {
    return;
  }
  for (maps::Polyline& line : *lines) {
    paths->push_back({law->type, *count, line.closed, std::move(line.points)});
  }
}

void ReadPath(const TableReader& table, const Surroundings& around,
              std::vector<field::Path>* paths) {
  const field::MapGeometry& map = around.field.map;
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
  const field::PheromoneLaw* law = ReadPheromoneOf(table, around.field);
  const auto closed = table.Boolean("closed", false);
  const auto count = law != nullptr ? ReadCount(table, *law) : std::nullopt;
  const auto points = *shape == kCircle ? ReadCircle(table, map, around.budget)
                                        : ReadLine(table, static_cast<Shape>(*shape),
                                                   closed.value_or(false), map, around.budget);
  if (name && law != nullptr && closed && count && points) {
    paths->push_back({law->type, *count, *closed || *shape == kCircle, *points});
  }
}

}  // namespace

void ReadPaths(const Value& root, const std::optional<maps::Wgs84>& datum, Notes* notes,
               field::FieldConfig* field) {
  PathBudget budget(field->map.cell_um);
  const Surroundings around{*field, datum, *notes, &budget};
  const std::vector<const Value*> tables = TablesOf(root, "path", notes);
  std::vector<field::Path> paths;
  for (size_t i = 0; i < tables.size(); ++i) {
    const TableReader table(*tables[i], PathOf("path", i), &notes->problems);
    const bool from_file = table.Find("file") != nullptr;
    from_file ? ReadPathFile(table, around, &paths) : ReadPath(table, around, &paths);
  }
  field->paths = std::move(paths);
}

}  // namespace pheromone::config
