// Any bytes as a journal. The first byte says what they are:
//
//   even  records, which get their lengths and checksums: what a journal says that nobody wrote
//   odd   the bytes of a segment, and after them those of a snapshot, as they stand
//
// Recovery must not crash, must find nothing that it then denies, and the state that it comes to
// must be the one that its own log and its own snapshot lead to: with the same hash.

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>

#include "proto_tests/fuzz/require.h"
#include "server/core/engine/event_codec.h"
#include "server/core/engine/testing/bench.h"
#include "server/store/journal/crc32c.h"
#include "server/store/journal/event_reader.h"
#include "server/store/journal/format.h"
#include "server/store/journal/open.h"
#include "server/store/journal/recovery.h"
#include "server/store/journal/snapshot.h"
#include "server/store/journal/testing/crash_folder.h"

namespace {

using pheromone::ByteWriter;
using pheromone::fuzz::Require;
using pheromone::journal::RecordKind;
using pheromone::journal::SegmentName;
using pheromone::journal::SnapshotName;
using pheromone::journal::testing::CrashFolder;

void Put(const std::string& name, std::string_view bytes, CrashFolder* folder) {
  auto file = folder->Create(name);
  Require(file.ok() && file.value()->Append(bytes).ok() && file.value()->Sync().ok() &&
          folder->Sync().ok());
}

// A small map and two robots, so that what follows has something to change.
std::string Beginning() {
  using namespace pheromone::engine;  // NOLINT(google-build-using-namespace)
  EngineConfig config = testing::SmallConfig();
  config.field.map = {
      .origin = {0, 0}, .width_um = 2'000'000, .height_um = 2'000'000, .cell_um = 100'000};
  std::string bytes = EncodeHeader(pheromone::journal::SegmentHeader{1, 1, false});
  ByteWriter scratch;
  pheromone::journal::AppendEvent(1, {1'000, 0}, ConfigChanged{config, 7, false}, &scratch, &bytes);
  pheromone::journal::AppendEvent(2, {1'000, 0}, RequestReceived{0, testing::Hello(1, 1)}, &scratch,
                                  &bytes);
  pheromone::journal::AppendEvent(3, {1'000, 0}, RequestReceived{1, testing::Hello(2, 1)}, &scratch,
                                  &bytes);
  return bytes;
}

// Records of the form: a byte of length, a byte of time, then an event as event_codec.h writes it.
// Some become other kinds of records, such as pieces of events, of which most follow each other.
std::string Records(std::string_view data) {
  std::string bytes = Beginning();
  uint64_t sequence = 3;
  uint64_t now_ms = 1'000;
  std::string pieces;
  while (data.size() > 2) {
    const size_t length = std::min<size_t>(static_cast<uint8_t>(data[0]), data.size() - 2);
    const auto time = static_cast<uint8_t>(data[1]);
    now_ms += uint64_t{time} * time * time;
    const std::string_view rest = data.substr(2, length);
    data.remove_prefix(2 + length);
    const auto kind = static_cast<RecordKind>(time % 16 == 15 ? 2 + time / 16 % 5 : 1);
    ByteWriter payload;
    payload.U8(static_cast<uint8_t>(kind));
    if (kind == RecordKind::kPiece) {
      pieces = time < 128 ? pieces : "";
      payload.U64(pieces.size());
      pieces += rest;
    } else {
      const bool is_event = kind == RecordKind::kEvent || kind == RecordKind::kEventInPieces;
      payload.U64(is_event ? ++sequence : sequence);
      if (is_event) {
        payload.U64(now_ms);
        payload.I64(static_cast<int64_t>(now_ms));
      }
    }
    if (kind == RecordKind::kEventInPieces) {
      payload.U64(pieces.size());
      payload.U32(pheromone::journal::Crc32c(pieces));
    }
    std::string record = payload.Take();
    record += rest;
    ByteWriter header;
    header.U32(static_cast<uint32_t>(record.size()));
    const uint32_t checksum =
        pheromone::journal::Crc32c(record, pheromone::journal::Crc32c(header.bytes()));
    header.U32(checksum);
    bytes += header.bytes() + record;
  }
  return bytes;
}

// With a checksum that is right: the state's own reader is to be tried, not the checksum's.
std::string SnapshotOf(std::string_view state) {
  std::string bytes = EncodeHeader(pheromone::journal::SnapshotHeader{9, {2'000, 0}, 0});
  pheromone::journal::AppendPortion(0, state, &bytes);
  pheromone::journal::AppendPortion(1, {}, &bytes);
  return bytes;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size < 2) {
    return 0;
  }
  const std::string_view input(reinterpret_cast<const char*>(data) + 1, size - 1);
  CrashFolder folder(1);
  if (data[0] % 2 == 0) {
    Put(SegmentName(1), Records(input), &folder);
  } else {
    const size_t cut = input.size() * (data[0] / 2) / 128;
    Put(SegmentName(1), input.substr(0, cut), &folder);
    Put(SnapshotName(9), SnapshotOf(input.substr(cut)), &folder);
  }
  static_cast<void>(pheromone::journal::WalkEvents(folder, [](const auto&) {}));
  const auto opened = pheromone::journal::OpenJournal(
      &folder, {}, [] { return uint64_t{0}; }, [](bool, const std::string&) {});
  if (!opened.ok()) {
    Require(!pheromone::journal::Recover(folder).ok());
    return 0;
  }
  const pheromone::engine::Engine& engine = opened.value().engine;
  const auto again = pheromone::journal::Recover(folder);
  Require(again.ok() && again.value().findings.empty() && !again.value().lost &&
          again.value().sequence == engine.sequence() &&
          again.value().engine.StateHash() == engine.StateHash());
  if (engine.configured()) {
    ByteWriter writer;
    engine.Save(&writer);
    pheromone::ByteReader reader(writer.bytes());
    const auto restored = pheromone::engine::Engine::Restore(&reader);
    Require(restored.ok() && restored.value().StateHash() == engine.StateHash());
  }
  return 0;
}
