#include "server/store/journal/format.h"

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <utility>

#include "server/core/engine/event_codec.h"
#include "server/store/journal/crc32c.h"

namespace pheromone::journal {
namespace {

constexpr std::string_view kSegmentMagic = "PHEROLOG";
constexpr std::string_view kSnapshotMagic = "PHEROSNP";
constexpr std::string_view kSegmentEnding = ".segment";
constexpr std::string_view kSnapshotEnding = ".snapshot";
constexpr int kOrdinalDigits = 8;
constexpr int kSequenceDigits = 20;
constexpr size_t kRecordHeaderBytes = 8;             // length and checksum
constexpr size_t kMarkBytes = 1 + 8;                 // of a group or an end: kind and sequence
constexpr size_t kEventHeaderBytes = 1 + 8 + 8 + 8;  // kind, sequence, stamp
constexpr uint32_t kFlagRelaxed = 1;

std::string Numbered(uint64_t number, int digits, std::string_view ending) {
  char text[32];
  std::snprintf(text, sizeof text, "%0*llu", digits, static_cast<unsigned long long>(number));
  return std::string(text).append(ending);
}

std::optional<uint64_t> NumberBefore(std::string_view name, std::string_view ending, int digits) {
  if (!name.ends_with(ending)) {
    return std::nullopt;
  }
  name.remove_suffix(ending.size());
  uint64_t number = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  // The name that we would have given it, and no other spelling of the number.
  return error == std::errc() && end == name.data() + name.size() &&
                 Numbered(number, digits, "") == name
             ? std::optional(number)
             : std::nullopt;
}

uint32_t U32At(std::string_view bytes, size_t at) {
  return ByteReader(bytes.substr(at, 4)).U32();
}

// A header's checksum stands at its end and covers all before it.
std::string Sealed(ByteWriter* writer) {
  writer->U32(Crc32c(writer->bytes()));
  return writer->Take();
}

Status CheckHeader(std::string_view bytes, std::string_view magic, size_t size,
                   std::string_view what) {
  if (bytes.size() < size) {
    return Error{"header truncated after " + std::to_string(bytes.size()) + " bytes"};
  }
  if (!bytes.starts_with(magic)) {
    return Error{"is not " + std::string(what)};
  }
  if (Crc32c(bytes.substr(0, size - 4)) != U32At(bytes, size - 4)) {
    return Error{"damaged header: checksum mismatch"};
  }
  const uint32_t version = U32At(bytes, magic.size());
  if (version != kFileVersion) {
    return Error{"has version " + std::to_string(version) + ", but this program reads version " +
                 std::to_string(kFileVersion) +
                 "; use the program that wrote it, or another journal folder"};
  }
  return Ok();
}

// The checksum of a record also covers its length, so that zeros are not a valid record.
uint32_t ChecksumOf(std::string_view payload) {
  ByteWriter length;
  length.U32(static_cast<uint32_t>(payload.size()));
  return Crc32c(payload, Crc32c(length.bytes()));
}

void AppendRecord(std::string_view payload, std::string* to) {
  ByteWriter header;
  header.U32(static_cast<uint32_t>(payload.size()));
  header.U32(ChecksumOf(payload));
  to->append(header.bytes()).append(payload);
}

void AppendMark(RecordKind kind, uint64_t sequence, std::string* to) {
  ByteWriter writer;
  writer.U8(static_cast<uint8_t>(kind));
  writer.U64(sequence);
  AppendRecord(writer.bytes(), to);
}

}  // namespace

std::string SegmentName(uint64_t ordinal) {
  return Numbered(ordinal, kOrdinalDigits, kSegmentEnding);
}

std::string SnapshotName(uint64_t sequence) {
  return Numbered(sequence, kSequenceDigits, kSnapshotEnding);
}

std::optional<uint64_t> OrdinalOf(std::string_view name) {
  return NumberBefore(name, kSegmentEnding, kOrdinalDigits);
}

std::optional<uint64_t> SnapshotSequenceOf(std::string_view name) {
  return NumberBefore(name, kSnapshotEnding, kSequenceDigits);
}

std::string EncodeHeader(const SegmentHeader& header) {
  ByteWriter writer;
  for (const char c : kSegmentMagic) {
    writer.U8(static_cast<uint8_t>(c));
  }
  writer.U32(kFileVersion);
  writer.U32(header.relaxed ? kFlagRelaxed : 0);
  writer.U64(header.ordinal);
  writer.U64(header.first_sequence);
  return Sealed(&writer);
}

Result<SegmentHeader> DecodeSegmentHeader(std::string_view bytes) {
  PHEROMONE_TRY_STATUS(CheckHeader(bytes, kSegmentMagic, kSegmentHeaderBytes, "a segment"));
  ByteReader reader(bytes.substr(kSegmentMagic.size() + 4));
  SegmentHeader header;
  header.relaxed = (reader.U32() & kFlagRelaxed) != 0;
  header.ordinal = reader.U64();
  header.first_sequence = reader.U64();
  if (header.first_sequence == 0) {
    return Error{"its header begins at sequence 0, expected 1 or more"};
  }
  return header;
}

std::string EncodeHeader(const SnapshotHeader& header) {
  ByteWriter writer;
  for (const char c : kSnapshotMagic) {
    writer.U8(static_cast<uint8_t>(c));
  }
  writer.U32(kFileVersion);
  writer.U64(header.sequence);
  writer.U64(header.stamp.field_time_ms);
  writer.I64(header.stamp.utc_ms);
  writer.U64(header.state_hash);
  return Sealed(&writer);
}

Result<SnapshotHeader> DecodeSnapshotHeader(std::string_view bytes) {
  PHEROMONE_TRY_STATUS(CheckHeader(bytes, kSnapshotMagic, kSnapshotHeaderBytes, "a snapshot"));
  ByteReader reader(bytes.substr(kSnapshotMagic.size() + 4));
  SnapshotHeader header;
  header.sequence = reader.U64();
  header.stamp.field_time_ms = reader.U64();
  header.stamp.utc_ms = reader.I64();
  header.state_hash = reader.U64();
  return header;
}

bool IsOfAnotherVersion(std::string_view bytes) {
  const bool is_segment = bytes.starts_with(kSegmentMagic);
  const size_t size = is_segment                          ? kSegmentHeaderBytes
                      : bytes.starts_with(kSnapshotMagic) ? kSnapshotHeaderBytes
                                                          : SIZE_MAX;
  return bytes.size() >= size && Crc32c(bytes.substr(0, size - 4)) == U32At(bytes, size - 4) &&
         U32At(bytes, kSegmentMagic.size()) != kFileVersion;
}

void AppendEvent(uint64_t sequence, const engine::Stamp& stamp, const engine::Event& event,
                 ByteWriter* scratch, std::string* to) {
  scratch->U8(static_cast<uint8_t>(RecordKind::kEvent));
  scratch->U64(sequence);
  scratch->U64(stamp.field_time_ms);
  scratch->I64(stamp.utc_ms);
  engine::EncodeEvent(event, scratch);
  AppendRecord(scratch->bytes(), to);
  scratch->Clear();
}

void AppendPiece(uint64_t offset, std::string_view bytes, std::string* to) {
  ByteWriter writer;
  writer.U8(static_cast<uint8_t>(RecordKind::kPiece));
  writer.U64(offset);
  writer.Raw(bytes);
  AppendRecord(writer.bytes(), to);
}

void AppendEventInPieces(uint64_t sequence, const engine::Stamp& stamp,
                         const engine::WrittenAhead& ahead, std::string* to) {
  ByteWriter writer;
  writer.U8(static_cast<uint8_t>(RecordKind::kEventInPieces));
  writer.U64(sequence);
  writer.U64(stamp.field_time_ms);
  writer.I64(stamp.utc_ms);
  writer.U64(ahead.bytes);
  writer.U32(ahead.checksum);
  AppendRecord(writer.bytes(), to);
}

void FinishEvent(uint64_t sequence, const engine::Stamp& stamp, std::string* record) {
  static_assert(kBeforeEventBytes == kRecordHeaderBytes + kEventHeaderBytes);
  ByteWriter head;
  head.U8(static_cast<uint8_t>(RecordKind::kEvent));
  head.U64(sequence);
  head.U64(stamp.field_time_ms);
  head.I64(stamp.utc_ms);
  record->replace(kRecordHeaderBytes, kEventHeaderBytes, head.bytes());
  const std::string_view payload = std::string_view(*record).substr(kRecordHeaderBytes);
  ByteWriter header;
  header.U32(static_cast<uint32_t>(payload.size()));
  header.U32(ChecksumOf(payload));
  record->replace(0, kRecordHeaderBytes, header.bytes());
}

void AppendGroup(uint64_t durable_sequence, std::string* to) {
  AppendMark(RecordKind::kGroup, durable_sequence, to);
}

void AppendHash(uint64_t sequence, uint64_t hash, std::string* to) {
  ByteWriter writer;
  writer.U8(static_cast<uint8_t>(RecordKind::kHash));
  writer.U64(sequence);
  writer.U64(hash);
  AppendRecord(writer.bytes(), to);
}

void AppendEnd(uint64_t sequence, std::string* to) {
  AppendMark(RecordKind::kEnd, sequence, to);
}

void AppendPortion(uint32_t number, std::string_view portion, std::string* to) {
  ByteWriter head;
  head.U32(number);
  ByteWriter header;
  header.U32(static_cast<uint32_t>(portion.size()));
  header.U32(Crc32c(portion, Crc32c(head.bytes())));
  to->append(header.bytes()).append(portion);
}

RecordReader::Found RecordReader::Bad(std::string why) {
  why_ = std::move(why);
  return Found::kBad;
}

RecordReader::Found RecordReader::Next(Record* record) {
  const std::string_view rest = file_.substr(std::min(at_, file_.size()));
  if (rest.empty()) {
    return Found::kEnd;
  }
  if (rest.size() < kRecordHeaderBytes) {
    return Bad("truncated record header");
  }
  const uint32_t length = U32At(rest, 0);
  if (length > rest.size() - kRecordHeaderBytes) {
    return Bad("a record extends beyond the end of the file");
  }
  const std::string_view payload = rest.substr(kRecordHeaderBytes, length);
  if (ChecksumOf(payload) != U32At(rest, 4)) {
    return Bad("record checksum mismatch");
  }
  ByteReader reader(payload);
  *record = {};
  record->at = at_;
  record->kind = static_cast<RecordKind>(reader.U8());
  record->sequence = reader.U64();
  record->bytes = rest.substr(0, kRecordHeaderBytes + length);
  switch (record->kind) {
    case RecordKind::kEvent:
      record->stamp.field_time_ms = reader.U64();
      record->stamp.utc_ms = reader.I64();
      record->event = payload.substr(std::min(payload.size(), kEventHeaderBytes));
      break;
    case RecordKind::kPiece:
      record->offset = std::exchange(record->sequence, 0);
      record->event = payload.substr(std::min(payload.size(), kMarkBytes));
      break;
    case RecordKind::kEventInPieces:
      record->stamp.field_time_ms = reader.U64();
      record->stamp.utc_ms = reader.I64();
      record->ahead.bytes = reader.U64();
      record->ahead.checksum = reader.U32();
      reader.ExpectEnd();
      break;
    case RecordKind::kHash:
      record->hash = reader.U64();
      reader.ExpectEnd();
      break;
    case RecordKind::kGroup:
    case RecordKind::kEnd:
      reader.ExpectEnd();
      break;
    default:
      return Bad("unknown record kind");
  }
  if (!reader.ok()) {
    return Bad("wrong record length");
  }
  at_ += record->bytes.size();
  return Found::kRecord;
}

uint64_t DurableIn(std::string_view file, size_t at) {
  constexpr size_t kBytes = kRecordHeaderBytes + kMarkBytes;
  uint64_t durable = 0;
  // A mark begins with its length; most positions can be excluded by the first byte.
  constexpr auto kFirst = static_cast<char>(kMarkBytes);
  for (at = file.find(kFirst, at); at < file.size() && at + kBytes <= file.size();
       at = file.find(kFirst, at + 1)) {
    const auto kind = static_cast<RecordKind>(file[at + kRecordHeaderBytes]);
    Record mark;
    if ((kind == RecordKind::kGroup || kind == RecordKind::kEnd) && U32At(file, at) == kMarkBytes &&
        RecordReader(file.substr(0, at + kBytes), at).Next(&mark) == RecordReader::Found::kRecord) {
      durable = std::max(durable, mark.sequence);
    }
  }
  return durable;
}

}  // namespace pheromone::journal
