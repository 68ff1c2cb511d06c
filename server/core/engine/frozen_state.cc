#include "server/core/engine/frozen_state.h"

#include <algorithm>
#include <utility>

#include "server/base/bytes.h"
#include "server/core/engine/config_codec.h"
#include "server/core/engine/event_codec.h"

namespace pheromone::engine {

// The same bytes as Engine::Save (state.cc).
FrozenState::FrozenState(Parts parts)
    : parts_(std::move(parts)),
      bytes_(1 + parts_.config_bytes + parts_.before.size() + sizeof parts_.state_hash) {
  for (const std::unique_ptr<FrozenPart>& it : parts_.contents) {
    bytes_ += it->bytes();
  }
}

bool FrozenState::failed() const {
  return std::any_of(parts_.contents.begin(), parts_.contents.end(),
                     [](const std::unique_ptr<FrozenPart>& it) { return it->failed(); });
}

void FrozenState::LetGo() {
  for (const std::unique_ptr<FrozenPart>& it : parts_.contents) {
    it->LetGo();
  }
}

bool FrozenState::CopyConfig(std::string* to) {
  if (stage_ != Stage::kConfig) {
    return false;
  }
  ByteWriter writer([to](std::string_view portion) { *to += portion; });
  writer.U8(kCodecVersion);
  EncodeConfig(*parts_.config, &writer);
  writer.Flush();
  *to += parts_.before;
  parts_.config = {};
  stage_ = Stage::kParts;
  return true;
}

bool FrozenState::CopySome(std::string* to, int tiles) {
  if (failed() || done()) {
    return false;
  }
  if (CopyConfig(to)) {
    return true;
  }
  for (; part_ < parts_.contents.size(); ++part_) {
    if (parts_.contents[part_]->CopySome(to, tiles)) {
      return true;
    }
    if (failed()) {
      return false;
    }
  }
  ByteWriter writer;
  writer.U64(parts_.state_hash);
  *to += writer.bytes();
  stage_ = Stage::kDone;
  return true;
}

}  // namespace pheromone::engine
