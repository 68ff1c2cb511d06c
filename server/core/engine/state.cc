// Encodes and decodes the engine's state: configuration, epoch, time, then each component; at the
// end the hash of the state, with which the reader verifies it.

#include <utility>

#include "server/core/engine/config_codec.h"
#include "server/core/engine/engine.h"
#include "server/core/engine/event_codec.h"
#include "server/core/engine/frozen_state.h"

namespace pheromone::engine {

void Engine::Save(ByteWriter* writer) const {
  writer->U8(kCodecVersion);
  EncodeConfig(*config_, writer);
  SaveBeforeParts(writer);
  ForEachPart(*this, [&](const auto& part) { part.Save(writer); });
  writer->U64(StateHash());
}

void Engine::SaveBeforeParts(ByteWriter* writer) const {
  writer->U16(epoch_);
  writer->U64(field_time_ms_);
  writer->U64(sequence_);
}

std::unique_ptr<FrozenState> Engine::Freeze(uint64_t most_kept_bytes) const {
  FrozenState::Parts parts{
      .sequence = sequence_,
      .stamp = last_stamp_,
      .state_hash = StateHash(),
      .config = config_,
      .config_bytes = config_figures_.bytes,
      .before = {},
      .contents = {},
  };
  ByteWriter writer;
  SaveBeforeParts(&writer);
  parts.before = writer.Take();
  bool has_all = true;
  ForEachPart(*this, [&](const auto& part) {
    parts.contents.push_back(has_all ? part.Freeze(most_kept_bytes) : nullptr);
    has_all = parts.contents.back() != nullptr;
  });
  return has_all ? std::make_unique<FrozenState>(std::move(parts)) : nullptr;
}

Result<Engine> Engine::Restore(ByteReader* reader) {
  CheckVersion("a state", reader);
  if (!reader->ok()) {
    return Error{reader->error()};
  }
  Engine engine;
  engine.config_ = DecodeConfig(reader);
  engine.epoch_ = reader->U16();
  engine.field_time_ms_ = reader->U64();
  engine.sequence_ = reader->U64();
  if (reader->ok()) {
    reader->Check(engine.CheckConfig(*engine.config_));
  }
  ForEachPart(engine, [&](auto& part) {
    if (reader->ok()) {
      part.Restore(engine.Now(), reader);
    }
  });
  const uint64_t hash = reader->U64();
  if (reader->ok()) {
    engine.TakeConfig(engine.config_, FiguresOf(*engine.config_));
    engine.last_stamp_.field_time_ms = engine.field_time_ms_;
    if (engine.field_time_ms_ > kMaxFieldTimeMs || engine.StateHash() != hash) {
      reader->Fail("state hash mismatch: this is not the state that was saved");
    }
  }
  if (!reader->ok()) {
    return Error{reader->error()};
  }
  return engine;
}

}  // namespace pheromone::engine
