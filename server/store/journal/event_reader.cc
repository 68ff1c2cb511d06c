#include "server/store/journal/event_reader.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "server/store/journal/segment_reader.h"

namespace pheromone::journal {
namespace {

struct Segment {
  uint64_t ordinal = 0;
  uint64_t first_sequence = 0;
  std::string name;
};

Result<std::vector<Segment>> WholeSegments(const Folder& folder) {
  PHEROMONE_TRY(const std::vector<std::string> names, folder.List());
  std::vector<Segment> segments;
  for (const std::string& name : names) {
    if (!OrdinalOf(name)) {
      continue;
    }
    const Result<std::string> head = folder.Read(name, 0, kSegmentHeaderBytes);
    const Result<SegmentHeader> header = DecodeSegmentHeader(head.ok() ? head.value() : "");
    if (header.ok()) {
      segments.push_back({header.value().ordinal, header.value().first_sequence, name});
    }
  }
  std::sort(segments.begin(), segments.end(),
            [](const Segment& a, const Segment& b) { return a.ordinal < b.ordinal; });
  return segments;
}

}  // namespace

Result<Walked> WalkEvents(const Folder& folder, const std::function<void(const Record&)>& visit) {
  PHEROMONE_TRY(const std::vector<Segment> segments, WholeSegments(folder));
  Walked walked;
  for (size_t i = 0; i < segments.size(); ++i) {
    uint64_t end = UINT64_MAX;  // from here on a later segment replaces this one
    for (size_t later = i + 1; later < segments.size(); ++later) {
      end = std::min(end, segments[later].first_sequence);
    }
    SegmentReader reader(folder, segments[i].name);
    Record record;
    RecordReader::Found found = RecordReader::Found::kEnd;
    while ((found = reader.Next(&record)) == RecordReader::Found::kRecord) {
      const bool is_next = walked.events == 0 || record.sequence == walked.last + 1;
      if (record.kind != RecordKind::kEvent || record.sequence >= end ||
          (walked.events != 0 && record.sequence <= walked.last)) {
        continue;
      }
      if (!is_next) {
        walked.cut_short = segments[i].name + ": byte " + std::to_string(record.at) +
                           ": the sequence jumps from " + std::to_string(walked.last) + " to " +
                           std::to_string(record.sequence);
        return walked;
      }
      visit(record);
      walked.first = walked.events++ == 0 ? record.sequence : walked.first;
      walked.last = record.sequence;
    }
    if (!reader.status().ok()) {
      return reader.status().error();
    }
    if (found == RecordReader::Found::kBad && walked.last + 1 < end) {
      walked.cut_short =
          segments[i].name + ": byte " + std::to_string(reader.at()) + ": " + reader.why();
      if (end != UINT64_MAX) {
        return walked;
      }
    }
  }
  return walked;
}

}  // namespace pheromone::journal
