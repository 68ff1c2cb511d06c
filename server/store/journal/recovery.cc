#include "server/store/journal/recovery.h"

#include <algorithm>
#include <deque>
#include <optional>
#include <utility>

#include "server/base/format.h"
#include "server/core/engine/event_codec.h"
#include "server/store/journal/format.h"
#include "server/store/journal/segment_reader.h"
#include "server/store/journal/snapshot.h"

namespace pheromone::journal {
namespace {

struct Segment {
  std::string name;
  uint64_t ordinal = 0;
  std::optional<SegmentHeader> header;  // empty: incomplete, see `why`
  std::string why;
  uint64_t bytes = 0;
};

class Recovery {
 public:
  Recovery(const Folder& folder, const TellProgress& tell) : folder_(folder), tell_(tell) {}

  Result<Recovered> Run(uint64_t before_ordinal) {
    Status status = List(before_ordinal);
    if (status.ok()) {
      status = BeginWithASnapshot();
    }
    for (size_t i = 0; i < segments_.size() && status.ok() && !stopped_; ++i) {
      status = ReadSegment(i);
    }
    if (!status.ok()) {
      return status.error();
    }
    CompareWithTheNote();
    const bool cut_short = last_is_relaxed_ && !ended_;
    result_.ends_orderly = ended_;
    result_.lost = result_.lost || cut_short || durable_ > result_.sequence;
    result_.certain = std::min(durable_, result_.sequence);
    for (const auto& [sequence, record] : tail_) {
      result_.tail += sequence > result_.certain ? record : std::string();
    }
    return std::move(result_);
  }

 private:
  Status List(uint64_t before_ordinal) {
    PHEROMONE_TRY(const std::vector<std::string> names, folder_.List());
    for (const std::string& name : names) {
      const bool aside = name.ends_with(kDamaged);
      const auto ordinal = OrdinalOf(aside ? name.substr(0, name.size() - kDamaged.size()) : name);
      if (ordinal) {
        result_.next_ordinal = std::max(result_.next_ordinal, *ordinal + 1);
      }
      if (ordinal && !aside && *ordinal < before_ordinal) {
        segments_.push_back({name, *ordinal, std::nullopt, "", SizeOf(name)});
        progress_.bytes_total += segments_.back().bytes;
      } else if (SnapshotSequenceOf(name)) {
        snapshots_.push_back(name);
      }
    }
    Status others = ListOthers();
    if (!others.ok()) {
      return others;
    }
    if (before_ordinal == UINT64_MAX) {
      result_.noted = ReadDurableNote(folder_);
      durable_ = result_.noted ? result_.noted->sequence : 0;
    }
    std::sort(segments_.begin(), segments_.end(),
              [](const Segment& a, const Segment& b) { return a.ordinal < b.ordinal; });
    for (Segment& segment : segments_) {
      Status read = ReadHeader(&segment);
      if (!read.ok()) {
        return read;
      }
    }
    return Ok();
  }

  // Entries with the name of a journal file that are not regular files.
  Status ListOthers() {
    PHEROMONE_TRY(const std::vector<std::string> names, folder_.ListOthers());
    for (const std::string& name : names) {
      const auto ordinal = OrdinalOf(name);
      if (ordinal || SnapshotSequenceOf(name) || name == kDurableName) {
        Note(name, 0, "is a folder, a link or a device, expected a regular file; skipped", true);
      }
      if (ordinal) {
        result_.next_ordinal = std::max(result_.next_ordinal, *ordinal + 1);
      }
    }
    return Ok();
  }

  uint64_t SizeOf(const std::string& name) const {
    const Result<uint64_t> size = folder_.Size(name);
    return size.ok() ? size.value() : 0;
  }

  void Advance(uint64_t bytes) {
    progress_.bytes_done = std::min(progress_.bytes_done + bytes, progress_.bytes_total);
    if (tell_) {
      tell_(progress_);
    }
  }

  // The remaining files do not show that more is missing; the durability mark does.
  void CompareWithTheNote() {
    const std::optional<DurableNote>& note = result_.noted;
    if (!note || note->sequence <= result_.sequence || stopped_at_damage_) {
      return;
    }
    Note(std::string(kDurableName), NotePlace(*note),
         "the log ends at sequence " + std::to_string(result_.sequence) + ", but " +
             std::to_string(note->sequence) + " was durable at " + UtcText(note->utc_ms / 1000) +
             ": a segment or the end of one is missing",
         true);
  }

  Status ReadHeader(Segment* segment) const {
    PHEROMONE_TRY(const std::string head, folder_.Read(segment->name, 0, kSegmentHeaderBytes));
    const Result<SegmentHeader> header = DecodeSegmentHeader(head);
    if (!header.ok() && IsOfAnotherVersion(head)) {
      return Error{folder_.path() + "/" + segment->name + ": " + header.error()};
    }
    if (!header.ok()) {
      segment->why = header.error();
    } else if (header.value().ordinal != segment->ordinal) {
      segment->why = "its header is that of segment " + std::to_string(header.value().ordinal);
    } else {
      segment->header = header.value();
    }
    return Ok();
  }

  // The newest complete snapshot. Its existence shows that everything up to its sequence was
  // durable.
  Status BeginWithASnapshot() {
    std::reverse(snapshots_.begin(), snapshots_.end());
    for (const std::string& name : snapshots_) {
      durable_ = std::max(durable_, *SnapshotSequenceOf(name));
      const Result<std::string> head = folder_.Read(name, 0, kSnapshotHeaderBytes);
      if (head.ok() && IsOfAnotherVersion(head.value())) {
        return Error{folder_.path() + "/" + name + ": " +
                     DecodeSnapshotHeader(head.value()).error()};
      }
      uint64_t byte = 0;
      progress_.bytes_total += SizeOf(name);
      Result<Snapshot> snapshot =
          ReadSnapshot(folder_, name, &byte, [this](uint64_t bytes) { Advance(bytes); });
      if (snapshot.ok()) {
        result_.engine = std::move(snapshot.value().engine);
        result_.stamp = snapshot.value().stamp;
        result_.sequence = result_.engine.sequence();
        result_.snapshot_sequence = result_.sequence;
        return Ok();
      }
      Note(name, byte, snapshot.error(), true);
      result_.damaged_files.push_back(name);
    }
    const auto first = std::find_if(segments_.begin(), segments_.end(),
                                    [](const Segment& it) { return it.header.has_value(); });
    const bool from_the_beginning = first != segments_.end() && first->header->first_sequence == 1;
    const bool not_begun = snapshots_.empty() && first == segments_.end();
    if (from_the_beginning || not_begun) {
      return Ok();
    }
    std::string text = folder_.path() +
                       ": the beginning is missing: there is no valid snapshot and no segment "
                       "begins at sequence 1; keep this folder and give the server an empty one";
    for (const Finding& finding : result_.findings) {
      text += "\n" + finding.Text();
    }
    return Error{text};
  }

  // The sequence from which a later segment replaces this one.
  uint64_t EndOf(size_t index) const {
    uint64_t end = UINT64_MAX;
    for (size_t i = index + 1; i < segments_.size(); ++i) {
      end = std::min(end, segments_[i].header ? segments_[i].header->first_sequence : end);
    }
    return end;
  }

  bool IsWanted(uint64_t end) const { return result_.sequence + 1 < end; }

  Status ReadSegment(size_t index) {
    const Segment& segment = segments_[index];
    const uint64_t end = EndOf(index);
    if (!IsWanted(end)) {
      Advance(segment.bytes);
      return Ok();  // everything is in the snapshot, or was rewritten
    }
    if (!segment.header) {
      return StopAt(index, 0, segment.why);
    }
    const uint64_t first = segment.header->first_sequence;
    durable_ = std::max(durable_, first - 1);
    if (first > result_.sequence + 1) {
      return StopAt(index, 0, Jump(first));
    }
    last_is_relaxed_ = segment.header->relaxed;
    ended_ = false;
    result_.bytes_since_snapshot += segment.bytes;
    return ReadRecords(index, end);
  }

  Status ReadRecords(size_t index, uint64_t end) {
    SegmentReader reader(folder_, segments_[index].name);
    Record record;
    while (IsWanted(end)) {
      const uint64_t before = reader.at();
      const RecordReader::Found found = reader.Next(&record);
      if (!reader.status().ok()) {
        return reader.status();
      }
      Advance(reader.at() - before);
      if (found == RecordReader::Found::kEnd) {
        return end == UINT64_MAX
                   ? Ok()
                   : StopAt(index, reader.at(), "it ends before the next segment begins");
      }
      if (found == RecordReader::Found::kBad) {
        return StopAt(index, reader.at(),
                      reader.why() + "; " + std::to_string(reader.size() - reader.at()) +
                          " bytes are skipped");
      }
      const Status taken = Take(record, segments_[index].name);
      if (!taken.ok()) {
        durable_ = std::max(durable_, result_.sequence + 1);  // it was reported as durable
        return StopAt(index, record.at, taken.error());
      }
    }
    return Ok();
  }

  Status Take(const Record& record, const std::string& name) {
    switch (record.kind) {
      case RecordKind::kGroup:
        TakeDurable(record.sequence);
        return Ok();
      case RecordKind::kEnd:
        TakeDurable(record.sequence);
        ended_ = record.sequence == result_.sequence;
        return Ok();
      case RecordKind::kHash:
        if (record.sequence == result_.sequence && result_.engine.configured()) {
          CompareHash(record, name);
        }
        return Ok();
      case RecordKind::kEvent:
      case RecordKind::kPiece:  // the reader makes one event of them
      case RecordKind::kEventInPieces:
        break;
    }
    ended_ = false;
    if (record.sequence <= result_.sequence) {
      return Ok();  // it is in the snapshot, or was already read
    }
    return record.sequence == result_.sequence + 1 ? Apply(record)
                                                   : Status(Error{Jump(record.sequence)});
  }

  void TakeDurable(uint64_t sequence) {
    durable_ = std::max(durable_, sequence);
    while (!tail_.empty() && tail_.front().first <= durable_) {
      tail_.pop_front();
    }
  }

  void CompareHash(const Record& record, const std::string& name) {
    result_.ends_with_hash = record.hash == result_.engine.StateHash();
    if (!result_.ends_with_hash) {
      result_.differs = true;
      Note(name, record.at, "state hash mismatch after sequence " + std::to_string(record.sequence),
           true);
    }
  }

  Status Apply(const Record& record) {
    ByteReader reader(record.event);
    engine::Event event = engine::DecodeEvent(&reader);
    reader.ExpectEnd();
    if (!reader.ok()) {
      return Error{"invalid event: " + reader.error()};
    }
    if (record.stamp.field_time_ms > engine::kMaxFieldTimeMs) {
      return Error{"timestamp out of range"};
    }
    // Work proportional to the size of an event is done once, for the check and for the change.
    Status possible = result_.engine.Prepare(&event);
    possible = possible.ok() ? result_.engine.Check(event) : possible;
    if (!possible.ok()) {
      return Error{"event refused: " + possible.error()};
    }
    out_.clear();
    result_.engine.Apply(record.sequence, record.stamp, event, &out_);
    ++progress_.events;
    result_.cost_since_snapshot += result_.engine.cost();
    result_.sequence = record.sequence;
    result_.stamp = record.stamp;
    result_.ends_with_hash = false;
    tail_.emplace_back(record.sequence, record.bytes);
    return Ok();
  }

  std::string Jump(uint64_t to) const {
    return "the sequence jumps from " + std::to_string(result_.sequence) + " to " +
           std::to_string(to);
  }

  void Note(const std::string& name, uint64_t byte, std::string what, bool is_damage) {
    result_.findings.push_back({folder_.path() + "/" + name, byte, std::move(what), is_damage});
  }

  // Nothing can be applied from there on. The remaining bytes tell whether that is damage.
  Status StopAt(size_t index, uint64_t byte, std::string what) {
    stopped_ = true;
    for (size_t i = index; i < segments_.size(); ++i) {
      const Segment& segment = segments_[i];
      if (segment.header) {
        durable_ = std::max(durable_, segment.header->first_sequence - 1);
      }
      const Result<uint64_t> marked = DurableIn(folder_, segment.name, i == index ? byte : 0,
                                                [this](uint64_t bytes) { Advance(bytes); });
      if (!marked.ok()) {
        return marked.error();
      }
      durable_ = std::max(durable_, marked.value());
    }
    const bool is_damage = durable_ > result_.sequence;
    stopped_at_damage_ = is_damage;
    Note(segments_[index].name, byte, std::move(what), is_damage);
    for (size_t i = index; is_damage && i < segments_.size(); ++i) {
      result_.damaged_files.push_back(segments_[i].name);
    }
    return Ok();
  }

  const Folder& folder_;
  const TellProgress& tell_;
  Progress progress_;
  std::vector<Segment> segments_;
  std::vector<std::string> snapshots_;
  Recovered result_;
  uint64_t durable_ = 0;  // as the marks say
  bool last_is_relaxed_ = false;
  bool ended_ = false;
  bool stopped_ = false;
  bool stopped_at_damage_ = false;
  std::deque<std::pair<uint64_t, std::string>> tail_;  // records that no mark covers yet
  std::vector<engine::Outgoing> out_;
};

}  // namespace

std::string Finding::Text() const {
  return file + ": byte " + std::to_string(byte) + ": " + what;
}

Result<Recovered> Recover(const Folder& folder, uint64_t before_ordinal, const TellProgress& tell) {
  return Recovery(folder, tell).Run(before_ordinal);
}

}  // namespace pheromone::journal
