// [[pheromone]]: pheromones and blends of them.
#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "server/base/format.h"
#include "server/config/law.h"
#include "server/config/sections.h"

namespace pheromone::config {
namespace {

constexpr double kLargestOnWire = 32767.0 / 4096.0;
constexpr double kNotedFrom = 4;
constexpr int64_t kUsualReachUm = 5'000'000;  // at most

// The type and the name, which must be unique.
bool ReadIdentity(const TableReader& table, const std::vector<field::PheromoneLaw>& others,
                  field::PheromoneLaw* law) {
  const auto type = table.Integer("type", 1, 15);
  const auto name = table.String("name", type ? "type " + std::to_string(*type) : "?");
  if (!type || !name) {
    return false;
  }
  law->type = static_cast<uint8_t>(*type);
  law->name = *name;
  for (const field::PheromoneLaw& other : others) {
    if (other.type == law->type) {
      table.Report("type", "found " + std::to_string(law->type) +
                               " again, expected a number not used by \"" + other.name + '"');
      return false;
    }
    if (other.name == law->name) {
      table.Report("name", "found \"" + law->name + "\" again, expected another name");
      return false;
    }
  }
  return true;
}

std::optional<int32_t> ReadWeight(const TableReader& table, int32_t fallback) {
  const auto weight =
      table.Scaled("weight", kToMilli, -field::kMaxWeightMilli, field::kMaxWeightMilli, fallback);
  return weight ? std::optional(static_cast<int32_t>(*weight)) : std::nullopt;
}

bool ReadSubstance(const TableReader& table, const field::MapGeometry* map,
                   field::PheromoneLaw* law) {
  table.AllowOnly({"type", "name", "profile", "core_m", "sigma_m", "radius_m", "cutoff_m",
                   "evaporation", "tau_s", "half_life_s", "quantum", "maximum", "directional",
                   "weight", "diffusion", "blend"});
  const bool spread = ReadSpread(table, map, law);
  const bool evaporation = ReadEvaporation(table, law);
  const bool strength = ReadStrength(table, law);
  const auto directional = table.Boolean("directional", true);
  const auto weight = ReadWeight(table, 1'000);
  law->directional = directional.value_or(true);
  law->weight_milli = weight.value_or(0);
  return spread && evaporation && strength && directional && weight &&
         ReadDiffusion(table, map, law);
}

// One part of a blend; `laws` are all pheromones of the file.
std::optional<field::BlendPart> ReadPart(const TableReader& part, const field::FieldConfig& field) {
  part.AllowOnly({"pheromone", "weight"});
  const field::PheromoneLaw* law = ReadPheromoneOf(part, field);
  const auto weight = ReadWeight(part, law != nullptr ? law->weight_milli : 0);
  if (law == nullptr || !weight) {
    return std::nullopt;
  }
  return field::BlendPart{law->type, *weight};
}

bool ReadBlend(const TableReader& table, const field::FieldConfig& field,
               field::PheromoneLaw* law) {
  constexpr std::string_view kExpected = "an array of parts {pheromone = ..., weight = ...}";
  const Value& value = *table.Find("blend");
  if (value.kind != Value::Kind::kArray || value.items.empty()) {
    table.Expected("blend", value, kExpected);
    return false;
  }
  bool good = true;
  std::set<uint8_t> types;
  std::vector<field::BlendPart> parts;
  for (size_t i = 0; i < value.items.size(); ++i) {
    const std::string key = PathOf("blend", i);
    if (value.items[i].kind != Value::Kind::kTable) {
      table.Expected(key, value.items[i], "a part {pheromone = ..., weight = ...}");
      good = false;
      continue;
    }
    const TableReader reader = table.Inside(value.items[i], key);
    const auto part = ReadPart(reader, field);
    if (part && !types.insert(part->type).second) {
      reader.Report("pheromone", "found \"" + field.FindLaw(part->type)->name +
                                     "\" again, expected each pheromone once");
    }
    good = good && part && types.size() == i + 1;
    parts.push_back(part.value_or(field::BlendPart{}));
  }
  if (good) {
    law->blend = parts;
  }
  return good;
}

// A message can hold +-7.99 units. With the paper's law and cells, this can always be exceeded, by
// some times, and costs nothing that could be seen: a note says so only beyond that.
void NoteSaturation(const TableReader& table, const field::FieldConfig& field,
                    const field::PheromoneLaw& law, Notes* notes) {
  std::vector<field::BlendPart> parts = law.blend;
  if (!law.is_blend()) {
    parts = {{law.type, law.weight_milli}};
  }
  double most = 0;
  for (const field::BlendPart& part : parts) {
    most +=
        std::abs(part.weight_milli) / 1e3 * StrongestSmell(field.map, *field.FindLaw(part.type));
  }
  if (most > kNotedFrom * kLargestOnWire) {
    notes->notes.push_back(FormatProblem(
        notes->file, table.at(), table.path(),
        "if all nearby nodes are at their maximum, an antenna senses " +
            FormatNumber(std::floor(most * 10) / 10) +
            " units, but a message can hold only 7.99; both sides are then scaled down by the same "
            "factor, which does not affect steering. A smaller `maximum` avoids this"));
  }
}

// What is valid, but can hardly be meant: millimetres for metres, a cell that hides the shape, a
// node that no message can tell.
void WarnOfReach(const TableReader& table, const field::FieldConfig& field,
                 const field::PheromoneLaw& law, Notes* notes) {
  if (law.is_blend()) {
    return;
  }
  const std::string reach =
      "is sensed up to " + FormatScaled(law.reach_um(), kMetresToUm) + " m ahead, ";
  std::string why;
  if (law.reach_um() < field.map.cell_um) {
    why = reach + "less than a cell of " + FormatScaled(field.map.cell_um, kMetresToUm) +
          " m: between nodes, nothing is sensed";
  } else if (law.reach_um() > kUsualReachUm) {
    why = reach + "usual is 0.2 to 2 m: lengths are in metres";
  }
  if (!why.empty()) {
    notes->warnings.push_back({FormatProblem(notes->file, table.at(), table.path(), why)});
  }
  const int64_t maximum_micro = int64_t{law.max_count} * law.quantum_micro;
  if (static_cast<double>(maximum_micro) > kLargestOnWire * 1e6) {
    const Value* const maximum = table.Find("maximum");
    notes->warnings.push_back({FormatProblem(
        notes->file, maximum != nullptr ? maximum->at : table.at(), table.KeyOf("maximum"),
        "found " + FormatScaled(maximum_micro, kToMicro) +
            ", usual is 0.25 to 2: a message can hold only 7.99 units, which one "
            "node alone would exceed")});
  }
}

}  // namespace

bool ReadPheromones(const Value& root, bool has_map, Notes* notes, field::FieldConfig* field) {
  const std::vector<const Value*> tables = TablesOf(root, "pheromone", notes);
  if (root.Find("pheromone") == nullptr || (tables.empty() && notes->problems.empty())) {
    notes->problems.Add(root.at, "pheromone", "missing, expected at least one table [[pheromone]]");
  }
  std::vector<TableReader> readers;
  for (size_t i = 0; i < tables.size(); ++i) {
    readers.emplace_back(*tables[i], PathOf("pheromone", i), &notes->problems);
  }
  // Blends after all others: their parts may be further down in the file.
  std::vector<field::PheromoneLaw>& laws = field->pheromones;
  bool good = !tables.empty();
  for (const TableReader& table : readers) {
    field::PheromoneLaw law;
    const bool blend = table.Find("blend") != nullptr;
    const bool known = ReadIdentity(table, laws, &law);
    if (blend) {
      table.AllowOnly({"type", "name", "blend"});
      law.blend.emplace_back();
    }
    const bool read = blend || ReadSubstance(table, has_map ? &field->map : nullptr, &law);
    good = good && known && read;
    if (known && read) {
      laws.push_back(law);
    }
  }
  if (!good) {
    return false;  // a part that is missing may be among those that were not understood
  }
  for (size_t i = 0; i < readers.size(); ++i) {
    good = (!laws[i].is_blend() || ReadBlend(readers[i], *field, &laws[i])) && good;
  }
  for (size_t i = 0; has_map && good && i < readers.size(); ++i) {
    NoteSaturation(readers[i], *field, laws[i], notes);
    WarnOfReach(readers[i], *field, laws[i], notes);
  }
  return good;
}

}  // namespace pheromone::config
