#include "server/operators/ctl/tags/record_text.h"

#include <fmt/format.h>

#include "protocol/net_record.h"
#include "server/core/engine/nets_part.h"
#include "server/core/petri/live_rules.h"

namespace pheromone::ctl {
namespace {

using protocol::NetRecordFault;

std::string Text(const protocol::TriggerRecord& record) {
  std::string text = record.count == 0 ? "fires nothing" : "fires";
  for (uint8_t i = 0; i < record.count; ++i) {
    text += fmt::format("{}{}", i == 0 ? " " : ", ", record.candidates[i]);
  }
  return text;
}

std::string Text(const protocol::EnvironmentRecord& record) {
  std::string text =
      (record.state & protocol::kNetGreen) != 0 ? fmt::format("green for {}", record.robot) : "red";
  text += (record.state & protocol::kNetAdviceA) != 0   ? ", advice 01"
          : (record.state & protocol::kNetAdviceB) != 0 ? ", advice 10"
                                                        : "";
  if (record.outcome != protocol::NetOutcome::kNone) {
    text += fmt::format("; record {} of {} {}, amount {}", record.seq, record.robot,
                        record.outcome == protocol::NetOutcome::kAccepted ? "accepted" : "refused",
                        record.amount);
  }
  return text + (record.left != 0 ? fmt::format("; {} left", record.left) : "");
}

std::string Text(const protocol::RobotRecord& record) {
  return fmt::format("record {}: {}, amount {}, energy {}", record.seq,
                     petri::NameOf(static_cast<petri::LiveAction>(record.action)), record.amount,
                     record.energy);
}

std::string FaultText(NetRecordFault fault) {
  switch (fault) {
    case NetRecordFault::kVersion:
      return "unknown version";
    case NetRecordFault::kCrc:
      return "wrong CRC";
    case NetRecordFault::kValue:
      return "unknown value";
    default:
      return "unknown kind";
  }
}

}  // namespace

std::string RecordText(const tags::Block& block) {
  const engine::NetStatement statement = engine::StatementOf(block);
  const uint32_t hash = protocol::NetHashOf(statement.data());
  std::string text;
  NetRecordFault fault = NetRecordFault::kKind;
  const auto read = [&](auto record) {
    if (fault == NetRecordFault::kKind) {
      fault = protocol::Decode(statement.data(), hash, &record);
      text = fault == NetRecordFault::kNone ? Text(record) : FaultText(fault);
    }
  };
  read(protocol::TriggerRecord{});
  read(protocol::EnvironmentRecord{});
  read(protocol::RobotRecord{});
  return fmt::format("net {:08x}: {}", hash, text);
}

}  // namespace pheromone::ctl
