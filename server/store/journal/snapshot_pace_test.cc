#include "server/store/journal/snapshot_pace.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "server/core/engine/testing/random_traffic.h"
#include "server/store/journal/local_journal.h"
#include "server/store/journal/open.h"
#include "server/store/journal/recovery.h"
#include "server/store/journal/snapshot_writer.h"
#include "server/store/journal/testing/crash_folder.h"

namespace pheromone::journal {
namespace {

constexpr uint64_t kDue = 1'000;

TEST(SnapshotPace, IsDueAtItsCostThatOfEarlierLivesIncluded) {
  SnapshotPace pace(kDue, 600);
  EXPECT_FALSE(pace.IsDue(0));
  pace.Add(399);
  EXPECT_FALSE(pace.IsDue(0));
  pace.Add(1);
  EXPECT_TRUE(pace.IsDue(0));
}

TEST(SnapshotPace, RestsAsLongAsTheLastOneTookHoweverMuchIsDone) {
  SnapshotPace pace(kDue, 0);
  pace.Add(kDue);
  pace.Begin(100);
  pace.Add(3 * kDue);
  EXPECT_FALSE(pace.IsDue(200)) << "one is being made";
  pace.End(1'100, true);
  EXPECT_FALSE(pace.IsDue(2'099));
  EXPECT_TRUE(pace.IsDue(2'100));
}

// What came before a snapshot counts until it is made, and what comes while it is made counts on.
TEST(SnapshotPace, OperatorsWaitWhileTooMuchWouldBeReplayed) {
  SnapshotPace pace(kDue, 0);
  pace.Add(3 * kDue);
  pace.Begin(0);
  pace.Add(kDue - 1);
  EXPECT_FALSE(pace.IsBehind());
  pace.Add(1);
  EXPECT_TRUE(pace.IsBehind());
  pace.End(10, true);
  EXPECT_FALSE(pace.IsBehind());
  EXPECT_EQ(pace.cost(), kDue);
}

TEST(SnapshotPace, AFailedOneIsTriedAgainAfterTenSecondsAndNothingIsForgotten) {
  SnapshotPace pace(kDue, 0);
  pace.Add(kDue);
  pace.Begin(0);
  pace.Add(1);
  pace.End(100, false);
  EXPECT_EQ(pace.cost(), kDue + 1);
  EXPECT_FALSE(pace.IsDue(100 + SnapshotPace::kAfterFailureUs - 1));
  EXPECT_TRUE(pace.IsDue(100 + SnapshotPace::kAfterFailureUs));
}

engine::EngineConfig MapOfEdits() {
  engine::EngineConfig config;
  config.field.map = {{0, 0}, 20'000'000, 20'000'000, 50'000};
  field::PheromoneLaw law;
  law.name = "paint";
  law.sigma_um = 100'000;
  law.quantum_micro = 125'000;
  law.max_count = 8;
  config.field.pheromones = {law};
  config.links = {{"radio"}};
  return config;
}

// The attack: an operator's largest edits are some fifty bytes of log each, and would never fill a
// segment. The engine's count of what a recovery replays must agree with what that replays, and be
// bounded. Snapshots are made at once here; what is done while one is made is
// SnapshotPace's.
TEST(SnapshotOfEdits, IsMadeBeforeARecoveryReplaysMuch) {
  testing::CrashFolder folder(1);
  JournalSettings settings;
  settings.snapshot_cost = 500'000;
  uint64_t now_us = 1'000'000;
  auto opened = OpenJournal(
      &folder, settings, [&] { return now_us; }, [](bool, const std::string&) {});
  ASSERT_TRUE(opened.ok()) << opened.error();
  LocalJournal& journal = *opened.value().journal;
  engine::Engine& engine = opened.value().engine;
  bool is_due = false;
  journal.OnSnapshotDue([&] { is_due = true; });
  std::vector<engine::Outgoing> out;
  engine::Stamp stamp{1'000, 1'000};
  uint64_t highest = 0;
  uint64_t since = 0;  // the last snapshot
  int snapshots = 0;
  const auto apply = [&](const engine::Event& event) {
    ASSERT_EQ(journal.Admit(), protocol::Reason::kNone);
    const uint64_t sequence = journal.Append(stamp, event);
    engine.Apply(sequence, stamp, event, &out);
    journal.Account(engine.cost());
    since += engine.cost();
    highest = std::max(highest, engine.cost());
    while (journal.WriteOnce()) {
    }
    if (std::exchange(is_due, false)) {
      journal.SnapshotBegins();
      ASSERT_TRUE(WriteSnapshot(engine, stamp, &folder).ok());
      journal.SnapshotEnds(true);
      since = 0;
      ++snapshots;
    }
  };
  apply(engine::ConfigChanged{MapOfEdits(), 1});
  std::mt19937_64 random(3);
  const auto below = [&](int64_t limit) {
    return static_cast<int64_t>(random() % static_cast<uint64_t>(limit));
  };
  for (int i = 0; i < 80; ++i) {
    ++stamp.field_time_ms;
    now_us += 1'000;
    engine::Event event = engine::EditReversed{below(2) == 0};
    if (below(4) != 0 || !engine.Check(event).ok()) {
      engine::FieldEdited edited;
      edited.edit.type = 1;
      edited.edit.level = field::kLevelsPerQuantum * static_cast<uint32_t>(1 + below(8));
      edited.edit.action =
          below(3) == 0 ? field::FieldEdit::Action::kErase : field::FieldEdit::Action::kSet;
      edited.edit.shape = field::FieldEdit::Shape::kStroke;
      edited.edit.radius_um = 4'000'000;
      edited.edit.points = {{below(20'000'000), below(20'000'000)}};
      event = edited;
    }
    apply(event);
    while (engine.is_busy()) {
      apply(engine::Advance{});
    }
    if (i % 20 != 19) {
      continue;
    }
    const auto recovered = Recover(folder);
    ASSERT_TRUE(recovered.ok()) << recovered.error();
    EXPECT_EQ(recovered.value().sequence, engine.sequence());
    EXPECT_EQ(recovered.value().engine.StateHash(), engine.StateHash());
    EXPECT_EQ(recovered.value().cost_since_snapshot, since);
    EXPECT_LT(since, settings.snapshot_cost + highest);
  }
  EXPECT_GE(snapshots, 1);
  EXPECT_LT(highest, 50'000u) << "portions are bounded";
}

}  // namespace
}  // namespace pheromone::journal
