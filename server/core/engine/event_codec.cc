#include "server/core/engine/event_codec.h"

#include <string>
#include <type_traits>
#include <utility>

#include "server/core/engine/config_codec.h"

namespace pheromone::engine {
namespace {

template <typename Kind>
Event DecodeOne(ByteReader* reader) {
  Kind event;
  DecodeFields(reader, &event);
  return event;
}

// A decoder for each alternative of Event, in the same order.
template <size_t... kIndex>
Event DecodeKind(uint8_t kind, ByteReader* reader, std::index_sequence<kIndex...> /*all*/) {
  using Decoder = Event (*)(ByteReader*);
  constexpr Decoder kDecoders[] = {DecodeOne<std::variant_alternative_t<kIndex, Event>>...};
  if (kind < 1 || kind > sizeof...(kIndex)) {
    reader->Fail("unknown event kind " + std::to_string(kind));
    return Advance{};
  }
  return kDecoders[kind - 1](reader);
}

}  // namespace

EventKind KindOf(const Event& event) {
  static_assert(std::is_same_v<std::variant_alternative_t<0, Event>, RequestReceived> &&
                std::is_same_v<std::variant_alternative_t<11, Event>, KeysRevoked>);
  return static_cast<EventKind>(event.index() + 1);
}

void EncodeEvent(const Event& event, ByteWriter* writer) {
  writer->U8(kCodecVersion);
  writer->U8(static_cast<uint8_t>(KindOf(event)));
  std::visit([writer](const auto& it) { EncodeFields(it, writer); }, event);
}

void CheckVersion(std::string_view what, ByteReader* reader) {
  const uint8_t version = reader->U8();
  if (reader->ok() && version != kCodecVersion) {
    reader->Fail(std::string(what) + " of version " + std::to_string(version) +
                 ", but this program reads version " + std::to_string(kCodecVersion) +
                 "; use the program that wrote it");
  }
}

size_t EncodedBytesAtMost(const Event& event) {
  constexpr size_t kHeadBytes = 2;
  return kHeadBytes + std::visit([](const auto& it) { return BytesAtMost(it); }, event);
}

Event DecodeEvent(ByteReader* reader) {
  CheckVersion("an event", reader);
  const uint8_t kind = reader->U8();
  return DecodeKind(kind, reader, std::make_index_sequence<std::variant_size_v<Event>>());
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

void FieldCodec<Message>::Decode(ByteReader* reader, Message* message) {
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

void FieldCodec<engine::SharedConfig>::Decode(ByteReader* reader, engine::SharedConfig* config) {
  *config = engine::DecodeConfig(reader);
}

}  // namespace pheromone
