// [[print]]: initial rasters, images and arrays deposited on the map as pheromone.
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "server/config/points.h"
#include "server/config/sections.h"
#include "server/core/field/edit.h"
#include "server/formats/maps/csv_grid.h"
#include "server/formats/maps/npy.h"
#include "server/formats/maps/pgm.h"
#include "server/formats/maps/png_picture.h"
#include "server/formats/maps/raster.h"
#include "server/formats/maps/ros_map.h"

namespace pheromone::config {
namespace {

constexpr std::string_view kFiles[] = {".yaml", ".yml", ".pgm", ".png", ".npy", ".csv"};

// The limit of all initial rasters together, which are sampled and stored node by node.
constexpr int64_t kMaxNodes = field::kMaxNodesOfEdit;

constexpr size_t kMaxPrints = 1024;

// The values of a file, and the one that stands for the maximum of the raster.
struct Picture {
  maps::Raster raster;
  double full = 1;
};

Result<Picture> FromImage(Result<maps::GrayImage> image) {
  if (!image.ok()) {
    return image.error();
  }
  const double white = image.value().maximum;
  return Picture{std::move(image).value().raster, white};
}

Result<Picture> FromNumbers(Result<maps::Raster> raster) {
  if (!raster.ok()) {
    return raster.error();
  }
  double largest = 0;
  for (const double value : raster.value().values) {
    largest = std::isfinite(value) ? std::max(largest, value) : largest;
  }
  return Picture{std::move(raster).value(), largest};
}

Result<Picture> Load(const std::filesystem::path& path) {
  const std::string name = path.string();
  const std::string extension = ExtensionOf(path);
  if (extension == ".pgm") {
    return FromImage(maps::LoadPgm(name));
  }
  if (extension == ".png") {
    return FromImage(maps::LoadPng(name));
  }
  if (extension == ".npy") {
    return FromNumbers(maps::LoadNpy(name));
  }
  if (extension == ".csv") {
    return FromNumbers(maps::LoadCsvGrid(name));
  }
  PHEROMONE_TRY(maps::Raster occupancy, maps::LoadRosMap(name));
  return Picture{std::move(occupancy), maps::kOccupied};
}

// The position of the raster. By default, each pixel is centred on a node.
bool Place(const TableReader& table, const field::MapGeometry& map, maps::Raster* raster) {
  const Value* at = table.Find("at_m");
  const bool placed = raster->cell_um != 0;
  const auto corner = at != nullptr ? ReadPoint(table, *at, "at_m") : std::nullopt;
  bool good = at == nullptr || corner;
  if (placed) {
    good = table.Without({"cell_m"}, "a file that contains its cell size", "no cell_m") && good;
  } else {
    const auto cell_um = table.Scaled("cell_m", kMetresToUm, 1, kMaxCoordinateUm, map.cell_um);
    good = good && cell_um;
    raster->cell_um = cell_um.value_or(1);
    const int64_t half_um = map.cell_um - map.cell_um / 2;
    raster->origin = {map.origin.x - half_um, map.origin.y - half_um};
  }
  raster->origin = corner.value_or(raster->origin);
  return good;
}

// The columns, or rows, of nodes that a side of the raster covers.
struct Span {
  int64_t first = 0;
  int64_t end = 0;
};
Span Covered(int64_t from_um, int64_t cells, int64_t cell_um, int64_t step_um, int64_t nodes) {
  const auto up = [&](int64_t um) {
    return std::clamp<int64_t>(-field::FloorDiv(-um, step_um), 0, nodes);
  };
  return {up(from_um), up(from_um + cells * cell_um)};
}

class Prints {
 public:
  Prints(const Notes& notes, field::FieldConfig* field) : notes_(notes), field_(field) {}

  void Read(const TableReader& table) {
    table.AllowOnly({"name", "pheromone", "file", "maximum", "at_m", "cell_m"});
    const auto name = table.String("name", "");
    const field::PheromoneLaw* law = ReadPheromoneOf(table, *field_);
    const auto path = ReadFileName(table, "file", kFiles, notes_);
    const int64_t most = law != nullptr ? law->max_count * law->quantum_micro : 1;
    const auto maximum =
        law != nullptr ? table.Scaled("maximum", kToMicro, 1, most, most) : std::nullopt;
    if (!name || !path || !maximum) {
      return;
    }
    Result<Picture> picture = Load(*path);
    if (!picture.ok()) {
      table.Report("file", picture.error());
      return;
    }
    if (!Place(table, field_->map, &picture.value().raster)) {
      return;
    }
    const auto nodes = Sample(table, picture.value(), *law, *maximum);
    if (nodes && nodes->empty()) {
      table.Report("file", path->string() + ": no value above 0 at any node of the map");
    } else if (nodes) {
      field_->initial_rasters.push_back(
          {law->type, field::Shared<std::vector<field::InitialNode>>(*nodes)});
    }
  }

 private:
  // The level at each node that the raster covers, by the cell that the node lies in.
  std::optional<std::vector<field::InitialNode>> Sample(const TableReader& table,
                                                        const Picture& picture,
                                                        const field::PheromoneLaw& law,
                                                        int64_t maximum_micro) {
    const field::MapGeometry& map = field_->map;
    const maps::Raster& raster = picture.raster;
    const Span columns = Covered(raster.origin.x - map.origin.x, raster.columns, raster.cell_um,
                                 map.cell_um, map.columns());
    const Span rows = Covered(raster.origin.y - map.origin.y, raster.rows, raster.cell_um,
                              map.cell_um, map.rows());
    left_ -= (columns.end - columns.first) * (rows.end - rows.first);
    if (left_ < 0) {
      table.Report("file", "the initial rasters cover more than " + std::to_string(kMaxNodes) +
                               " nodes, expected smaller rasters or larger map cells");
      return std::nullopt;
    }
    // The paper's law counts whole quanta.
    const bool whole =
        law.evaporation == field::Evaporation::kCounter && law.tau_ms != 0 && !law.diffuses();
    const int64_t unit = whole ? int64_t{field::kLevelsPerQuantum} : 1;
    const double full = static_cast<double>(maximum_micro) /
                        static_cast<double>(law.quantum_micro) * field::kLevelsPerQuantum /
                        static_cast<double>(unit);
    std::vector<field::InitialNode> nodes;
    for (int64_t row = rows.first; row < rows.end; ++row) {
      for (int64_t column = columns.first; column < columns.end; ++column) {
        const field::NodeIndex node{static_cast<int32_t>(column), static_cast<int32_t>(row)};
        const double value = maps::ValueAt(raster, map.PositionOf(node)).value_or(0);
        const double share = std::clamp(value / picture.full, 0.0, 1.0);
        const int64_t level = value > 0 ? std::llround(share * full) * unit : 0;
        if (level > 0) {
          nodes.push_back({node, static_cast<uint32_t>(std::min<int64_t>(level, law.max_level()))});
        }
      }
    }
    return nodes;
  }

  const Notes& notes_;
  field::FieldConfig* field_;
  int64_t left_ = kMaxNodes;
};

}  // namespace

void ReadPrints(const Value& root, Notes* notes, field::FieldConfig* field) {
  Prints prints(*notes, field);
  const std::vector<const Value*> tables = TablesOf(root, "print", notes, kMaxPrints);
  for (size_t i = 0; i < tables.size(); ++i) {
    prints.Read(TableReader(*tables[i], PathOf("print", i), &notes->problems));
  }
}

}  // namespace pheromone::config
