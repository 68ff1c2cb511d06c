// Any bytes as a saved field: refused with words that begin with the file's name and line, or
// exactly what EncodeField writes, so that the same bytes come back; and then a field can be made
// of it.

#include <algorithm>
#include <cstdint>
#include <string_view>

#include "proto_tests/fuzz/require.h"
#include "server/formats/maps/field_file.h"

namespace {

using pheromone::field::FieldConfig;
using pheromone::field::PheromoneLaw;
using pheromone::fuzz::Require;
using pheromone::maps::SavedField;

// A configuration that takes what was saved.
FieldConfig ConfigFor(const SavedField& saved) {
  FieldConfig config;
  config.map = saved.map;
  config.memory_bytes = 64 << 20;
  for (const pheromone::maps::SavedType& type : saved.types) {
    PheromoneLaw law;
    law.type = type.type;
    law.name = type.name;
    law.quantum_micro = type.quantum_micro;
    law.max_count = UINT16_MAX;
    config.pheromones.push_back(law);
  }
  return config;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto parsed = pheromone::maps::ParseField(text, "fuzz");
  if (!parsed.ok()) {
    Require(parsed.error().starts_with("fuzz:") && parsed.error().size() > 10);
    return 0;
  }
  const SavedField& saved = parsed.value();
  Require(pheromone::maps::EncodeField(saved) == text);
  FieldConfig config = ConfigFor(saved);
  const auto laid = pheromone::maps::LayOnto(saved, &config);
  constexpr int32_t kLargest = 1000;  // not a map of millions of nodes again and again
  if (!laid.ok()) {
    Require(laid.error().find("configured memory") != std::string_view::npos);
  } else if (std::max(config.map.columns(), config.map.rows()) <= kLargest) {
    const pheromone::field::Field field(config);
    for (const pheromone::field::InitialRaster& print : saved.initial_rasters) {
      for (const pheromone::field::InitialNode& it : *print.nodes) {
        Require(field.LevelOf(print.type, it.node, 0) == it.level);
      }
    }
  }
  return 0;
}
