// Any text as a configuration file: it is understood or refused with words, and what is understood
// can be run.

#include <cstdint>
#include <string_view>

#include "proto_tests/fuzz/require.h"
#include "server/config/config.h"
#include "server/core/field/field.h"

using pheromone::fuzz::Require;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto parsed = pheromone::config::ParseConfig(text, "fuzz");
  if (!parsed.ok()) {
    Require(!parsed.error().empty());
    return 0;
  }
  pheromone::field::Field field(parsed.value().engine.field);
  const pheromone::field::PointUm corner = field.config().map.origin;
  for (const auto& law : field.config().pheromones) {
    field.Deposit(law.type, corner, 1, 0);
  }
  field.Advance(60'000);  // as long as the longest step of diffusion
  for (const auto& law : field.config().pheromones) {
    Require(field.Sense(law.type, {corner, 0}, 60'000).has_value());
  }
  Require(field.used_bytes() <= field.limit_bytes());
  return 0;
}
