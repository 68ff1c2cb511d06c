#include "server/engine/frozen_state.h"

#include <utility>

#include "server/base/bytes.h"
#include "server/engine/config_codec.h"
#include "server/engine/event_codec.h"

namespace pheromone::engine {

// A version, the configuration, what follows it, the field, a hash: as Engine::Save (state.cc).
FrozenState::FrozenState(Parts parts)
    : parts_(std::move(parts)),
      bytes_(1 + parts_.config_bytes + parts_.after_config.size() + parts_.field->bytes() + 8) {}

bool FrozenState::CopyConfig(std::string* to) {
  if (stage_ != Stage::kConfig) {
    return false;
  }
  ByteWriter writer([to](std::string_view portion) { *to += portion; });
  writer.U8(kCodecVersion);
  EncodeConfig(*parts_.config, &writer);
  writer.Flush();
  *to += parts_.after_config;
  parts_.config = {};
  parts_.after_config = {};
  stage_ = Stage::kField;
  return true;
}

bool FrozenState::CopySome(std::string* to, int tiles) {
  if (failed() || done()) {
    return false;
  }
  if (CopyConfig(to) || parts_.field->CopySome(to, tiles)) {
    return true;
  }
  if (failed()) {
    return false;
  }
  ByteWriter end;
  end.U64(parts_.state_hash);
  *to += end.bytes();
  stage_ = Stage::kDone;
  return true;
}

}  // namespace pheromone::engine
