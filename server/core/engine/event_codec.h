// An event as bytes, for the log: a version, the kind, then the event's fields as it describes them
// (event.h). server/store/journal/README.md has the layout.
//
//   ByteWriter writer;
//   EncodeEvent(RequestReceived{link, message}, &writer);
//   ByteReader reader(writer.bytes());
//   Event same = DecodeEvent(&reader);
//
// Each event has exactly one encoding. Whether it may be applied to a state: Engine::Check. Pure;
// any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "server/base/bytes.h"
#include "server/core/engine/event.h"

namespace pheromone::engine {

/// The version of all encodings in this folder: events, configurations and states.
constexpr uint8_t kCodecVersion = 4;

/// Reads the first byte of an event or a state. Fails the reader for another version; `what` names
/// the object, such as "an event".
void CheckVersion(std::string_view what, ByteReader* reader);

void EncodeEvent(const Event& event, ByteWriter* writer);

/// An upper bound of the bytes that EncodeEvent writes, close except for scattered obstacles. Does
/// not visit points and nodes one by one.
size_t EncodedBytesAtMost(const Event& event);

/// Fails the reader for another version, an unknown kind, or values that no event has; the result
/// is then meaningless.
Event DecodeEvent(ByteReader* reader);

}  // namespace pheromone::engine

/// ID, opcode, length and data; a length beyond protocol::kMaxData fails the reader.
template <>
struct pheromone::FieldCodec<pheromone::protocol::Message> {
  static void Encode(const protocol::Message& message, ByteWriter* writer);
  static void Decode(ByteReader* reader, protocol::Message* message);
  static Status Check(const protocol::Message& /*message*/, const std::string& /*name*/) {
    return Ok();
  }
  static size_t BytesAtMost(const protocol::Message& message) { return size_t{3} + message.length; }
  static std::string Describe(std::string_view name, const std::string& indent);
};

/// The configuration; an invalid one fails the reader.
template <>
struct pheromone::FieldCodec<pheromone::engine::SharedConfig> {
  static void Encode(const engine::SharedConfig& config, ByteWriter* writer) {
    EncodeFields(*config, writer);
  }
  static void Decode(ByteReader* reader, engine::SharedConfig* config);
  static Status Check(const engine::SharedConfig& config, const std::string& name) {
    return CheckFields(*config, name);
  }
  static size_t BytesAtMost(const engine::SharedConfig& config) {
    return pheromone::BytesAtMost(*config);
  }
  static std::string Describe(std::string_view name, const std::string& indent) {
    return indent + std::string(name) + ": as below\n";
  }
};
