// The bytes of the journal's files (README.md describes them): names, headers, records.
//
//   std::string file = EncodeHeader(SegmentHeader{...});
//   AppendEvent(sequence, stamp, event, &scratch, &file);
//
//   RecordReader reader(file, kSegmentHeaderBytes);
//   Record record;
//   while (reader.Next(&record) == RecordReader::Found::kRecord) ...
//
// Pure; any thread.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "server/base/bytes.h"
#include "server/base/result.h"
#include "server/core/engine/event.h"

namespace pheromone::journal {

/// Of segments and snapshots.
constexpr uint32_t kFileVersion = 2;

/// "00000042.segment": segments in the order in which they were begun.
std::string SegmentName(uint64_t ordinal);
/// "00000000000000004711.snapshot": the state after that sequence.
std::string SnapshotName(uint64_t sequence);
/// The number in such a name; empty for the name of another file.
std::optional<uint64_t> OrdinalOf(std::string_view name);
std::optional<uint64_t> SnapshotSequenceOf(std::string_view name);
/// Added to the names of files that are still being written, and of damaged ones.
constexpr std::string_view kUnfinished = ".new";
constexpr std::string_view kDamaged = ".damaged";

struct SegmentHeader {
  uint64_t ordinal = 0;
  /// Everything before this was durable when the segment was begun; from it on, the segment
  /// replaces the earlier ones.
  uint64_t first_sequence = 1;
  bool relaxed = false;  ///< changes were acknowledged before they were durable
  bool operator==(const SegmentHeader&) const = default;
};
constexpr size_t kSegmentHeaderBytes = 36;
std::string EncodeHeader(const SegmentHeader& header);
/// Decodes the header at the start of `bytes`. Errors: incomplete, not a segment, another version.
Result<SegmentHeader> DecodeSegmentHeader(std::string_view bytes);

struct SnapshotHeader {
  uint64_t sequence = 0;
  engine::Stamp stamp;  ///< of that event
  uint64_t state_hash = 0;
};
constexpr size_t kSnapshotHeaderBytes = 48;
std::string EncodeHeader(const SnapshotHeader& header);
Result<SnapshotHeader> DecodeSnapshotHeader(std::string_view bytes);

/// A file of another version is not damaged: this program must leave it alone.
bool IsOfAnotherVersion(std::string_view bytes);

enum class RecordKind : uint8_t {
  kEvent = 1,
  kGroup = 2,  ///< everything up to `sequence` was durable when the next records were written
  kHash = 3,   ///< after `sequence`, the state's hash was `hash`
  kEnd = 4,    ///< an orderly end: everything up to `sequence` was durable, and nothing follows
  kPiece = 5,  ///< bytes of a large event, before its record; without effect by itself
  kEventInPieces = 6,  ///< an event whose bytes are those of the pieces before it
};

struct Record {
  uint64_t at = 0;  ///< the byte of the file where it begins
  RecordKind kind = RecordKind::kEvent;
  uint64_t sequence = 0;
  engine::Stamp stamp;         ///< kEvent, kEventInPieces
  uint64_t hash = 0;           ///< kHash
  std::string_view event;      ///< kEvent: for engine::DecodeEvent; kPiece: some bytes of that
  uint64_t offset = 0;         ///< kPiece: of these in the event's
  engine::WrittenAhead ahead;  ///< kEventInPieces: the expected length and checksum
  std::string_view bytes;      ///< the whole record
};

/// `scratch` is empty before and after; reusing a writer saves an allocation.
void AppendEvent(uint64_t sequence, const engine::Stamp& stamp, const engine::Event& event,
                 ByteWriter* scratch, std::string* to);
void AppendPiece(uint64_t offset, std::string_view bytes, std::string* to);
void AppendEventInPieces(uint64_t sequence, const engine::Stamp& stamp,
                         const engine::WrittenAhead& ahead, std::string* to);
/// Completes the record that AppendEvent would make of an event, whose bytes are already in
/// `*record` after space for the record's header.
constexpr size_t kBeforeEventBytes = 8 + 1 + 8 + 8 + 8;
void FinishEvent(uint64_t sequence, const engine::Stamp& stamp, std::string* record);
void AppendGroup(uint64_t durable_sequence, std::string* to);
void AppendHash(uint64_t sequence, uint64_t hash, std::string* to);
void AppendEnd(uint64_t sequence, std::string* to);

/// The parts of a snapshot's state: `number` counts from 0, and an empty one is the last.
void AppendPortion(uint32_t number, std::string_view portion, std::string* to);
constexpr size_t kPortionHeaderBytes = 8;

/// The records of a segment, one after the other. SegmentReader puts pieces together.
class RecordReader {
 public:
  enum class Found { kRecord, kEnd, kBad };

  /// `file` is the complete segment, and must outlive the records found in it.
  explicit RecordReader(std::string_view file, size_t at = kSegmentHeaderBytes)
      : file_(file), at_(at) {}

  /// kBad: at() is the position of something that is not a valid record; `why()` is the reason.
  Found Next(Record* record);

  size_t at() const { return at_; }
  const std::string& why() const { return why_; }

 private:
  Found Bad(std::string why);

  std::string_view file_;
  size_t at_;
  std::string why_;
};

/// The highest sequence reported as durable by a group or an end anywhere from `at` on, whatever
/// lies between them; 0 if there is none.
uint64_t DurableIn(std::string_view file, size_t at);

}  // namespace pheromone::journal
