#include "server/core/engine/refusal.h"

namespace pheromone::engine {

using protocol::Message;
using protocol::Reason;

Message ErrorMessage(const Message& message, Reason reason) {
  const bool has_seq = protocol::IsMutating(message.opcode) && message.length > 0;
  const uint8_t seq = has_seq ? message.data[0] : uint8_t{0};
  Message error;
  protocol::Encode(protocol::ErrorAnswer{message.id, message.opcode, reason, seq}, &error);
  return error;
}

}  // namespace pheromone::engine
