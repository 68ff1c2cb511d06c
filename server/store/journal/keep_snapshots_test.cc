// Which files the newest snapshots make unnecessary, for any number of snapshots that are kept.

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "server/store/journal/format.h"
#include "server/store/journal/retention.h"
#include "server/store/journal/testing/crash_folder.h"

namespace pheromone::journal {
namespace {

using testing::CrashFolder;

void Put(CrashFolder* folder, const std::string& name, const std::string& bytes) {
  Result<std::unique_ptr<AppendFile>> file = folder->Create(name);
  ASSERT_TRUE(file.ok()) << file.error();
  ASSERT_TRUE(file.value()->Append(bytes).ok());
  ASSERT_TRUE(file.value()->Sync().ok());
}

// Segments by the first sequence of each; the last one ends with the last event.
struct Files {
  std::vector<uint64_t> snapshots;
  std::vector<uint64_t> segments;
};

std::vector<std::string> NamesAfter(const Files& files, size_t keep, bool* done) {
  CrashFolder folder(1);
  for (const uint64_t sequence : files.snapshots) {
    Put(&folder, SnapshotName(sequence), "");
  }
  for (size_t i = 0; i < files.segments.size(); ++i) {
    Put(&folder, SegmentName(i + 1), EncodeHeader(SegmentHeader{i + 1, files.segments[i], false}));
  }
  Put(&folder, "00000001.segment.damaged", "x");
  Put(&folder, "README", "x");
  const size_t before = folder.List().value().size();
  const Result<uint64_t> removed = RemoveWhatIsNotNeeded(keep, &folder);
  std::vector<std::string> names = folder.List().value();
  *done = removed.ok() && removed.value() == before - names.size();
  return names;
}

// The rule, file by file: a snapshot stays if fewer than `keep` are newer; a segment stays if it
// has an event that is not in the oldest of `keep` snapshots, or is the last.
std::vector<std::string> ExpectedNames(const Files& files, size_t keep) {
  std::vector<std::string> names = {"00000001.segment.damaged", "README"};
  uint64_t oldest_kept = UINT64_MAX;
  size_t kept = 0;
  for (const uint64_t snapshot : files.snapshots) {
    const auto newer = std::count_if(files.snapshots.begin(), files.snapshots.end(),
                                     [snapshot](uint64_t other) { return other > snapshot; });
    if (static_cast<size_t>(newer) < keep) {
      names.push_back(SnapshotName(snapshot));
      oldest_kept = std::min(oldest_kept, snapshot);
      ++kept;
    }
  }
  for (size_t i = 0; i < files.segments.size(); ++i) {
    const bool is_last = i + 1 == files.segments.size();
    const bool is_in_all = !is_last && kept == keep && files.segments[i + 1] - 1 <= oldest_kept;
    if (!is_in_all) {
      names.push_back(SegmentName(i + 1));
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

TEST(RemoveWhatIsNotNeeded, KeepsWhatTheNewestSnapshotsNeed) {
  std::mt19937_64 random(5);
  int fewer = 0;
  int removed = 0;
  for (int round = 0; round < 1'000; ++round) {
    Files files;
    uint64_t first = 1;
    for (uint64_t i = 1 + random() % 6; i > 0; --i) {
      files.segments.push_back(first);
      first += random() % 10;  // a segment may have no event
    }
    for (uint64_t i = random() % 5; i > 0; --i) {
      files.snapshots.push_back(1 + random() % (first + 5));
    }
    std::sort(files.snapshots.begin(), files.snapshots.end());
    files.snapshots.erase(std::unique(files.snapshots.begin(), files.snapshots.end()),
                          files.snapshots.end());
    const size_t keep = 1 + random() % 4;
    bool done = false;
    const std::vector<std::string> names = NamesAfter(files, keep, &done);
    ASSERT_TRUE(done);
    ASSERT_EQ(names, ExpectedNames(files, keep))
        << "keep " << keep << " of " << files.snapshots.size();
    fewer += !files.snapshots.empty() && files.snapshots.size() < keep ? 1 : 0;
    removed += names.size() < 2 + files.segments.size() + files.snapshots.size() ? 1 : 0;
  }
  EXPECT_GE(fewer, 100);
  EXPECT_GE(removed, 100);
}

// Should the only snapshot turn out to be damaged, the whole log is needed.
TEST(RemoveWhatIsNotNeeded, WithFewerSnapshotsThanAreKeptEverySegmentStays) {
  bool done = false;
  const Files files{{15}, {1, 6, 11, 16}};
  EXPECT_EQ(NamesAfter(files, 2, &done).size(), 7u);
  EXPECT_TRUE(done);
  EXPECT_EQ(NamesAfter(files, 1, &done).size(), 4u);  // the snapshot, and the last segment
  EXPECT_TRUE(done);
}

}  // namespace
}  // namespace pheromone::journal
