#include "server/store/journal/segment_reader.h"

#include <algorithm>
#include <utility>

#include "server/base/bytes.h"
#include "server/store/journal/crc32c.h"

namespace pheromone::journal {
namespace {

using Found = RecordReader::Found;

constexpr uint64_t kWindowBytes = uint64_t{1} << 20;

}  // namespace

SegmentReader::SegmentReader(const Folder& folder, std::string name)
    : folder_(folder), name_(std::move(name)) {
  const Result<uint64_t> size = folder_.Size(name_);
  if (size.ok()) {
    size_ = size.value();
  } else {
    status_ = Error{size.error()};
  }
}

Found SegmentReader::Bad(std::string why) {
  why_ = std::move(why);
  return Found::kBad;
}

// So many bytes from at_ on into the window, which is refilled as a whole.
bool SegmentReader::Fill(uint64_t bytes) {
  if (at_ >= window_at_ && at_ + bytes <= window_at_ + window_.size()) {
    return true;
  }
  Result<std::string> read = folder_.Read(name_, at_, std::max(bytes, kWindowBytes));
  if (!read.ok()) {
    status_ = Error{read.error()};
    return false;
  }
  window_ = std::move(read).value();
  window_at_ = at_;
  return window_.size() >= bytes;
}

// Checks a record in parts before it is loaded into memory, since its length may be damaged.
bool SegmentReader::HasItsChecksum(uint64_t bytes) {
  const std::string_view header = std::string_view(window_).substr(at_ - window_at_, 8);
  uint32_t checksum = Crc32c(header.substr(0, 4));
  const uint32_t wanted = ByteReader(header.substr(4)).U32();
  for (uint64_t done = 0; done < bytes;) {
    const Result<std::string> piece =
        folder_.Read(name_, at_ + 8 + done, std::min(bytes - done, kWindowBytes));
    if (!piece.ok() || piece.value().empty()) {
      return false;
    }
    checksum = Crc32c(piece.value(), checksum);
    done += piece.value().size();
  }
  return checksum == wanted;
}

// The error; empty: none.
std::string SegmentReader::TakePiece(const Record& record) {
  if (record.offset == 0) {
    event_.assign(kBeforeEventBytes, '\0');
  }
  if (event_.size() != kBeforeEventBytes + record.offset) {
    return "fragment of an event out of order";
  }
  if (record.event.size() > UINT32_MAX - event_.size()) {
    return "fragmented event too long";
  }
  event_ += record.event;
  return {};
}

std::string SegmentReader::JoinPieces(Record* record) {
  const engine::WrittenAhead& ahead = record->ahead;
  if (event_.size() < kBeforeEventBytes || event_.size() - kBeforeEventBytes != ahead.bytes ||
      Crc32c(std::string_view(event_).substr(kBeforeEventBytes)) != ahead.checksum) {
    return "fragments of an event do not match";
  }
  FinishEvent(record->sequence, record->stamp, &event_);
  is_whole_ = true;
  record->kind = RecordKind::kEvent;
  record->bytes = event_;
  record->event = record->bytes.substr(kBeforeEventBytes);
  return {};
}

Found SegmentReader::Next(Record* record) {
  if (is_whole_) {
    event_ = {};
    is_whole_ = false;
  }
  for (;;) {
    const Found found = NextAsWritten(record);
    const bool is_piece = found == Found::kRecord && record->kind == RecordKind::kPiece;
    if (!is_piece && (found != Found::kRecord || record->kind != RecordKind::kEventInPieces)) {
      return found;
    }
    std::string wrong = is_piece ? TakePiece(*record) : JoinPieces(record);
    if (!wrong.empty()) {
      at_ = record->at;
      return Bad(std::move(wrong));
    }
    if (!is_piece) {
      return found;
    }
  }
}

Found SegmentReader::NextAsWritten(Record* record) {
  constexpr uint64_t kHeaderBytes = 8;  // length and checksum
  if (!status_.ok()) {
    return Bad(status_.error());
  }
  if (at_ >= size_) {
    return Found::kEnd;
  }
  const uint64_t left = size_ - at_;
  if (left < kHeaderBytes) {
    return Bad("truncated record header");
  }
  if (!Fill(kHeaderBytes)) {
    return Bad(status_.ErrorOr("the file was truncated while being read"));
  }
  const uint64_t length = ByteReader(std::string_view(window_).substr(at_ - window_at_, 4)).U32();
  if (length > left - kHeaderBytes) {
    return Bad("a record extends beyond the end of the file");
  }
  if (length > kWindowBytes && !HasItsChecksum(length)) {
    return Bad("record checksum mismatch");
  }
  if (!Fill(kHeaderBytes + length)) {
    return Bad(status_.ErrorOr("the file was truncated while being read"));
  }
  RecordReader reader(std::string_view(window_).substr(at_ - window_at_, kHeaderBytes + length), 0);
  const Found found = reader.Next(record);
  if (found != Found::kRecord) {
    return Bad(reader.why());
  }
  record->at = at_;
  at_ += kHeaderBytes + length;
  return found;
}

Result<uint64_t> DurableIn(const Folder& folder, const std::string& name, uint64_t at,
                           const std::function<void(uint64_t)>& read, uint64_t end) {
  constexpr uint64_t kOverlap = 16;  // a mark is 17 bytes, and may lie across two windows
  uint64_t durable = 0;
  for (;;) {
    PHEROMONE_TRY(const std::string window,
                  folder.Read(name, at, std::min(kWindowBytes, end - at)));
    durable = std::max(durable, DurableIn(window, 0));
    if (window.size() < kWindowBytes) {
      return durable;
    }
    at += kWindowBytes - kOverlap;
    read(kWindowBytes - kOverlap);
  }
}

}  // namespace pheromone::journal
