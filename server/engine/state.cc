// The engine's state as bytes, and back: configuration, epoch, robots, broadcasts, field; at the
// end the hash of the state, by which the reader knows that it has the same.

#include <string>
#include <utility>

#include "server/engine/config_codec.h"
#include "server/engine/config_hash.h"
#include "server/engine/engine.h"
#include "server/engine/event_codec.h"
#include "server/engine/frozen_state.h"

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
  state.sent = reader->U8UpTo(Engine::kCommandTransmissions, "a command's transmissions");
  state.next_retry_ms = reader->U64();
  return state;
}

void EncodeRobot(const RobotState& robot, ByteWriter* writer) {
  writer->U16(robot.epoch);
  writer->U16(robot.nonce);
  EncodeOptional(robot.previous_nonce, writer, [&](uint16_t nonce) { writer->U16(nonce); });
  writer->U8(robot.firmware_version);
  writer->U8(robot.capabilities);
  writer->Flag(robot.has_last);
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
}

RobotState DecodeRobot(uint8_t version, ByteReader* reader) {
  RobotState robot;
  robot.epoch = reader->U16();
  robot.nonce = reader->U16();
  if (reader->Flag()) {
    robot.previous_nonce = reader->U16();
  }
  robot.firmware_version = reader->U8();
  robot.capabilities = reader->U8();
  robot.has_last = reader->Flag();
  robot.last_opcode = reader->U8();
  robot.last_seq = reader->U8();
  robot.last_crc = reader->U16();
  DecodeFields(reader, version, &robot.last_answer);
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
    DecodeFields(reader, version, &observed.pose);
    observed.until_ms = reader->U64();
    robot.observed = observed;
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

void RobotTable::Restore(uint8_t version, ByteReader* reader) {
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
      const RobotState robot = DecodeRobot(version, reader);
      hash_ += Hash(name, id, robot);
      pending_commands_ += robot.has_pending_command() ? 1u : 0u;
      robots.robots.emplace(id, robot);
    }
  }
}

void Engine::Save(ByteWriter* writer) const {
  writer->U8(kCodecVersion);
  EncodeConfig(*config_, writer);
  SaveAfterConfig(writer);
  field_->Save(writer);
  writer->U64(StateHash());
}

// What lies between the configuration and the field.
void Engine::SaveAfterConfig(ByteWriter* writer) const {
  writer->U16(epoch_);
  writer->U64(field_time_ms_);
  writer->U64(sequence_);
  writer->U8(next_broadcast_seq_);
  writer->Count(broadcasts_.size());
  for (const Broadcast& broadcast : broadcasts_) {
    writer->U16(broadcast.link);
    writer->U8(broadcast.seq);
    writer->U8(broadcast.left);
    writer->U64(broadcast.next_ms);
  }
  robots_.Save(writer);
}

std::unique_ptr<FrozenState> Engine::Freeze(uint64_t most_kept_bytes) const {
  std::unique_ptr<field::FrozenField> field = field_->Freeze(most_kept_bytes);
  if (field == nullptr) {
    return nullptr;
  }
  ByteWriter robots;
  SaveAfterConfig(&robots);
  return std::make_unique<FrozenState>(FrozenState::Parts{
      .sequence = sequence_,
      .stamp = last_stamp_,
      .state_hash = StateHash(),
      .config = config_,
      .config_bytes = config_figures_.bytes,
      .after_config = robots.Take(),
      .field = std::move(field),
  });
}

// Each version that was ever written is read; what differs between two is told apart here.
Result<Engine> Engine::Restore(ByteReader* reader) {
  const uint8_t version = DecodeVersion("a state", reader);
  if (!reader->ok()) {
    return Error{reader->error()};
  }
  Engine engine;
  const SharedConfig config = DecodeConfig(reader, version);
  engine.epoch_ = reader->U16();
  engine.field_time_ms_ = reader->U64();
  engine.sequence_ = reader->U64();
  engine.next_broadcast_seq_ = reader->U8();
  for (uint32_t left = reader->Count(); left > 0 && reader->ok(); --left) {
    Broadcast broadcast{};
    broadcast.link = reader->U16();
    broadcast.seq = reader->U8();
    broadcast.left = reader->U8UpTo(kBroadcastTransmissions, "a broadcast's transmissions");
    broadcast.next_ms = reader->U64();
    if (broadcast.link >= config->links.size() || broadcast.left == 0) {
      reader->Fail("a broadcast that has ended or has no link");
    }
    engine.broadcasts_.push_back(broadcast);
  }
  engine.robots_.Restore(version, reader);
  if (reader->ok()) {
    engine.field_ = field::Field::Restore(config.field(), reader, version >= 2);
  }
  const uint64_t hash = reader->U64();
  if (reader->ok()) {
    engine.TakeConfig(config, FiguresOf(*config));
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
