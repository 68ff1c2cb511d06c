#include "server/store/journal/event_reader.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "server/store/journal/durable_note.h"
#include "server/store/journal/segment_reader.h"

namespace pheromone::journal {
namespace {

struct Segment {
  uint64_t ordinal = 0;
  std::string name;
  uint64_t bytes = 0;                   // when its header was read
  std::optional<SegmentHeader> header;  // empty: see `why`
  std::string why;
};

struct Files {
  std::vector<Segment> segments;  // in their order
  uint64_t snapshot = 0;          // the sequence of the newest; 0: there is none
  uint64_t noted = 0;             // was durable, as the durability mark says
};

Result<Segment> ReadHeader(const Folder& folder, uint64_t ordinal, const std::string& name) {
  PHEROMONE_TRY(const uint64_t bytes, folder.Size(name));
  PHEROMONE_TRY(const std::string head, folder.Read(name, 0, kSegmentHeaderBytes));
  Segment segment{ordinal, name, bytes, std::nullopt, ""};
  const Result<SegmentHeader> header = DecodeSegmentHeader(head);
  if (!header.ok() && IsOfAnotherVersion(head)) {
    return Error{folder.path() + "/" + name + ": " + header.error()};
  }
  if (!header.ok()) {
    segment.why = header.error();
  } else if (header.value().ordinal != ordinal) {
    segment.why = "its header is that of segment " + std::to_string(header.value().ordinal);
  } else {
    segment.header = header.value();
  }
  return segment;
}

Result<Files> ReadHeaders(const Folder& folder) {
  Files files;
  // Before the log, to which a server may be adding.
  const std::optional<DurableNote> note = ReadDurableNote(folder);
  files.noted = note ? note->sequence : 0;
  PHEROMONE_TRY(const std::vector<std::string> names, folder.List());
  for (const std::string& name : names) {
    if (const auto ordinal = OrdinalOf(name)) {
      PHEROMONE_TRY(Segment segment, ReadHeader(folder, *ordinal, name));
      files.segments.push_back(std::move(segment));
    } else if (const auto sequence = SnapshotSequenceOf(name)) {
      files.snapshot = std::max(files.snapshot, *sequence);
    }
  }
  std::sort(files.segments.begin(), files.segments.end(),
            [](const Segment& a, const Segment& b) { return a.ordinal < b.ordinal; });
  return files;
}

class Walk {
 public:
  Walk(const Folder& folder, Files files, const std::function<void(const Record&)>& visit)
      : folder_(folder), files_(std::move(files)), visit_(visit) {}

  Result<Walked> Run() {
    known_ = files_.segments.empty() ? files_.snapshot : 0;
    for (size_t i = 0; i < files_.segments.size() && walked_.cut_short.empty(); ++i) {
      PHEROMONE_TRY_STATUS(ReadSegment(i));
    }
    if (walked_.cut_short.empty() && files_.noted > known_) {
      walked_.cut_short = kDurableName;
      walked_.cut_short += ": the log ends at sequence " + std::to_string(known_) + ", but " +
                           std::to_string(files_.noted) + " was durable";
      walked_.is_damaged = true;
    }
    return std::move(walked_);
  }

 private:
  Status ReadSegment(size_t index) {
    const Segment& segment = files_.segments[index];
    end_ = UINT64_MAX;
    for (size_t later = index + 1; later < files_.segments.size(); ++later) {
      const std::optional<SegmentHeader>& header = files_.segments[later].header;
      end_ = std::min(end_, header ? header->first_sequence : end_);
    }
    if (known_ + 1 >= end_) {
      return Ok();  // later segments replace it
    }
    if (!segment.header) {
      return StopAt(segment, 0, segment.bytes, segment.why);
    }
    const uint64_t first = segment.header->first_sequence;
    if (known_ == 0 && first <= files_.snapshot + 1) {
      known_ = first - 1;  // what was before is in the snapshot
    }
    if (first > known_ + 1) {
      return StopAt(segment, 0, segment.bytes, Jump(first));
    }
    return ReadRecords(segment);
  }

  Status ReadRecords(const Segment& segment) {
    SegmentReader reader(folder_, segment.name);
    Record record;
    RecordReader::Found found = RecordReader::Found::kEnd;
    while (known_ + 1 < end_ && (found = reader.Next(&record)) == RecordReader::Found::kRecord) {
      if (record.kind != RecordKind::kEvent || record.sequence <= known_) {
        continue;
      }
      if (record.sequence != known_ + 1) {
        return StopAt(segment, record.at, reader.size(), Jump(record.sequence));
      }
      visit_(record);
      walked_.first = walked_.events++ == 0 ? record.sequence : walked_.first;
      walked_.last = known_ = record.sequence;
    }
    if (!reader.status().ok()) {
      return reader.status();
    }
    const bool is_complete =
        known_ + 1 >= end_ || (found == RecordReader::Found::kEnd && end_ == UINT64_MAX);
    return is_complete ? Ok()
                       : StopAt(segment, reader.at(), reader.size(),
                                found == RecordReader::Found::kBad
                                    ? reader.why()
                                    : "it ends before the next segment begins");
  }

  std::string Jump(uint64_t to) const {
    return "the sequence jumps from " + std::to_string(known_) + " to " + std::to_string(to);
  }

  // What follows in the file, which had so many bytes when it was read, tells whether something is
  // missing here. Without that, it is the end of the log, or of a segment after which a snapshot
  // has what is missing: when a server removes old segments and loses its power, any of them may
  // stay.
  Status StopAt(const Segment& segment, uint64_t byte, uint64_t bytes, const std::string& why) {
    const auto advance = [](uint64_t) {};
    PHEROMONE_TRY(const uint64_t marked, DurableIn(folder_, segment.name, byte, advance, bytes));
    const bool is_last = end_ == UINT64_MAX;
    if (!is_last && marked <= known_ && end_ <= files_.snapshot + 1) {
      known_ = end_ - 1;
      return Ok();
    }
    const uint64_t before = segment.header ? segment.header->first_sequence - 1 : 0;
    walked_.is_damaged = !is_last || std::max({before, marked, files_.noted}) > known_;
    walked_.cut_short = segment.name + ": byte " + std::to_string(byte) + ": " + why;
    return Ok();
  }

  const Folder& folder_;
  const Files files_;
  const std::function<void(const Record&)>& visit_;
  Walked walked_;
  uint64_t known_ = 0;  // each event up to here was read, or is in a snapshot
  uint64_t end_ = 0;    // from here on a later segment replaces the present one
};

}  // namespace

Result<Walked> WalkEvents(const Folder& folder, const std::function<void(const Record&)>& visit) {
  PHEROMONE_TRY(Files files, ReadHeaders(folder));
  return Walk(folder, std::move(files), visit).Run();
}

}  // namespace pheromone::journal
