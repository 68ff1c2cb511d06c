// [map], [antennas].
#include <algorithm>
#include <optional>

#include "server/config/law.h"
#include "server/config/sections.h"
#include "server/core/engine/wire_units.h"

namespace pheromone::config {
namespace {

constexpr int64_t kUsualBiasUm = 2'000'000;  // at most

constexpr double kMaxHeightM = 100'000;

bool ReadSides(const TableReader& map, field::MapGeometry* geometry) {
  const auto width_um = map.Scaled("width_m", kMetresToUm, 1, field::MapGeometry::kMaxUm);
  const auto height_um = map.Scaled("height_m", kMetresToUm, 1, field::MapGeometry::kMaxUm);
  const auto cell_um = map.Scaled("cell_m", kMetresToUm, 1, field::MapGeometry::kMaxUm);
  const auto x_um = map.Scaled("origin_x_m", kMetresToUm, -field::MapGeometry::kMaxUm,
                               field::MapGeometry::kMaxUm, 0);
  const auto y_um = map.Scaled("origin_y_m", kMetresToUm, -field::MapGeometry::kMaxUm,
                               field::MapGeometry::kMaxUm, 0);
  if (!width_um || !height_um || !cell_um || !x_um || !y_um) {
    return false;
  }
  *geometry = {{*x_um, *y_um}, *width_um, *height_um, *cell_um};
  const int64_t cells = std::max(*width_um, *height_um) / *cell_um;
  if (cells > field::MapGeometry::kMaxCells) {
    map.Report("cell_m", "found " + FormatScaled(*cell_um, kMetresToUm) + ", which makes " +
                             std::to_string(cells) + " cells along an axis, expected at most " +
                             std::to_string(field::MapGeometry::kMaxCells));
    return false;
  }
  if (*cell_um > std::min(*width_um, *height_um)) {
    map.Report("cell_m", "found " + FormatScaled(*cell_um, kMetresToUm) +
                             ", expected no more than width_m and height_m");
    return false;
  }
  return true;
}

void ReadDatum(const TableReader& map, std::optional<maps::Wgs84>* datum) {
  if (map.Find("datum") == nullptr) {
    return;
  }
  const auto table = map.Table("datum", "{latitude_deg = ..., longitude_deg = ..., height_m = 0}");
  if (!table) {
    return;
  }
  table->AllowOnly({"latitude_deg", "longitude_deg", "height_m"});
  const auto latitude = table->Number("latitude_deg", -90, 90);
  const auto longitude = table->Number("longitude_deg", -180, 180);
  const auto height = table->Number("height_m", -kMaxHeightM, kMaxHeightM, 0);
  if (latitude && longitude && height) {
    *datum = maps::Wgs84{*latitude, *longitude, *height};
  }
}

}  // namespace

bool ReadMap(const Value& root, Notes* notes, Config* config) {
  const TableReader map(TableOf(root, "map", notes), "map", &notes->problems);
  map.AllowOnly({"width_m", "height_m", "cell_m", "origin_x_m", "origin_y_m", "pose_unit_mm",
                 "wide", "datum"});
  field::MapGeometry& geometry = config->engine.field.map;
  const bool has_sides = ReadSides(map, &geometry);
  const auto unit = map.Scaled("pose_unit_mm", kMillimetresTo10Um, 1, UINT16_MAX, 100);
  const auto wide = map.Boolean("wide", false);
  ReadDatum(map, &config->datum);
  if (!has_sides || !unit || !wide) {
    return has_sides;
  }
  config->engine.pose_unit_10um = static_cast<uint16_t>(*unit);
  if (const auto edge = engine::NotAddressable(geometry, config->engine.pose_unit_10um, *wide)) {
    const std::string unit_mm = FormatScaled(*unit, kMillimetresTo10Um);
    map.Report(*wide ? "pose_unit_mm" : "wide",
               "the map extends to " + FormatScaled(*edge, kMetresToUm) +
                   " m, which is more than " + std::string(*wide ? "2147483647" : "32767") +
                   " pose units of " + unit_mm + " mm, expected " +
                   (*wide ? "a larger pose_unit_mm"
                          : "wide = true, a larger pose_unit_mm or another origin"));
  }
  return true;
}

void ReadAntennas(const Value& root, Notes* notes, field::FieldConfig* field) {
  const TableReader table(TableOf(root, "antennas", notes), "antennas", &notes->problems);
  table.AllowOnly({"bias_m", "forward_m", "angle_deg"});
  // HELLO's answer contains it in whole millimetres.
  const auto distance_mm = table.Scaled("bias_m", kMetresToMm, 0, 65'000);
  const auto forward_um =
      table.Scaled("forward_m", kMetresToUm, -field::AntennaGeometry::kMaxForwardUm,
                   field::AntennaGeometry::kMaxForwardUm, 0);
  const auto angle =
      table.Scaled("angle_deg", kDegrees, 0, 180 * kDegrees.factor, 90 * kDegrees.factor);
  if (distance_mm && forward_um && angle) {
    field->antennas = {1'000 * *distance_mm, *forward_um,
                       static_cast<uint16_t>(ToBinaryAngle(*angle))};
  }
}

// An answer examines a rectangle that contains the reach of both antennas.
void CheckAntennas(const Value& root, Notes* notes, const field::FieldConfig& field) {
  const field::PheromoneLaw* farthest = nullptr;
  for (const field::PheromoneLaw& law : field.pheromones) {
    if (!law.is_blend() && (farthest == nullptr || law.reach_um() > farthest->reach_um())) {
      farthest = &law;
    }
  }
  if (farthest == nullptr) {
    return;
  }
  if (field.antennas.distance_um > kUsualBiasUm) {
    const TableReader table(TableOf(root, "antennas", notes), "antennas", &notes->problems);
    notes->warnings.push_back(
        {FormatProblem(notes->file, table.Find("bias_m")->at, "antennas.bias_m",
                       "found " + FormatScaled(field.antennas.distance_um, kMetresToUm) +
                           ", usual is 0.1 to 1 m between the antennas of a robot")});
  }
  const int64_t forward_um = std::abs(field.antennas.forward_um);
  const int64_t most_um = field.antennas.distance_um / 2 + forward_um + farthest->reach_um();
  const int64_t cells = most_um / field.map.cell_um;
  if (cells > field::kMaxReachCells) {
    const TableReader table(TableOf(root, "antennas", notes), "antennas", &notes->problems);
    const bool gaussian = farthest->profile == field::Profile::kGaussian;
    table.Report("bias_m", "half of it" + std::string(forward_um != 0 ? ", forward_m" : "") +
                               " and the largest " + (gaussian ? "cutoff_m" : "core_m + sigma_m") +
                               " add up to " + FormatScaled(most_um, kMetresToUm) + " m or " +
                               std::to_string(cells) + " cells, expected at most " +
                               std::to_string(field::kMaxReachCells) + " cells");
  }
}

}  // namespace pheromone::config
