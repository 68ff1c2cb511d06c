// An event as bytes, for the log: a version, the kind, then the event's fields as it describes them
// (event.h). server/journal/README.md has the layout.
//
//   ByteWriter writer;
//   EncodeEvent(RequestReceived{link, message}, &writer);
//   ByteReader reader(writer.bytes());
//   Event same = DecodeEvent(&reader);
//
// There is one way to write an event. Whether it may be applied to some state is another question:
// Engine::Check. Pure; any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "server/base/bytes.h"
#include "server/engine/event.h"

namespace pheromone::engine {

/// Of everything in this folder that is written to bytes: events, configurations and states. All is
/// written in the newest version; all versions from the oldest on can be read. What a version adds
/// or changes is a condition on `version` in the decoder of that thing, and nowhere else.
constexpr uint8_t kOldestCodecVersion = 1;
constexpr uint8_t kCodecVersion = 3;

/// The byte with which an event and a state begin. Fails the reader for a version that cannot be
/// read; `what` says what has it, such as "an event".
uint8_t DecodeVersion(std::string_view what, ByteReader* reader);

void EncodeEvent(const Event& event, ByteWriter* writer);

/// At least as many bytes as EncodeEvent writes, and not many more but for scattered obstacles.
/// Does not look at points and nodes one by one.
size_t EncodedBytesAtMost(const Event& event);

/// Of any version. Fails the reader for one that is not known, an unknown kind, or values that no
/// event has; what is returned then is of no use.
Event DecodeEvent(ByteReader* reader);

}  // namespace pheromone::engine

/// ID, opcode, length and data; a length beyond protocol::kMaxData fails the reader.
template <>
struct pheromone::FieldCodec<pheromone::protocol::Message> {
  static void Encode(const protocol::Message& message, ByteWriter* writer);
  static void Decode(ByteReader* reader, uint8_t version, protocol::Message* message);
  static Status Check(const protocol::Message& /*message*/, const std::string& /*name*/) {
    return Ok();
  }
  static size_t BytesAtMost(const protocol::Message& message) { return size_t{3} + message.length; }
  static std::string Describe(std::string_view name, const std::string& indent);
};

/// The configuration; one that could not be run fails the reader.
template <>
struct pheromone::FieldCodec<pheromone::engine::SharedConfig> {
  static void Encode(const engine::SharedConfig& config, ByteWriter* writer) {
    EncodeFields(*config, writer);
  }
  static void Decode(ByteReader* reader, uint8_t version, engine::SharedConfig* config);
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
