// An event as bytes, for the log: a version, the kind, then the fields in the order of their
// declaration. server/journal/README.md has the layout.
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
constexpr uint8_t kCodecVersion = 2;

/// The byte with which an event and a state begin. Fails the reader for a version that cannot be
/// read; `what` says what has it, such as "an event".
uint8_t DecodeVersion(std::string_view what, ByteReader* reader);

/// The numbers of the kinds, in bytes and in exports; never used again for another kind.
enum class EventKind : uint8_t {
  kRequestReceived = 1,
  kAdvance = 2,
  kConfigChanged = 3,
  kCommandIssued = 4,
  kFieldEdited = 5,
  kPoseObserved = 6,
};
EventKind KindOf(const Event& event);

void EncodeEvent(const Event& event, ByteWriter* writer);

/// At least as many bytes as EncodeEvent writes, and not many more but for scattered obstacles.
/// Does not look at points and nodes one by one.
size_t EncodedBytesAtMost(const Event& event);

/// Of any version. Fails the reader for one that is not known, an unknown kind, or values that no
/// event has; what is returned then is of no use.
Event DecodeEvent(ByteReader* reader);

/// ID, opcode, length and data; a length beyond protocol::kMaxData fails the reader.
void EncodeMessage(const protocol::Message& message, ByteWriter* writer);
protocol::Message DecodeMessage(ByteReader* reader);

/// Position and heading.
void EncodePose(const field::PoseUm& pose, ByteWriter* writer);
field::PoseUm DecodePose(ByteReader* reader);

}  // namespace pheromone::engine
