// [obstacles]: where robots cannot go, drawn in the configuration or taken from a map.
#include <optional>
#include <utility>

#include "server/config/points.h"
#include "server/config/sections.h"
#include "server/maps/ros_map.h"

namespace pheromone::config {
namespace {

constexpr std::string_view kMapFiles[] = {".yaml", ".yml"};
constexpr std::string_view kUnknownWords[] = {"free", "blocked"};

// What reads the items of an array key one by one; an item's key is KEY[N].
template <typename ReadItem>
void ForEachItem(const TableReader& table, std::string_view key, std::string_view expected,
                 ReadItem&& read) {
  const Value* value = table.Find(key);
  if (value == nullptr) {
    return;
  }
  if (value->kind != Value::Kind::kArray) {
    table.Expected(key, *value, expected);
    return;
  }
  for (size_t i = 0; i < value->items.size(); ++i) {
    read(value->items[i], PathOf(key, i));
  }
}

void ReadRectangles(const TableReader& table, const field::MapGeometry& map,
                    field::ObstacleMask* mask) {
  constexpr std::string_view kOne = "two opposite corners [x0, y0, x1, y1] in metres";
  ForEachItem(table, "rectangles_m", "an array of rectangles [x0, y0, x1, y1] in metres",
              [&](const Value& item, const std::string& key) {
                if (const auto n = ReadMetres(table, item, key, 4, kOne)) {
                  BlockRectangle(map, {(*n)[0], (*n)[1]}, {(*n)[2], (*n)[3]}, mask);
                }
              });
}

void ReadDiscs(const TableReader& table, const field::MapGeometry& map, field::ObstacleMask* mask) {
  constexpr std::string_view kOne =
      "a centre and a radius that is not negative, [x, y, r] in metres";
  ForEachItem(table, "discs_m", "an array of discs [x, y, r] in metres",
              [&](const Value& item, const std::string& key) {
                const auto n = ReadMetres(table, item, key, 3, kOne);
                if (n && (*n)[2] < 0) {
                  table.Expected(key, item, kOne);
                } else if (n) {
                  BlockDisc(map, {(*n)[0], (*n)[1]}, (*n)[2], mask);
                }
              });
}

void ReadWalls(const TableReader& table, const field::MapGeometry& map, field::ObstacleMask* mask) {
  ForEachItem(table, "walls", "an array of walls {points_m = [...], thickness_m = ...}",
              [&](const Value& item, const std::string& key) {
                if (item.kind != Value::Kind::kTable) {
                  table.Expected(key, item, "a wall {points_m = [...], thickness_m = ...}");
                  return;
                }
                const TableReader wall = table.Inside(item, key);
                wall.AllowOnly({"points_m", "thickness_m"});
                const auto points = ReadPoints(wall, "points_m", 2, nullptr);
                const auto thickness = wall.Scaled("thickness_m", kMetresToUm, 0, kMaxCoordinateUm);
                if (points && thickness) {
                  BlockLine(map, *points, *thickness, mask);
                }
              });
}

void ReadMapFile(const TableReader& table, const Notes& notes, const field::MapGeometry& map,
                 field::ObstacleMask* mask) {
  const auto unknown = table.OneOf("unknown", kUnknownWords, 0);
  if (table.Find("map") == nullptr) {
    if (table.Find("unknown") != nullptr) {
      table.Report("unknown", "found without map, expected a map to go with it");
    }
    return;
  }
  const auto path = ReadFileName(table, "map", kMapFiles, notes);
  if (!path || !unknown) {
    return;
  }
  const Result<maps::Raster> occupancy = maps::LoadRosMap(path->string());
  if (!occupancy.ok()) {
    table.Report("map", occupancy.error());
    return;
  }
  maps::ObstacleOptions options;
  options.unknown_blocks = *unknown == 1;
  const Status blocked = maps::ForEachBlockedRun(
      occupancy.value(), map, options,
      [mask](int32_t row, int32_t first, int32_t last) { mask->BlockRow(row, first, last); });
  if (!blocked.ok()) {
    table.Report("map", path->string() + ": " + blocked.error());
  }
}

}  // namespace

void ReadObstacles(const Value& root, Notes* notes, field::FieldConfig* field) {
  if (root.Find("obstacles") == nullptr) {
    return;
  }
  const TableReader table(TableOf(root, "obstacles", notes), "obstacles", &notes->problems);
  table.AllowOnly({"enabled", "map", "unknown", "rectangles_m", "discs_m", "walls"});
  const auto enabled = table.Boolean("enabled", true);
  // Read although they are not used, so that their mistakes do not come up when they are.
  field::ObstacleMask mask(field->map.columns(), field->map.rows());
  ReadMapFile(table, *notes, field->map, &mask);
  ReadRectangles(table, field->map, &mask);
  ReadDiscs(table, field->map, &mask);
  ReadWalls(table, field->map, &mask);
  if (enabled.value_or(false) && !mask.empty()) {
    field->obstacles = field::Shared<field::ObstacleMask>(std::move(mask));
  }
}

}  // namespace pheromone::config
