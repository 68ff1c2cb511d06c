// [obstacles]: obstacles from shapes in the configuration or from a map.
#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "server/config/points.h"
#include "server/config/sections.h"
#include "server/formats/maps/ros_map.h"

namespace pheromone::config {
namespace {

constexpr std::string_view kMapFiles[] = {".yaml", ".yml"};
constexpr std::string_view kUnknownWords[] = {"free", "blocked"};

// The limit of all shapes together, which are rasterized row by row.
constexpr int64_t kMaxRows = 2'000'000;

class RowBudget {
 public:
  RowBudget(const TableReader& table, const field::MapGeometry& map) : table_(table), map_(map) {}

  // Adds the rows of a shape, `item`, between two heights. False, with one error reported, above
  // the limit.
  bool Take(const std::string& key, const Value& item, int64_t low_um, int64_t high_um) {
    if (left_ < 0) {
      return false;
    }
    left_ -= RowOf(high_um) - RowOf(low_um) + 1;
    if (left_ < 0) {
      table_.Expected(
          key, item,
          "shapes that together cross at most " + std::to_string(kMaxRows) + " rows of nodes");
    }
    return left_ >= 0;
  }

 private:
  int64_t RowOf(int64_t y_um) const {
    return std::clamp<int64_t>(field::FloorDiv(y_um - map_.origin.y, map_.cell_um), 0, map_.rows());
  }

  const TableReader& table_;
  const field::MapGeometry& map_;
  int64_t left_ = kMaxRows;
};

// Reads the items of an array key one by one; an item's key is KEY[N].
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

void ReadRectangles(const TableReader& table, const field::MapGeometry& map, RowBudget* budget,
                    field::ObstacleMask* mask) {
  constexpr std::string_view kOne = "two opposite corners [x0, y0, x1, y1] in metres";
  ForEachItem(
      table, "rectangles_m", "an array of rectangles [x0, y0, x1, y1] in metres",
      [&](const Value& item, const std::string& key) {
        const auto n = ReadMetres(table, item, key, 4, kOne);
        if (n && budget->Take(key, item, std::min((*n)[1], (*n)[3]), std::max((*n)[1], (*n)[3]))) {
          BlockRectangle(map, {(*n)[0], (*n)[1]}, {(*n)[2], (*n)[3]}, mask);
        }
      });
}

void ReadDiscs(const TableReader& table, const field::MapGeometry& map, RowBudget* budget,
               field::ObstacleMask* mask) {
  constexpr std::string_view kOne = "a centre and a non-negative radius, [x, y, r] in metres";
  ForEachItem(table, "discs_m", "an array of discs [x, y, r] in metres",
              [&](const Value& item, const std::string& key) {
                const auto n = ReadMetres(table, item, key, 3, kOne);
                if (n && (*n)[2] < 0) {
                  table.Expected(key, item, kOne);
                } else if (n && budget->Take(key, item, (*n)[1] - (*n)[2], (*n)[1] + (*n)[2])) {
                  BlockDisc(map, {(*n)[0], (*n)[1]}, (*n)[2], mask);
                }
              });
}

void ReadWalls(const TableReader& table, const field::MapGeometry& map, RowBudget* budget,
               field::ObstacleMask* mask) {
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
                bool fits = points && thickness;
                for (size_t i = 1; fits && i < points->size(); ++i) {
                  const auto [low, high] = std::minmax((*points)[i - 1].y, (*points)[i].y);
                  fits = budget->Take(key, item, low - *thickness / 2, high + *thickness / 2);
                }
                if (fits) {
                  BlockLine(map, *points, *thickness, mask);
                }
              });
}

void ReadMapFile(const TableReader& table, const Notes& notes, const field::MapGeometry& map,
                 field::ObstacleMask* mask) {
  const auto unknown = table.OneOf("unknown", kUnknownWords, 0);
  if (table.Find("map") == nullptr) {
    if (table.Find("unknown") != nullptr) {
      table.Report("unknown", "found without map, expected only together with map");
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
  // Read even if they are not enabled, so that their errors are reported at once.
  field::ObstacleMask mask(field->map.columns(), field->map.rows());
  ReadMapFile(table, *notes, field->map, &mask);
  RowBudget budget(table, field->map);
  ReadRectangles(table, field->map, &budget, &mask);
  ReadDiscs(table, field->map, &budget, &mask);
  ReadWalls(table, field->map, &budget, &mask);
  if (enabled.value_or(false) && !mask.empty()) {
    field->obstacles = field::Shared<field::ObstacleMask>(std::move(mask));
  }
}

}  // namespace pheromone::config
