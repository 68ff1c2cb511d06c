// Encodes and decodes robots: by link and ID, each with every field of RobotState.

#include <string>
#include <utility>

#include "server/core/engine/event_codec.h"
#include "server/core/engine/robot_table.h"
#include "server/core/engine/robots_part.h"

namespace pheromone::engine {
namespace {

template <typename T, typename Encode>
void EncodeOptional(const std::optional<T>& value, ByteWriter* writer, Encode&& encode) {
  writer->Flag(value.has_value());
  if (value) {
    encode(*value);
  }
}

void EncodeCommand(const CommandState& state, ByteWriter* writer) {
  writer->U8(static_cast<uint8_t>(state.outcome));
  writer->U8(state.command.id);
  writer->U8(state.command.seq);
  writer->U8(static_cast<uint8_t>(state.command.code));
  for (const uint8_t byte : state.command.arguments) {
    writer->U8(byte);
  }
  writer->I16(state.result);
  writer->U8(state.sent);
  writer->U64(state.next_retry_ms);
}

CommandState DecodeCommand(ByteReader* reader) {
  CommandState state;
  state.outcome = static_cast<CommandOutcome>(
      reader->U8UpTo(static_cast<uint8_t>(CommandOutcome::kUnknown), "a command's outcome"));
  state.command.id = reader->U8();
  state.command.seq = reader->U8();
  const uint8_t code = reader->U8();
  if (protocol::CommandArgumentLength(code) > protocol::kMaxCommandArguments) {
    reader->Fail("unknown command " + std::to_string(code));
  }
  state.command.code = static_cast<protocol::CommandCode>(code);
  for (uint8_t& byte : state.command.arguments) {
    byte = reader->U8();
  }
  state.result = reader->I16();
  state.sent = reader->U8UpTo(RobotsPart::kCommandTransmissions, "a command's transmissions");
  state.next_retry_ms = reader->U64();
  return state;
}

void EncodeRobot(const RobotState& robot, ByteWriter* writer) {
  writer->U16(robot.epoch);
  writer->U16(robot.hello.nonce);
  EncodeOptional(robot.previous_nonce, writer, [&](uint16_t nonce) { writer->U16(nonce); });
  protocol::Message hello;
  protocol::Encode(robot.hello, &hello);
  for (uint8_t i = kBehindNonce; i < hello.length; ++i) {
    writer->U8(hello.data[i]);
  }
  writer->U8(robot.last_opcode);
  writer->U8(robot.last_seq);
  writer->U16(robot.last_crc);
  EncodeFields(robot.last_answer, writer);
  writer->U64(robot.last_change);
  writer->U64(robot.last_activity);
  writer->U8(robot.next_command_seq);
  EncodeCommand(robot.command, writer);
  EncodeOptional(robot.last_event, writer, [&](const protocol::EventReport& report) {
    writer->U8(report.id);
    writer->U8(report.seq);
    writer->U8(static_cast<uint8_t>(report.code));
    writer->I16(report.argument);
  });
  EncodeOptional(robot.observed, writer, [&](const ObservedPose& observed) {
    EncodeFields(observed.pose, writer);
    writer->U64(observed.until_ms);
  });
  EncodeOptional(robot.goal, writer, [&](const Goal& goal) { EncodeFields(goal, writer); });
}

RobotState DecodeRobot(uint8_t id, ByteReader* reader) {
  RobotState robot;
  robot.epoch = reader->U16();
  robot.hello.id = id;
  robot.hello.nonce = reader->U16();
  if (reader->Flag()) {
    robot.previous_nonce = reader->U16();
  }
  protocol::Message hello;
  protocol::Encode(robot.hello, &hello);
  for (uint8_t i = kBehindNonce; i < hello.length; ++i) {
    hello.data[i] = reader->U8();
  }
  protocol::Decode(hello, &robot.hello);
  robot.last_opcode = reader->U8();
  robot.last_seq = reader->U8();
  robot.last_crc = reader->U16();
  DecodeFields(reader, &robot.last_answer);
  robot.last_change = reader->U64();
  robot.last_activity = reader->U64();
  robot.next_command_seq = reader->U8();
  robot.command = DecodeCommand(reader);
  if (reader->Flag()) {
    protocol::EventReport report;
    report.id = reader->U8();
    report.seq = reader->U8();
    report.code = static_cast<protocol::EventCode>(reader->U8());
    report.argument = reader->I16();
    robot.last_event = report;
  }
  if (reader->Flag()) {
    ObservedPose observed;
    DecodeFields(reader, &observed.pose);
    observed.until_ms = reader->U64();
    robot.observed = observed;
  }
  if (reader->Flag()) {
    Goal goal;
    DecodeFields(reader, &goal);
    if (reader->ok()) {
      reader->Check(CheckRoute(goal));
    }
    robot.goal = goal;
  }
  return robot;
}

}  // namespace

void RobotTable::Save(ByteWriter* writer) const {
  writer->Count(by_name_.size());
  for (const auto& [name, robots] : by_name_) {
    writer->Text(name);
    writer->Count(robots.robots.size());
    for (const auto& [id, robot] : robots.robots) {
      writer->U8(id);
      EncodeRobot(robot, writer);
    }
  }
}

void RobotTable::Restore(ByteReader* reader) {
  for (uint32_t links = reader->Count(); links > 0 && reader->ok(); --links) {
    const std::string name = reader->Text();
    if (!by_name_.empty() && name <= by_name_.rbegin()->first) {
      reader->Fail("links out of order");
      return;
    }
    Robots& robots = by_name_[name];
    robots.name = name;
    for (uint32_t left = reader->Count(); left > 0 && reader->ok(); --left) {
      const uint8_t id = reader->U8();
      if (!robots.robots.empty() && id <= robots.robots.rbegin()->first) {
        reader->Fail("robots out of order");
        return;
      }
      const RobotState robot = DecodeRobot(id, reader);
      hash_ += Hash(name, id, robot);
      pending_commands_ += robot.has_pending_command() ? 1u : 0u;
      robots.robots.emplace(id, robot);
    }
  }
}

}  // namespace pheromone::engine
