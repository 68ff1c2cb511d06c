#include "server/engine/event_codec.h"

#include <string>
#include <type_traits>
#include <utility>

#include "server/engine/config_codec.h"

namespace pheromone::engine {
namespace {

template <typename Kind>
Event DecodeOne(uint8_t version, ByteReader* reader) {
  Kind event;
  DecodeFields(reader, version, &event);
  return event;
}

// The alternatives of Event that have a kind of their own.
constexpr size_t kPlainKinds = std::variant_size_v<Event> - 1;

// A decoder for each of them, in the same order.
template <size_t... kIndex>
Event DecodeKind(uint8_t kind, uint8_t version, ByteReader* reader,
                 std::index_sequence<kIndex...> /*all*/) {
  using Decoder = Event (*)(uint8_t, ByteReader*);
  constexpr Decoder kDecoders[] = {DecodeOne<std::variant_alternative_t<kIndex, Event>>...};
  if (version >= 3 && kind >= static_cast<uint8_t>(EventKind::kFirstOfComponents)) {
    ComponentEvent event;
    DecodeFields(reader, version, &event);
    event.kind = static_cast<EventKind>(kind);
    return event;
  }
  constexpr uint8_t kKindsBeforeGoals = 6;
  if (kind < 1 || kind > (version < 4 ? kKindsBeforeGoals : sizeof...(kIndex))) {
    reader->Fail("unknown event kind " + std::to_string(kind));
    return Advance{};
  }
  return kDecoders[kind - 1](version, reader);
}

}  // namespace

EventKind KindOf(const Event& event) {
  if (const auto* const of_component = std::get_if<ComponentEvent>(&event)) {
    return of_component->kind;
  }
  static_assert(std::is_same_v<std::variant_alternative_t<0, Event>, RequestReceived> &&
                std::is_same_v<std::variant_alternative_t<7, Event>, GoalEnded>);
  return static_cast<EventKind>(event.index() + 1);
}

void EncodeEvent(const Event& event, ByteWriter* writer) {
  writer->U8(kCodecVersion);
  writer->U8(static_cast<uint8_t>(KindOf(event)));
  std::visit([writer](const auto& it) { EncodeFields(it, writer); }, event);
}

uint8_t DecodeVersion(std::string_view what, ByteReader* reader) {
  const uint8_t version = reader->U8();
  if (reader->ok() && (version < kOldestCodecVersion || version > kCodecVersion)) {
    std::string known = std::to_string(kOldestCodecVersion);
    known += kOldestCodecVersion == kCodecVersion ? "" : " to " + std::to_string(kCodecVersion);
    reader->Fail(std::string(what) + " of version " + std::to_string(version) + ", expected " +
                 known);
  }
  return version;
}

size_t EncodedBytesAtMost(const Event& event) {
  constexpr size_t kHeadBytes = 2;
  return kHeadBytes + std::visit([](const auto& it) { return BytesAtMost(it); }, event);
}

Event DecodeEvent(ByteReader* reader) {
  const uint8_t version = DecodeVersion("an event", reader);
  const uint8_t kind = reader->U8();
  return DecodeKind(kind, version, reader, std::make_index_sequence<kPlainKinds>());
}

}  // namespace pheromone::engine

namespace pheromone {

using protocol::Message;

void FieldCodec<Message>::Encode(const Message& message, ByteWriter* writer) {
  writer->U8(message.id);
  writer->U8(message.opcode);
  writer->U8(message.length);
  for (uint8_t i = 0; i < message.length; ++i) {
    writer->U8(message.data[i]);
  }
}

void FieldCodec<Message>::Decode(ByteReader* reader, uint8_t /*version*/, Message* message) {
  message->id = reader->U8();
  message->opcode = reader->U8();
  message->length = reader->U8UpTo(protocol::kMaxData, "a message's length");
  for (uint8_t i = 0; i < message->length; ++i) {
    message->data[i] = reader->U8();
  }
}

std::string FieldCodec<Message>::Describe(std::string_view name, const std::string& indent) {
  const std::string whole(name);
  return indent + "u8 " + whole + ".id\n" + indent + "u8 " + whole + ".opcode\n" +  //
         indent + "u8 " + whole + ".length: 0 to " + std::to_string(protocol::kMaxData) + "\n" +
         indent + "that many bytes " + whole + ".data\n";
}

void FieldCodec<engine::SharedConfig>::Decode(ByteReader* reader, uint8_t version,
                                              engine::SharedConfig* config) {
  *config = engine::DecodeConfig(reader, version);
}

}  // namespace pheromone
