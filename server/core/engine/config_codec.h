// A configuration as bytes, by the description of its fields (EngineConfig::Fields). It is stored
// in the log and in snapshots; server/store/journal/README.md has the layout.
//
//   ByteWriter writer;
//   EncodeConfig(config, &writer);
//   ByteReader reader(writer.bytes());
//   EngineConfig same = DecodeConfig(&reader);
//
// Equal configurations have equal bytes, and vice versa. Pure; any thread.
#pragma once

#include <cstddef>

#include "server/base/bytes.h"
#include "server/core/engine/event.h"
#include "server/core/engine/event_codec.h"

namespace pheromone::engine {

void EncodeConfig(const EngineConfig& config, ByteWriter* writer);
/// The length of that.
uint64_t EncodedBytes(const EngineConfig& config);

/// Fails the reader for an invalid configuration (CheckValues included); the result is then
/// meaningless.
EngineConfig DecodeConfig(ByteReader* reader);

}  // namespace pheromone::engine
