#include "server/engine/component.h"

#include <memory>
#include <string>
#include <utility>

namespace pheromone::engine {
namespace {

class EncodedPart final : public FrozenPart {
 public:
  explicit EncodedPart(std::string text) : text_(std::move(text)), bytes_(text_.size()) {}
  uint64_t bytes() const override { return bytes_; }
  bool CopySome(std::string* to, int /*tiles*/) override {
    if (text_.empty()) {
      return false;
    }
    *to += std::exchange(text_, {});
    return true;
  }

 private:
  std::string text_;
  uint64_t bytes_;
};

}  // namespace

MessageRule MessageRuleOf(uint8_t opcode) {
  using Effect = MessageRule::Effect;
  const Effect effect = opcode == protocol::kHello        ? Effect::kHello
                        : opcode == protocol::kCommandAck ? Effect::kAck
                        : protocol::IsMutating(opcode)    ? Effect::kChanges
                                                          : Effect::kReads;
  return {opcode, protocol::LengthOf(opcode), effect};
}

std::unique_ptr<FrozenPart> Component::Freeze(uint64_t /*most_kept_bytes*/) const {
  ByteWriter writer;
  Save(&writer);
  return std::make_unique<EncodedPart>(writer.Take());
}

}  // namespace pheromone::engine
