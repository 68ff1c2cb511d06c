#include "client_fw/experiments/trails/net_tally.h"

#include <array>

#include "protocol/byte_order.h"
#include "protocol/signing.h"
#include "protocol/tag_messages.h"

namespace pheromone::swarm {
namespace {

using Statement = std::array<uint8_t, protocol::kNetStatementSize>;

Statement StatementOf(const int32_t* words) {
  Statement statement{};
  for (size_t i = 0; i < protocol::kStatementWords; ++i) {
    protocol::PutI32(statement.data() + 4 * i, words[i]);
  }
  return statement;
}

// Of any net.
template <typename Record>
std::optional<Record> RecordIn(const int32_t* words) {
  const Statement statement = StatementOf(words);
  Record record{};
  const auto fault = Decode(statement.data(), protocol::NetHashOf(statement.data()), &record);
  return fault == protocol::NetRecordFault::kNone ? std::optional(record) : std::nullopt;
}

}  // namespace

void NetTally::OnByte(uint8_t byte, int64_t time_ns) {
  const int64_t time_ms = time_ns / 1'000'000;
  if (decoder_.Push(byte, static_cast<uint32_t>(time_ms))) {
    const protocol::Message& heard = decoder_.message();
    Hear(is_signed_ ? protocol::WithoutSignature(heard) : heard, time_ms);
  }
}

void NetTally::Hear(const protocol::Message& message, int64_t time_ms) {
  Robot& robot = robots_[message.id];
  protocol::SymbolAnswer symbol;
  protocol::TagWriteRequest write;
  protocol::TagReadAnswer read;
  if (Decode(message, &symbol) && symbol.kind == protocol::SymbolKind::kRobot) {
    robot.number = symbol.number;
  } else if (Decode(message, &write)) {
    const auto record = RecordIn<protocol::RobotRecord>(write.words);
    if (record && robot.answered != record->seq) {
      robot.written = record;
      robot.tag = write.tag;
    }
  } else if (Decode(message, &read) && robot.written && read.tag == robot.tag) {
    const auto outcome =
        RecordIn<protocol::EnvironmentRecord>(read.words + protocol::kWordSubjectNamespace);
    if (outcome && outcome->outcome != protocol::NetOutcome::kNone &&
        outcome->seq == robot.written->seq &&
        (robot.number == 0 || outcome->robot == robot.number)) {
      const NetTold told{.time_ms = time_ms,
                         .id = message.id,
                         .tag = robot.tag,
                         .record = *robot.written,
                         .accepted = outcome->outcome == protocol::NetOutcome::kAccepted,
                         .granted = outcome->amount};
      robot.answered = told.record.seq;
      robot.written.reset();
      tell_(told);
    }
  }
}

}  // namespace pheromone::swarm
