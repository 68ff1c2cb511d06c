#include "server/core/engine/config_codec.h"

#include "server/core/engine/config_check.h"

namespace pheromone::engine {

void EncodeConfig(const EngineConfig& config, ByteWriter* writer) {
  EncodeFields(config, writer);
}

uint64_t EncodedBytes(const EngineConfig& config) {
  uint64_t bytes = 0;
  ByteWriter writer([&bytes](std::string_view portion) { bytes += portion.size(); });
  EncodeConfig(config, &writer);
  writer.Flush();
  return bytes;
}

EngineConfig DecodeConfig(ByteReader* reader) {
  EngineConfig config;
  DecodeFields(reader, &config);
  if (reader->ok()) {
    reader->Check(CheckValues(config));
  }
  return config;
}

}  // namespace pheromone::engine
