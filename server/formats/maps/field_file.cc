#include "server/formats/maps/field_file.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "server/base/file.h"
#include "server/base/format.h"

namespace pheromone::maps {
namespace {

constexpr std::string_view kVersion = "1";
constexpr std::string_view kNodesLine = "# nodes type,column,row,level";

std::string Printable(std::string_view text) {
  std::string printable(text);
  std::replace_if(
      printable.begin(), printable.end(),
      [](char c) { return static_cast<unsigned char>(c) < ' ' || c == '\x7f'; }, '?');
  return printable;
}

std::string LawInWords(const field::PheromoneLaw& law) {
  std::string words = "permanent";
  if (law.tau_ms != 0) {
    constexpr std::string_view kNames[] = {"counter", "linear", "exponential"};
    words = kNames[static_cast<size_t>(law.evaporation)];
    words += ':' + std::to_string(law.tau_ms) + "ms";
  }
  return words + (law.diffuses() ? "+diffusing" : "");
}

// `visit_levels(type, visit)` calls visit(NodeIndex, level) for each node.
template <typename VisitLevels>
SavedField CaptureFrom(const field::MapGeometry& map, std::span<const field::PheromoneLaw> laws,
                       const VisitLevels& visit_levels) {
  SavedField saved;
  saved.map = map;
  for (const field::PheromoneLaw& law : laws) {
    if (law.is_blend()) {
      continue;
    }
    saved.types.push_back({law.type, Printable(law.name), law.quantum_micro, LawInWords(law)});
    std::vector<field::InitialNode> nodes;
    visit_levels(law.type, [&nodes](field::NodeIndex node, uint32_t level) {
      nodes.push_back({node, level});
    });
    std::sort(nodes.begin(), nodes.end(),
              [](const auto& a, const auto& b) { return a.node < b.node; });
    if (!nodes.empty()) {
      saved.initial_rasters.push_back(
          {law.type, field::Shared<std::vector<field::InitialNode>>(std::move(nodes))});
    }
  }
  const auto by_type = [](const auto& a, const auto& b) { return a.type < b.type; };
  std::sort(saved.types.begin(), saved.types.end(), by_type);
  std::sort(saved.initial_rasters.begin(), saved.initial_rasters.end(), by_type);
  return saved;
}

template <typename Number>
void Append(Number number, char after, std::string* text) {
  *text += ShortestText(number) + after;
}

std::string InWords(const field::MapGeometry& map) {
  const auto um = [](int64_t value) { return std::to_string(value); };
  return "origin (" + um(map.origin.x) + ", " + um(map.origin.y) + "), size " + um(map.width_um) +
         " x " + um(map.height_um) + " and cells of " + um(map.cell_um) + " um";
}

std::string At(field::NodeIndex node) {
  return " at node (" + std::to_string(node.column) + ", " + std::to_string(node.row) + ")";
}

// Whether a type can accept its saved contents.
Status CheckType(const SavedType& saved, const field::InitialRaster& print,
                 const field::PheromoneLaw* law) {
  const std::string who =
      "pheromone type " + std::to_string(saved.type) + " (\"" + saved.name + "\") ";
  if (law == nullptr) {
    return Error{who + "is not configured"};
  }
  if (law->is_blend()) {
    return Error{who + "is configured as a blend, which has no content of its own"};
  }
  if (Printable(law->name) != saved.name) {
    return Error{who + "is configured as \"" + Printable(law->name) + "\""};
  }
  if (law->quantum_micro != saved.quantum_micro) {
    return Error{who + "was saved in quanta of " + std::to_string(saved.quantum_micro) +
                 " millionths, and is configured with quanta of " +
                 std::to_string(law->quantum_micro)};
  }
  const bool whole =
      law->evaporation == field::Evaporation::kCounter && law->tau_ms != 0 && !law->diffuses();
  for (const field::InitialNode& it : *print.nodes) {
    const std::string level = "has level " + std::to_string(it.level) + At(it.node);
    if (it.level > law->max_level()) {
      return Error{who + level + ", expected at most " + std::to_string(law->max_level()) +
                   ", the configured maximum"};
    }
    if (whole && it.level % field::kLevelsPerQuantum != 0) {
      return Error{who + level + ", expected a multiple of " +
                   std::to_string(field::kLevelsPerQuantum) + ": its law counts whole quanta"};
    }
  }
  return Ok();
}

}  // namespace

SavedField TakeFieldSnapshot(const field::Field& field, uint64_t now_ms) {
  return CaptureFrom(
      field.config().map, field.config().pheromones,
      [&](uint8_t type, const auto& visit) { field.VisitLevels(type, now_ms, visit); });
}

SavedField TakeFieldSnapshot(const field::FieldReader& reader, const field::MapGeometry& map,
                             std::span<const field::PheromoneLaw> laws, uint64_t now_ms) {
  return CaptureFrom(
      map, laws, [&](uint8_t type, const auto& visit) { reader.VisitLevels(type, now_ms, visit); });
}

size_t CountNodes(const SavedField& saved) {
  size_t count = 0;
  for (const field::InitialRaster& print : saved.initial_rasters) {
    count += print.nodes->size();
  }
  return count;
}

std::string EncodeField(const SavedField& saved) {
  std::string text;
  text.reserve(1000 + CountNodes(saved) * 16);
  text.append(kFieldMagic).append(kVersion) += '\n';
  text += "# map origin_um ";
  Append(saved.map.origin.x, ' ', &text);
  Append(saved.map.origin.y, ' ', &text);
  text += "size_um ";
  Append(saved.map.width_um, ' ', &text);
  Append(saved.map.height_um, ' ', &text);
  text += "cell_um ";
  Append(saved.map.cell_um, '\n', &text);
  for (const SavedType& it : saved.types) {
    text += "# type ";
    Append(int{it.type}, ' ', &text);
    text += "quantum_micro ";
    Append(it.quantum_micro, ' ', &text);
    text += "law " + it.law + " name \"" + it.name + "\"\n";
  }
  text.append(kNodesLine) += '\n';
  uint64_t levels = 0;
  for (const field::InitialRaster& print : saved.initial_rasters) {
    for (const field::InitialNode& it : *print.nodes) {
      Append(int{print.type}, ',', &text);
      Append(it.node.column, ',', &text);
      Append(it.node.row, ',', &text);
      Append(it.level, '\n', &text);
      levels += it.level;
    }
  }
  text += "# end nodes ";
  Append(CountNodes(saved), ' ', &text);
  text += "levels ";
  Append(levels, '\n', &text);
  return text;
}

Status SaveField(const std::string& path, const SavedField& saved) {
  if (CountNodes(saved) > kMaxSavedNodes) {
    return Error{path + ": not written: " + std::to_string(CountNodes(saved)) +
                 " nodes hold pheromone, expected at most " + std::to_string(kMaxSavedNodes)};
  }
  return WriteFile(path, EncodeField(saved));
}

Result<SavedField> LoadField(const std::string& path) {
  const Result<std::string> text = ReadFile(path);
  return text.ok() ? ParseField(text.value(), path) : text.error();
}

Status CheckFits(const SavedField& saved, const field::FieldConfig& config) {
  if (!(saved.map == config.map)) {
    return Error{"the map was saved with " + InWords(saved.map) + ", and is configured with " +
                 InWords(config.map)};
  }
  field::FieldConfig together = config;
  for (const field::InitialRaster& print : saved.initial_rasters) {
    const auto type = std::find_if(saved.types.begin(), saved.types.end(),
                                   [&](const SavedType& it) { return it.type == print.type; });
    PHEROMONE_TRY_STATUS(CheckType(*type, print, config.FindLaw(print.type)));
    together.initial_rasters.push_back(print);
  }
  const uint64_t bytes = field::BytesOfLaid(
      together, [](const field::Path&) { return true; },
      [](const field::InitialRaster&) { return true; });
  if (bytes > config.memory_bytes) {
    return Error{"the field needs " + std::to_string(bytes) +
                 " bytes, and the configured memory is " + std::to_string(config.memory_bytes)};
  }
  return Ok();
}

Status LayOnto(const SavedField& saved, field::FieldConfig* config) {
  Status fits = CheckFits(saved, *config);
  if (fits.ok()) {
    config->initial_rasters.insert(config->initial_rasters.end(), saved.initial_rasters.begin(),
                                   saved.initial_rasters.end());
  }
  return fits;
}

}  // namespace pheromone::maps
