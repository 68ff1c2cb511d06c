#include "server/store/capture/written_rounds.h"

#include <utility>

#include "protocol/signing.h"

namespace pheromone::capture {

bool DecodeRound(const protocol::Message& message, protocol::Round* round) {
  return protocol::Decode(message, round) ||
         (message.opcode == protocol::kRound &&
          protocol::Decode(protocol::WithoutSignature(message), round));
}

std::vector<WrittenRounds::Answer> WrittenRounds::Take(engine::LinkIndex link, uint32_t connection,
                                                       const protocol::Round& round,
                                                       InFlight* in_flight) {
  const Turns before =
      std::exchange(turns_[link], {connection, {round.turns, round.turns + round.turn_count}});
  const bool known = before.connection == connection;
  std::vector<Answer> missing;
  for (size_t i = 0; i < round.answer_count; ++i) {
    const protocol::RoundAnswer& values = round.answers[i];
    if (values.left == protocol::kNoIntensities && values.right == 0) {
      continue;
    }
    const uint8_t id = i < before.ids.size() && known ? before.ids[i] : uint8_t{0};
    if (known && id == 0) {
      missing.push_back({id, values});
    } else if (in_flight->TakeFor(link, id, values)) {
      ++taken_;
    } else if (known) {
      missing.push_back({id, values});
    }
  }
  return missing;
}

bool WrittenRounds::Knows(engine::LinkIndex link, uint32_t connection) const {
  const auto turns = turns_.find(link);
  return turns != turns_.end() && turns->second.connection == connection;
}

protocol::Message WrittenRounds::MessageOf(const Answer& answer) {
  protocol::Message message;
  const protocol::RoundAnswer& values = answer.values;
  if (values.left == protocol::kNoIntensities) {
    Encode(protocol::ErrorAnswer{answer.id, 0, static_cast<protocol::Reason>(values.right), 0},
           &message);
  } else {
    Encode(protocol::SenseAnswer{answer.id, protocol::kMinType, false, values.left, values.right},
           &message);
  }
  return message;
}

}  // namespace pheromone::capture
