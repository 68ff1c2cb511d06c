#include "server/engine/event_codec.h"

#include <string>
#include <type_traits>

#include "server/engine/config_codec.h"

namespace pheromone::engine {
namespace {

struct Encoder {
  ByteWriter* writer;

  void operator()(const RequestReceived& it) const {
    writer->U16(it.link);
    EncodeMessage(it.message, writer);
  }
  void operator()(const Advance& /*it*/) const {}
  void operator()(const ConfigChanged& it) const {
    writer->U16(it.new_epoch);
    writer->Flag(it.state_lost);
    writer->Flag(it.in_portions);
    EncodeConfig(*it.config, writer);
  }
  void operator()(const CommandIssued& it) const {
    writer->U16(it.link);
    writer->U8(it.id);
    writer->U8(static_cast<uint8_t>(it.code));
    for (const uint8_t byte : it.arguments) {
      writer->U8(byte);
    }
  }
  void operator()(const FieldEdited& it) const {
    field::EncodeEdit(it.edit, writer);
    writer->Flag(it.in_portions);
  }
  void operator()(const PoseObserved& it) const {
    writer->U16(it.link);
    writer->U8(it.id);
    EncodePose(it.pose, writer);
    writer->U32(it.valid_ms);
  }
};

RequestReceived DecodeRequest(ByteReader* reader) {
  RequestReceived it;
  it.link = reader->U16();
  it.message = DecodeMessage(reader);
  return it;
}

ConfigChanged DecodeConfigChanged(uint8_t version, ByteReader* reader) {
  ConfigChanged it;
  it.new_epoch = reader->U16();
  it.state_lost = reader->Flag();
  it.in_portions = version >= 2 && reader->Flag();
  it.config = DecodeConfig(reader, version);
  return it;
}

CommandIssued DecodeCommand(ByteReader* reader) {
  CommandIssued it;
  it.link = reader->U16();
  it.id = reader->U8();
  it.code = static_cast<protocol::CommandCode>(reader->U8());
  for (uint8_t& byte : it.arguments) {
    byte = reader->U8();
  }
  return it;
}

FieldEdited DecodeFieldEdited(uint8_t version, ByteReader* reader) {
  FieldEdited it;
  it.edit = field::DecodeEdit(reader);
  it.in_portions = version >= 2 && reader->Flag();
  return it;
}

PoseObserved DecodeObservation(ByteReader* reader) {
  PoseObserved it;
  it.link = reader->U16();
  it.id = reader->U8();
  it.pose = DecodePose(reader);
  it.valid_ms = reader->U32();
  return it;
}

}  // namespace

EventKind KindOf(const Event& event) {
  static_assert(std::is_same_v<std::variant_alternative_t<0, Event>, RequestReceived> &&
                std::is_same_v<std::variant_alternative_t<5, Event>, PoseObserved>);
  return static_cast<EventKind>(event.index() + 1);
}

void EncodeEvent(const Event& event, ByteWriter* writer) {
  writer->U8(kCodecVersion);
  writer->U8(static_cast<uint8_t>(KindOf(event)));
  std::visit(Encoder{writer}, event);
}

uint8_t DecodeVersion(std::string_view what, ByteReader* reader) {
  const uint8_t version = reader->U8();
  if (reader->ok() && (version < kOldestCodecVersion || version > kCodecVersion)) {
    std::string known = std::to_string(kOldestCodecVersion);
    known += kOldestCodecVersion == kCodecVersion ? "" : " to " + std::to_string(kCodecVersion);
    reader->Fail(std::string(what) + " of version " + std::to_string(version) +
                 ", which this program does not know; it knows " + known);
  }
  return version;
}

size_t EncodedBytesAtMost(const Event& event) {
  constexpr size_t kSmallBytes = 8 + protocol::kMaxData;  // of any event without its list
  constexpr size_t kPointBytes = 16;
  if (const auto* changed = std::get_if<ConfigChanged>(&event)) {
    return kSmallBytes + EncodedBytesAtMost(*changed->config);
  }
  if (const auto* edited = std::get_if<FieldEdited>(&event)) {
    return kSmallBytes + kPointBytes * edited->edit.points.size();
  }
  return kSmallBytes;
}

Event DecodeEvent(ByteReader* reader) {
  const uint8_t version = DecodeVersion("an event", reader);
  if (!reader->ok()) {
    return Advance{};
  }
  const uint8_t kind = reader->U8();
  switch (static_cast<EventKind>(kind)) {
    case EventKind::kRequestReceived:
      return DecodeRequest(reader);
    case EventKind::kAdvance:
      return Advance{};
    case EventKind::kConfigChanged:
      return DecodeConfigChanged(version, reader);
    case EventKind::kCommandIssued:
      return DecodeCommand(reader);
    case EventKind::kFieldEdited:
      return DecodeFieldEdited(version, reader);
    case EventKind::kPoseObserved:
      return DecodeObservation(reader);
  }
  reader->Fail("an event of the unknown kind " + std::to_string(kind));
  return Advance{};
}

void EncodeMessage(const protocol::Message& message, ByteWriter* writer) {
  writer->U8(message.id);
  writer->U8(message.opcode);
  writer->U8(message.length);
  for (uint8_t i = 0; i < message.length; ++i) {
    writer->U8(message.data[i]);
  }
}

protocol::Message DecodeMessage(ByteReader* reader) {
  protocol::Message message;
  message.id = reader->U8();
  message.opcode = reader->U8();
  message.length = reader->U8UpTo(protocol::kMaxData, "a message's length");
  for (uint8_t i = 0; i < message.length; ++i) {
    message.data[i] = reader->U8();
  }
  return message;
}

void EncodePose(const field::PoseUm& pose, ByteWriter* writer) {
  writer->I64(pose.position.x);
  writer->I64(pose.position.y);
  writer->U16(pose.heading);
}

field::PoseUm DecodePose(ByteReader* reader) {
  const int64_t x = reader->I64();
  const int64_t y = reader->I64();
  return {{x, y}, reader->U16()};
}

}  // namespace pheromone::engine
