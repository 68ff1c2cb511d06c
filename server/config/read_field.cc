// [map], [antennas], [[pheromone]].
#include <algorithm>
#include <array>
#include <optional>

#include "server/config/sections.h"

namespace pheromone::config {
namespace {

constexpr int64_t kUmPerM = 1'000'000;
constexpr int64_t kMaxCells = 30'000;  // along an axis
constexpr int64_t kMaxReachUm = 50 * kUmPerM;
constexpr int64_t kMaxReachCells = 1'000;  // from the robot: a request looks at each node in reach
constexpr int64_t kMaxOriginUm = 1'000'000 * kUmPerM;
constexpr int64_t kMaxTauMs = 1'000'000'000'000;
constexpr int64_t kMaxQuantumMicro = 1'000 * int64_t{1'000'000};
constexpr double kLargestOnWire = 32767.0 / 4096.0;

// The first coordinate of the map that a message cannot hold, if there is one. Robots state their
// place in pose units, as 16-bit numbers or, in the wide messages, as 32-bit ones.
std::optional<int64_t> NotAddressable(const field::MapGeometry& map, int64_t unit_um, bool wide) {
  const int64_t most = (wide ? int64_t{INT32_MAX} : int64_t{INT16_MAX}) * unit_um;
  const std::array<int64_t, 4> edges = {map.origin.x, map.origin.x + map.width_um, map.origin.y,
                                        map.origin.y + map.height_um};
  const auto bad = std::find_if(edges.begin(), edges.end(),
                                [most](int64_t edge) { return edge < -most || edge > most; });
  return bad == edges.end() ? std::nullopt : std::optional(*bad);
}

bool ReadSides(const TableReader& map, field::MapGeometry* geometry) {
  const auto width_um = map.Scaled("width_m", kMetresToUm, 1, kMaxOriginUm);
  const auto height_um = map.Scaled("height_m", kMetresToUm, 1, kMaxOriginUm);
  const auto cell_um = map.Scaled("cell_m", kMetresToUm, 1, kMaxOriginUm);
  const auto x_um = map.Scaled("origin_x_m", kMetresToUm, -kMaxOriginUm, kMaxOriginUm, 0);
  const auto y_um = map.Scaled("origin_y_m", kMetresToUm, -kMaxOriginUm, kMaxOriginUm, 0);
  if (!width_um || !height_um || !cell_um || !x_um || !y_um) {
    return false;
  }
  *geometry = {{*x_um, *y_um}, *width_um, *height_um, *cell_um};
  const int64_t cells = std::max(*width_um, *height_um) / *cell_um;
  if (cells > kMaxCells) {
    map.Report("cell_m", "found " + FormatScaled(*cell_um, kMetresToUm) + ", which makes " +
                             std::to_string(cells) + " cells along an axis, expected at most " +
                             std::to_string(kMaxCells));
    return false;
  }
  if (*cell_um > std::min(*width_um, *height_um)) {
    map.Report("cell_m", "found " + FormatScaled(*cell_um, kMetresToUm) +
                             ", expected no more than width_m and height_m");
    return false;
  }
  return true;
}

bool ReadMap(const Value& root, Notes* notes, engine::EngineConfig* engine) {
  const Value& table = TableOf(root, "map", notes);
  const TableReader map(table, "map", &notes->problems);
  map.AllowOnly(
      {"width_m", "height_m", "cell_m", "origin_x_m", "origin_y_m", "pose_unit_mm", "wide"});
  field::MapGeometry& geometry = engine->field.map;
  const bool has_sides = ReadSides(map, &geometry);
  const auto unit = map.Scaled("pose_unit_mm", kMillimetresTo10Um, 1, UINT16_MAX, 100);
  const auto wide = map.Boolean("wide", false);
  if (!has_sides || !unit || !wide) {
    return has_sides;
  }
  engine->pose_unit_10um = static_cast<uint16_t>(*unit);
  if (const auto edge = NotAddressable(geometry, *unit * 10, *wide)) {
    const std::string unit_mm = FormatScaled(*unit, kMillimetresTo10Um);
    map.Report(*wide ? "pose_unit_mm" : "wide",
               "the map reaches to " + FormatScaled(*edge, kMetresToUm) +
                   " m, which is more than " + std::string(*wide ? "2147483647" : "32767") +
                   " pose units of " + unit_mm + " mm, expected " +
                   (*wide ? "a larger pose_unit_mm"
                          : "wide = true, a larger pose_unit_mm or another origin"));
  }
  return true;
}

// The number of quanta that make up the maximum, which must be whole.
std::optional<uint16_t> ReadMaxCount(const TableReader& table, int64_t quantum_micro) {
  const auto maximum = table.Scaled("maximum", kToMicro, 1, UINT16_MAX * kMaxQuantumMicro);
  if (!maximum) {
    return std::nullopt;
  }
  const int64_t count = *maximum / quantum_micro;
  const std::string found = "found " + FormatScaled(*maximum, kToMicro) + ", expected ";
  if (*maximum % quantum_micro != 0) {
    const std::string below =
        count > 0 ? FormatScaled(count * quantum_micro, kToMicro) + " or " : "";
    table.Report("maximum", found + "a multiple of the quantum " +
                                FormatScaled(quantum_micro, kToMicro) + ", such as " + below +
                                FormatScaled((count + 1) * quantum_micro, kToMicro));
    return std::nullopt;
  }
  if (count > UINT16_MAX) {
    table.Report("maximum",
                 found + "at most 65535 quanta of " + FormatScaled(quantum_micro, kToMicro));
    return std::nullopt;
  }
  return static_cast<uint16_t>(count);
}

bool ReadReach(const TableReader& table, const field::MapGeometry* map, field::PheromoneLaw* law) {
  const auto core_um = table.Scaled("core_m", kMetresToUm, 0, kMaxReachUm);
  const auto sigma_um = table.Scaled("sigma_m", kMetresToUm, 1, kMaxReachUm);
  if (!core_um || !sigma_um) {
    return false;
  }
  law->core_um = *core_um;
  law->sigma_um = *sigma_um;
  const std::string reach = "core_m + sigma_m is " + FormatScaled(law->reach_um(), kMetresToUm);
  if (law->reach_um() > kMaxReachUm) {
    table.Report("sigma_m", reach + " m, expected at most 50 m");
    return false;
  }
  if (map != nullptr && law->reach_um() / map->cell_um > kMaxReachCells) {
    table.Report("sigma_m", reach + " m or " + std::to_string(law->reach_um() / map->cell_um) +
                                " cells, expected at most " + std::to_string(kMaxReachCells) +
                                " cells");
    return false;
  }
  return true;
}

// A 16-bit message holds 7.99 units. The most that an antenna can smell: every node in reach (ahead
// of the axle line, if directional) at its maximum, the antenna itself upon a node.
void WarnOfSaturation(const TableReader& table, const field::MapGeometry& map,
                      const field::PheromoneLaw& law, Notes* notes) {
  const int64_t cells = law.reach_um() / map.cell_um;
  const int64_t columns = std::min<int64_t>(cells, map.columns() - 1);
  const int64_t rows = std::min<int64_t>(cells, map.rows() - 1);
  double sum = 0;
  for (int64_t x = law.directional ? 0 : -columns; x <= columns; ++x) {
    for (int64_t y = -rows; y <= rows; ++y) {
      sum += field::SpreadQ16(law, (x * x + y * y) * map.cell_um * map.cell_um) / 65536.0;
    }
  }
  const double most =
      sum * static_cast<double>(law.max_count) * static_cast<double>(law.quantum_micro) / 1e6;
  if (most > kLargestOnWire) {
    const auto rounded = static_cast<int64_t>(most * 10);
    notes->warnings.push_back(FormatProblem(
        notes->file, table.at(), table.path(),
        "where every node is at its maximum, an antenna smells " +
            FormatNumber(static_cast<double>(rounded) / 10) +
            " units and a message holds 7.99: both sides are then scaled down by the same factor"));
  }
}

void ReadPheromone(const TableReader& table, bool has_map, Notes* notes,
                   field::FieldConfig* field) {
  table.AllowOnly(
      {"type", "name", "core_m", "sigma_m", "tau_s", "quantum", "maximum", "directional"});
  field::PheromoneLaw law;
  const auto type = table.Integer("type", 1, 15);
  const auto name = table.String("name", type ? "type " + std::to_string(*type) : "?");
  const bool has_reach = ReadReach(table, has_map ? &field->map : nullptr, &law);
  const auto tau_ms = table.Scaled("tau_s", kSecondsToMs, 0, kMaxTauMs);
  const auto quantum = table.Scaled("quantum", kToMicro, 1, kMaxQuantumMicro);
  const auto count = quantum ? ReadMaxCount(table, *quantum) : std::nullopt;
  const auto directional = table.Boolean("directional", true);
  if (!type || !name || !has_reach || !tau_ms || !quantum || !count || !directional) {
    return;
  }
  law.type = static_cast<uint8_t>(*type);
  law.name = *name;
  law.tau_ms = *tau_ms;
  law.quantum_micro = *quantum;
  law.max_count = *count;
  law.directional = *directional;
  for (const field::PheromoneLaw& other : field->pheromones) {
    if (other.type == law.type) {
      table.Report("type", "found " + std::to_string(law.type) +
                               " again, expected a number that \"" + other.name +
                               "\" does not have");
      return;
    }
    if (other.name == law.name) {
      table.Report("name", "found \"" + law.name + "\" again, expected another name");
      return;
    }
  }
  field->pheromones.push_back(law);
  if (has_map) {
    WarnOfSaturation(table, field->map, law, notes);
  }
}

// An answer looks at a rectangle that holds what both antennas reach.
void CheckAntennas(const TableReader& antennas, const field::FieldConfig& field) {
  int64_t reach_um = 0;
  for (const field::PheromoneLaw& law : field.pheromones) {
    reach_um = std::max(reach_um, law.reach_um());
  }
  const int64_t most_um = field.antenna_distance_um / 2 + reach_um;
  if (const int64_t cells = most_um / field.map.cell_um; cells > kMaxReachCells) {
    antennas.Report("bias_m", "half of it and the farthest core_m + sigma_m are " +
                                  FormatScaled(most_um, kMetresToUm) + " m or " +
                                  std::to_string(cells) + " cells, expected at most " +
                                  std::to_string(kMaxReachCells) + " cells");
  }
}

}  // namespace

bool ReadField(const Value& root, Notes* notes, engine::EngineConfig* engine) {
  const bool has_map = ReadMap(root, notes, engine);
  const TableReader antennas(TableOf(root, "antennas", notes), "antennas", &notes->problems);
  antennas.AllowOnly({"bias_m"});
  // HELLO tells it in whole millimetres.
  engine->field.antenna_distance_um =
      1'000 * antennas.Scaled("bias_m", kMetresToMm, 0, 65'000).value_or(0);

  const std::vector<const Value*> tables = TablesOf(root, "pheromone", notes);
  if (root.Find("pheromone") == nullptr || (tables.empty() && notes->problems.empty())) {
    notes->problems.Add(root.at, "pheromone", "missing, expected at least one table [[pheromone]]");
  }
  for (size_t i = 0; i < tables.size(); ++i) {
    const TableReader table(*tables[i], PathOf("pheromone", i), &notes->problems);
    ReadPheromone(table, has_map, notes, &engine->field);
  }
  if (has_map) {
    CheckAntennas(antennas, engine->field);
  }
  return has_map && engine->field.pheromones.size() == tables.size();
}

}  // namespace pheromone::config
