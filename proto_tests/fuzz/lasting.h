// What several fuzzers hold the engine to.
#pragma once

#include <string>

#include "proto_tests/fuzz/require.h"
#include "server/base/bytes.h"
#include "server/core/engine/engine.h"

namespace pheromone::fuzz {

inline std::string Saved(const engine::Engine& engine) {
  ByteWriter writer;
  engine.Save(&writer);
  return writer.Take();
}

/// A state that came from anywhere is saved and restored as itself. Its bytes may have been others:
/// of a link without robots, the hash does not know.
inline void RequireLasting(const engine::Engine& engine) {
  const std::string state = Saved(engine);
  ByteReader reader(state);
  const auto again = engine::Engine::Restore(&reader);
  Require(again.ok() && reader.AtEnd() && Saved(again.value()) == state &&
          again.value().StateHash() == engine.StateHash());
}

}  // namespace pheromone::fuzz
