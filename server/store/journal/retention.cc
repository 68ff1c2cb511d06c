#include "server/store/journal/retention.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "server/store/journal/format.h"

namespace pheromone::journal {

Result<uint64_t> RemoveWhatIsNotNeeded(size_t keep, Folder* folder) {
  PHEROMONE_TRY(const std::vector<std::string> names, folder->List());
  std::vector<std::pair<uint64_t, std::string>> snapshots;
  std::vector<std::pair<SegmentHeader, std::string>> segments;
  for (const std::string& name : names) {
    if (const auto sequence = SnapshotSequenceOf(name)) {
      snapshots.emplace_back(*sequence, name);
    } else if (OrdinalOf(name)) {
      const Result<std::string> head = folder->Read(name, 0, kSegmentHeaderBytes);
      const Result<SegmentHeader> header = DecodeSegmentHeader(head.ok() ? head.value() : "");
      if (header.ok()) {
        segments.emplace_back(header.value(), name);
      }
    }
  }
  std::sort(snapshots.rbegin(), snapshots.rend());
  std::sort(segments.begin(), segments.end(),
            [](const auto& a, const auto& b) { return a.first.ordinal < b.first.ordinal; });
  std::vector<std::string> unneeded;
  for (size_t i = keep; i < snapshots.size(); ++i) {
    unneeded.push_back(snapshots[i].second);
  }
  const uint64_t oldest = snapshots.size() >= keep ? snapshots[keep - 1].first : 0;
  for (size_t i = 0; i + 1 < segments.size(); ++i) {
    if (segments[i + 1].first.first_sequence <= oldest + 1 && oldest != 0) {
      unneeded.push_back(segments[i].second);
    }
  }
  for (const std::string& name : unneeded) {
    PHEROMONE_TRY_STATUS(folder->Remove(name));
  }
  return unneeded.empty() || folder->Sync().ok() ? Result<uint64_t>(unneeded.size())
                                                 : Error{folder->path() + ": cannot be synced"};
}

}  // namespace pheromone::journal
