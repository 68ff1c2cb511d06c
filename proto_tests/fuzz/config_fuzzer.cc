// Any text as a configuration file: it is understood or refused with words, and what is understood
// can be run.

#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "server/config/config.h"
#include "server/field/field.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto parsed = pheromone::config::ParseConfig(text, "fuzz");
  if (!parsed.ok()) {
    if (parsed.error().empty()) {
      std::abort();
    }
    return 0;
  }
  const pheromone::field::Field field(parsed.value().engine.field);
  return field.node_count() > field.tile_limit() * 64 ? 1 : 0;
}
