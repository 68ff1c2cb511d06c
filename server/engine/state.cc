// Encodes and decodes the engine's state: configuration, epoch, time, then each component with its
// name and version; at the end the hash of the state, with which the reader verifies it.

#include <string>
#include <utility>

#include "server/engine/config_codec.h"
#include "server/engine/engine.h"
#include "server/engine/event_codec.h"
#include "server/engine/frozen_state.h"

namespace pheromone::engine {
namespace {

// Earlier states contain the robots and the field, without names.
constexpr uint8_t kFirstVersionWithNames = 3;

void SaveHead(const Component& component, ByteWriter* writer) {
  writer->Text(component.name());
  writer->U8(component.version());
}

}  // namespace

void Engine::Save(ByteWriter* writer) const {
  writer->U8(kCodecVersion);
  EncodeConfig(*config_, writer);
  SaveBeforeComponents(writer);
  for (const Polymorphic<Component>& component : components_) {
    SaveHead(*component, writer);
    component->Save(writer);
  }
  writer->Text("");
  writer->U64(StateHash());
}

void Engine::SaveBeforeComponents(ByteWriter* writer) const {
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
      .components = {},
      .end = {},
  };
  ByteWriter writer;
  SaveBeforeComponents(&writer);
  for (const Polymorphic<Component>& component : components_) {
    SaveHead(*component, &writer);
    std::unique_ptr<FrozenPart> content = component->Freeze(most_kept_bytes);
    if (content == nullptr) {
      return nullptr;
    }
    parts.components.push_back({writer.Take(), std::move(content)});
  }
  writer.Text("");
  writer.U64(parts.state_hash);
  parts.end = writer.Take();
  return std::make_unique<FrozenState>(std::move(parts));
}

// Reads all versions that were ever written.
Result<Engine> Engine::Restore(ByteReader* reader, ComponentList components) {
  const uint8_t version = DecodeVersion("a state", reader);
  if (!reader->ok()) {
    return Error{reader->error()};
  }
  Engine engine(std::move(components));
  engine.config_ = DecodeConfig(reader, version);
  engine.epoch_ = reader->U16();
  engine.field_time_ms_ = reader->U64();
  engine.sequence_ = reader->U64();
  if (reader->ok()) {
    reader->Check(engine.CheckConfig(*engine.config_));
  }
  engine.RestoreComponents(version, reader);
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

// In list order. A component that is missing in the bytes starts empty: it was added later.
void Engine::RestoreComponents(uint8_t version, ByteReader* reader) {
  const bool has_names = version >= kFirstVersionWithNames;
  std::string name = has_names ? reader->Text() : "";
  for (size_t i = 0; i < components_.size() && reader->ok(); ++i) {
    Component& component = *components_[i];
    const bool is_there = has_names ? name == component.name() : i <= kFieldIndex;
    if (is_there) {
      const uint8_t its_version = has_names ? reader->U8() : version;
      if (its_version < 1 || its_version > component.version()) {
        reader->Fail("component \"" + name + "\" has version " + std::to_string(its_version) +
                     ", expected 1 to " + std::to_string(component.version()));
        return;
      }
      component.Restore(Now(), its_version, reader);
      name = has_names ? reader->Text() : "";
    } else if (i <= kFieldIndex) {
      reader->Fail("missing component \"" + std::string(component.name()) + "\" in the state");
    } else {
      std::vector<Outgoing> none;
      component.Configure(Now(), {}, {&none, &finished_});
      finished_.clear();
      if (component.Hash() != 0) {
        reader->Fail("component \"" + std::string(component.name()) +
                     "\" is missing in the state, and does not begin empty");
      }
    }
  }
  if (reader->ok() && !name.empty()) {
    reader->Fail("unknown component \"" + name + "\" in the state");
  }
}

}  // namespace pheromone::engine
