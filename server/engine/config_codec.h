// A configuration as bytes, by the description of its fields (EngineConfig::Fields). It stands in
// the log and in snapshots; server/journal/README.md has the layout.
//
//   ByteWriter writer;
//   EncodeConfig(config, &writer);
//   ByteReader reader(writer.bytes());
//   EngineConfig same = DecodeConfig(&reader);
//
// Equal configurations have equal bytes, and the other way round. Pure; any thread.
#pragma once

#include <cstddef>

#include "server/base/bytes.h"
#include "server/engine/event.h"
#include "server/engine/event_codec.h"

namespace pheromone::engine {

void EncodeConfig(const EngineConfig& config, ByteWriter* writer);
/// How long that is.
uint64_t EncodedBytes(const EngineConfig& config);

/// As it is written within an event or a state of that version. Fails the reader for what cannot be
/// a configuration (CheckValues included); what is returned then is of no use.
EngineConfig DecodeConfig(ByteReader* reader, uint8_t version = kCodecVersion);

}  // namespace pheromone::engine
