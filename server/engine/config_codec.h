// A configuration as bytes: all of it, in the order of its declaration, prints and obstacles
// included. It stands in the log and in snapshots; server/journal/README.md has the layout.
//
//   ByteWriter writer;
//   EncodeConfig(config, &writer);
//   ByteReader reader(writer.bytes());
//   EngineConfig same = DecodeConfig(&reader);
//
// Equal configurations have equal bytes, and the other way round. Pure; any thread.
#pragma once

#include "server/base/bytes.h"
#include "server/engine/event.h"

namespace pheromone::engine {

void EncodeConfig(const EngineConfig& config, ByteWriter* writer);

/// Fails the reader for what cannot be a configuration (CheckValues included); what is returned
/// then is of no use.
EngineConfig DecodeConfig(ByteReader* reader);

}  // namespace pheromone::engine
