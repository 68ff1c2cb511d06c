// libFuzzer: a capture file of a stranger never crashes reader or replay, and what is decoded is
// encoded to the same bytes.
//
// The first byte says what the rest is: 0, a file as it is; 1, what follows a good start; 2, all
// records of a file. In the latter two a record is its kind (1 byte), the length of its payload (2
// bytes) and the payload; numbers and checksums, which no fuzzer guesses, are put right. For a
// packet the payload is link, connection and direction (1 byte each), time (4 bytes) and its bytes.
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "proto_tests/fuzz/require.h"
#include "server/core/engine/testing/bench.h"
#include "server/store/capture/payload.h"
#include "server/store/capture/reader.h"
#include "server/store/capture/replay.h"

namespace {

using pheromone::fuzz::Require;
using namespace pheromone;           // NOLINT(google-build-using-namespace)
using namespace pheromone::capture;  // NOLINT(google-build-using-namespace)

// Large maps and many nodes are slow, not wrong; and sanitizers have no memory to spare.
constexpr uint64_t kMaxMemory = uint64_t{1} << 24;

void PlayFile(std::string_view bytes) {
  bool given = false;
  CaptureReader reader([&] { return std::exchange(given, true) ? std::string_view() : bytes; },
                       "fuzz");
  Replay replay;
  while (true) {
    const auto next = reader.Next();
    if (!next.ok() || !next.value() || !replay.Take(*next.value()).ok()) {
      return;
    }
  }
}

Record PacketOf(ByteReader* reader, std::string_view bytes) {
  Packet packet;
  packet.link = reader->U8();
  packet.connection = reader->U8();
  packet.direction = reader->U8() % 2 == 0 ? Direction::kFromRobots : Direction::kToRobots;
  packet.read_ms = reader->U32();
  packet.bytes = reader->ok() ? bytes.substr(7) : "";
  return packet;
}

// Whether the record asks for little, so that a run is short.
bool IsSmall(const Record& record) {
  const auto* applied = std::get_if<EventApplied>(&record);
  const auto* change =
      applied != nullptr ? std::get_if<engine::ConfigChanged>(&applied->event) : nullptr;
  const auto* start = std::get_if<Start>(&record);
  return (change == nullptr || change->config->field.memory_bytes <= kMaxMemory) &&
         (start == nullptr || start->state_bytes <= kMaxMemory);
}

void PlayRecords(std::string_view bytes, bool with_start) {
  Replay replay;
  uint64_t number = 0;
  if (with_start) {
    static const std::string state = [] {
      engine::testing::Bench bench;
      bench.Handle(engine::testing::Hello(1, 1));
      ByteWriter writer;
      bench.engine.Save(&writer);
      return writer.Take();
    }();
    Start start;
    start.links = {{"radio-a", 20, false}, {"radio-b", 0, true}};
    start.state_bytes = state.size();
    Require(replay.Take({++number, 0, 0, start}).ok());
    Require(replay.Take({++number, 0, 0, State{state}}).ok());
  }
  while (bytes.size() >= 3) {
    const size_t kind = static_cast<uint8_t>(bytes[0]) % std::variant_size_v<Record>;
    const size_t size = static_cast<uint8_t>(bytes[1]) | size_t{static_cast<uint8_t>(bytes[2])}
                                                             << 8;
    const std::string_view payload = bytes.substr(3, size);
    bytes.remove_prefix(3 + payload.size());
    ByteReader reader(payload);
    Record record;
    if (kind == Record(Packet()).index()) {
      record = PacketOf(&reader, payload);
    } else {
      record = DecodePayload(kind, &reader);
      reader.ExpectEnd();
      ByteWriter again;
      EncodePayload(record, &again);
      Require(!reader.ok() || again.bytes() == payload);  // no other way to write it
    }
    if (!reader.ok() || !IsSmall(record) || !replay.Take({++number, 0, 0, record}).ok()) {
      return;
    }
  }
  static_cast<void>(replay.Finish());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (bytes.empty()) {
    return 0;
  }
  switch (bytes[0]) {
    case 0:
      PlayFile(bytes.substr(1));
      break;
    case 1:
    case 2:
      PlayRecords(bytes.substr(1), bytes[0] == 1);
      break;
    default:
      break;
  }
  return 0;
}
