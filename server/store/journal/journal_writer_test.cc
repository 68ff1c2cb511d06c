// The writing thread's duties beside writing: segments end in time, and snapshots become due.

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/store/journal/format.h"
#include "server/store/journal/local_journal.h"
#include "server/store/journal/recovery.h"
#include "server/store/journal/testing/crash_folder.h"
#include "server/store/journal/testing/life.h"

namespace pheromone::journal {
namespace {

using protocol::Reason;
using testing::CrashFolder;
using testing::Lives;
using testing::SmallJournal;

// A journal by hand, whose clock the test turns.
class RotationTest : public ::testing::Test {
 protected:
  void Begin(const JournalSettings& settings, LocalJournal::Start start = {}) {
    journal_ = std::make_unique<LocalJournal>(
        &folder_, settings, [this] { return now_us_; },
        [this](bool, const std::string& text) { told_.push_back(text); }, std::move(start));
    journal_->OnSnapshotDue([this](auto&&...) { ++snapshots_due_; });
    journal_->WriteOnce();
    journal_->WriteOnce();  // which looks at the segment that was begun
  }

  void Append() {
    ASSERT_EQ(journal_->Admit(), Reason::kNone);
    journal_->Append({1, 0}, engine::Advance{});
    journal_->WriteOnce();
    journal_->WriteOnce();  // which looks at what the segment has become
  }
  void FillSegment() {
    for (int i = 0; !journal_->IsRotationDue(); ++i) {
      ASSERT_LT(i, 10'000);
      Append();
    }
  }
  void Rotate() {
    journal_->Rotate(7);
    journal_->WriteOnce();
    journal_->WriteOnce();
  }

  CrashFolder folder_{1};
  uint64_t now_us_ = 1'000'000;
  std::vector<std::string> told_;
  int snapshots_due_ = 0;
  std::unique_ptr<LocalJournal> journal_;
};

TEST_F(RotationTest, AFullSegmentIsFollowedByAnotherWithoutAWait) {
  Begin(SmallJournal());
  for (uint64_t ordinal = 1; ordinal < 5; ++ordinal) {
    EXPECT_EQ(journal_->status().segment_ordinal, ordinal);
    FillSegment();
    EXPECT_GE(journal_->status().segment_bytes, SmallJournal().segment_bytes);
    Rotate();
    EXPECT_FALSE(journal_->IsRotationDue());
  }
}

// One that cannot be begun is tried again after 10 s, and not at each change: each try syncs.
TEST_F(RotationTest, AfterOneThatFailedTheNextComesAfterTenSeconds) {
  Begin(SmallJournal());
  FillSegment();
  folder_.LimitBytes(folder_.bytes());
  for (size_t attempt = 1; attempt <= 3; ++attempt) {
    Rotate();
    ASSERT_EQ(told_.size(), attempt);
    EXPECT_NE(told_.back().find("cannot start a new segment"), std::string::npos);
    EXPECT_EQ(journal_->Admit(), Reason::kNone);  // the old one goes on
    for (const uint64_t wait_us : {0u, 5'000'000u, 4'999'999u}) {
      now_us_ += wait_us;
      Append();
      EXPECT_FALSE(journal_->IsRotationDue());
    }
    now_us_ += 1;
    Append();
    EXPECT_TRUE(journal_->IsRotationDue());
  }
  folder_.LimitBytes(UINT64_MAX);
  Rotate();
  EXPECT_EQ(told_.size(), 3u);
  const uint64_t ordinal = journal_->status().segment_ordinal;
  EXPECT_LT(journal_->status().segment_bytes, SmallJournal().segment_bytes);
  FillSegment();  // and nothing is left of the wait
  Rotate();
  EXPECT_EQ(journal_->status().segment_ordinal, ordinal + 1);
}

TEST_F(RotationTest, ASnapshotIsDueAfterSoManyBytesThoseOfEarlierLivesIncluded) {
  JournalSettings settings = SmallJournal();
  settings.segment_bytes = 1'000;
  settings.snapshot_bytes = 10'000;
  const auto rotations_until_due = [&](uint64_t bytes_since_snapshot) {
    snapshots_due_ = 0;
    LocalJournal::Start start;
    start.bytes_since_snapshot = bytes_since_snapshot;
    start.ordinal = journal_ == nullptr ? 1 : journal_->status().segment_ordinal + 1;
    Begin(settings, start);
    int rotations = 0;
    for (; snapshots_due_ == 0 && rotations < 100; ++rotations) {
      FillSegment();
      Rotate();
    }
    return rotations;
  };
  EXPECT_EQ(rotations_until_due(9'500), 1);
  EXPECT_EQ(rotations_until_due(20'000), 1);
  const int from_nothing = rotations_until_due(0);
  EXPECT_GE(from_nothing, 8);
  EXPECT_LE(from_nothing, 10);
  EXPECT_EQ(rotations_until_due(5'000), from_nothing / 2);
}

// As it comes out of the files: a server that is restarted before each snapshot would never make
// one.
TEST(SnapshotAfterRestart, IsDueThoughNoLifeWroteEnoughForOne) {
  CrashFolder folder(4);
  JournalSettings settings = SmallJournal();
  settings.snapshot_ms = 1'000'000'000;
  Lives lives(&folder, settings, 4);
  int due = 0;
  for (int life = 0; life < 2; ++life) {
    ASSERT_EQ(lives.Begin(), "");
    lives.journal().OnSnapshotDue([&due](auto&&...) { ++due; });
    EXPECT_EQ(due, 0);
    lives.Write();
    const uint64_t first = lives.journal().status().segment_ordinal;
    while (lives.journal().status().segment_ordinal <= first) {
      ASSERT_LT(lives.submitted(), 2'000u);
      lives.Submit();
      lives.Write();
    }
    ASSERT_EQ(due, life);
  }
}

TEST(SnapshotAfterRestart, OnlySegmentsThatAreNotInASnapshotCount) {
  CrashFolder folder(9);
  Lives lives(&folder, SmallJournal(), 9);
  ASSERT_EQ(lives.Begin(), "");
  while (lives.snapshots() < 2) {
    ASSERT_LT(lives.submitted(), 20'000u);
    lives.Submit();
    lives.Write();
    lives.MakeDueSnapshot();
    lives.PassTime(1'000);
  }
  const auto recovered = Recover(folder);
  ASSERT_TRUE(recovered.ok()) << recovered.error();
  ASSERT_GT(recovered.value().snapshot_sequence, 0u);
  uint64_t expected = 0;
  uint64_t total = 0;
  std::vector<std::pair<uint64_t, uint64_t>> segments;  // the first sequence; bytes
  const std::vector<std::string> names = folder.List().value();
  for (const std::string& name : names) {
    if (OrdinalOf(name)) {
      const std::string& bytes = folder.Contents(name);
      segments.emplace_back(DecodeSegmentHeader(bytes).value().first_sequence, bytes.size());
    }
  }
  for (size_t i = 0; i < segments.size(); ++i) {
    const bool is_last = i + 1 == segments.size();
    const uint64_t end = is_last ? UINT64_MAX : segments[i + 1].first;
    total += segments[i].second;
    expected += end > recovered.value().snapshot_sequence + 1 ? segments[i].second : 0;
  }
  EXPECT_EQ(recovered.value().bytes_since_snapshot, expected);
  EXPECT_LT(expected, total);
}

}  // namespace
}  // namespace pheromone::journal
