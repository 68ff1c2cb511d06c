#include "server/store/journal/local_journal.h"

#include <gtest/gtest.h>

#include <thread>

#include "server/store/journal/recovery.h"
#include "server/store/journal/testing/crash_folder.h"
#include "server/store/journal/testing/life.h"

namespace pheromone::journal {
namespace {

using protocol::Reason;
using testing::CrashFolder;
using testing::Lives;
using testing::SmallJournal;

class LocalJournalTest : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(lives_.Begin(), ""); }

  void Submit(int count) {
    for (int i = 0; i < count; ++i) {
      ASSERT_TRUE(lives_.Submit());
    }
  }
  uint64_t Durable() { return lives_.journal().DurableSequence(); }

  // Nothing is written ahead, so nothing is written before a test says so.
  static JournalSettings Settings() {
    JournalSettings settings = SmallJournal();
    settings.piece_bytes = size_t{1} << 20;
    return settings;
  }

  CrashFolder folder_{1};
  Lives lives_{&folder_, Settings(), 1};
};

TEST_F(LocalJournalTest, WhatQueuedMeanwhileIsOneGroup) {
  Submit(5);
  EXPECT_EQ(Durable(), 0u);
  const uint64_t before = folder_.operations();
  lives_.Write();
  EXPECT_EQ(Durable(), 5u);
  EXPECT_EQ(folder_.operations() - before, 2u);  // an append and a sync
  EXPECT_EQ(lives_.journal().status().queued_bytes, 0u);
}

TEST_F(LocalJournalTest, MoreBeingDurableIsTold) {
  int told = 0;
  lives_.journal().OnDurable([&told] { ++told; });
  lives_.Write();
  EXPECT_EQ(told, 0);
  Submit(3);
  lives_.Write();
  EXPECT_EQ(told, 1);
}

TEST_F(LocalJournalTest, WhoWaitsForTheDiskIsCalledOnceWhenItHasIt) {
  Submit(3);
  std::vector<int> called;
  const auto note = [&called](int who) { return [&called, who] { called.push_back(who); }; };
  EXPECT_TRUE(lives_.journal().WhenDurable(4, note(4)));
  EXPECT_TRUE(lives_.journal().WhenDurable(3, note(3)));
  EXPECT_TRUE(lives_.journal().WhenDurable(1, note(1)));
  EXPECT_TRUE(called.empty()) << "nothing is on the disk yet";
  lives_.Write();
  EXPECT_EQ(called, (std::vector<int>{3, 1})) << "in the order in which they came";
  EXPECT_TRUE(lives_.journal().WhenDurable(3, note(30)));
  EXPECT_EQ(called.back(), 30) << "within the call";
  Submit(2);
  lives_.Write();
  EXPECT_EQ(called, (std::vector<int>{3, 1, 30, 4}));
  Submit(1);
  lives_.Write();
  EXPECT_EQ(called.size(), 4u);
}

TEST_F(LocalJournalTest, AFailedSyncCallsNobodyWhoWaits) {
  Submit(2);
  int called = 0;
  EXPECT_TRUE(lives_.journal().WhenDurable(2, [&called] { ++called; }));
  folder_.FailSyncs(1);
  lives_.Write();
  EXPECT_EQ(called, 0);
  lives_.PassTime(1'000'000);
  lives_.Write();  // to a new segment
  EXPECT_EQ(called, 1);
}

TEST_F(LocalJournalTest, WhoIsCalledMayWaitAgainAndHearsAfterTheAnswers) {
  Submit(1);
  std::string order;
  lives_.journal().OnDurable([&order] { order += "answers "; });
  EXPECT_TRUE(lives_.journal().WhenDurable(1, [&] {
    order += "first ";
    EXPECT_TRUE(lives_.journal().WhenDurable(1, [&order] { order += "at-once "; }));
    EXPECT_TRUE(lives_.journal().WhenDurable(2, [&order] { order += "second "; }));
  }));
  lives_.Write();
  EXPECT_EQ(order, "answers first at-once ");
  Submit(1);
  lives_.Write();
  EXPECT_EQ(order, "answers first at-once answers second ");
}

TEST_F(LocalJournalTest, OnlySoManyMayWait) {
  Submit(1);
  size_t called = 0;
  for (size_t i = 0; i < engine::OrderedLog::kMaxDurableWaiters; ++i) {
    ASSERT_TRUE(lives_.journal().WhenDurable(1, [&called] { ++called; }));
  }
  EXPECT_FALSE(lives_.journal().WhenDurable(1, [&called] { called += 10'000; }));
  lives_.Write();
  EXPECT_EQ(called, engine::OrderedLog::kMaxDurableWaiters);
  Submit(1);
  EXPECT_TRUE(lives_.journal().WhenDurable(2, [] {}));
}

TEST_F(LocalJournalTest, ADiskThatDoesNotAdvanceIsTold) {
  lives_.PassTime(3'000'000);
  EXPECT_EQ(lives_.journal().status().stalled_us, 0u) << "nothing waits";
  Submit(1);
  lives_.PassTime(400'000);
  Submit(1);  // does not hide how long the first has waited
  lives_.PassTime(599'999);
  EXPECT_EQ(lives_.journal().status().stalled_us, 999'999u);
  EXPECT_EQ(lives_.journal().Trouble(), "");
  lives_.PassTime(1'100'001);
  EXPECT_EQ(lives_.journal().status().stalled_us, 2'100'000u);
  EXPECT_EQ(lives_.journal().Trouble(), "no response from the disk for 2.1 s");
  lives_.Write();
  EXPECT_EQ(lives_.journal().status().stalled_us, 0u);
  EXPECT_EQ(lives_.journal().Trouble(), "");
}

TEST_F(LocalJournalTest, ADiskThatAdvancesIsNotStalledHoweverMuchWaits) {
  Submit(1);
  lives_.PassTime(900'000);
  Submit(1);
  ASSERT_TRUE(lives_.journal().WriteOnce() || Durable() == 2u);
  Submit(1);
  lives_.PassTime(900'000);
  EXPECT_EQ(lives_.journal().status().stalled_us, 900'000u);
  EXPECT_EQ(lives_.journal().Trouble(), "");
}

TEST_F(LocalJournalTest, AFailedSyncIsTroubleUntilItHeals) {
  Submit(1);
  folder_.FailSyncs(1);
  lives_.Write();
  EXPECT_EQ(lives_.journal().Trouble(),
            "changes are refused: journal: cannot be synced: Input/output error");
  lives_.PassTime(1'000'000);
  lives_.Write();
  EXPECT_EQ(lives_.journal().Trouble(), "");
}

TEST_F(LocalJournalTest, AFullQueueIsBusy) {
  int taken = 0;
  while (lives_.Submit()) {
    ++taken;
  }
  EXPECT_GT(taken, 5);
  EXPECT_EQ(lives_.journal().Admit(), Reason::kBusy);
  lives_.Write();
  EXPECT_EQ(lives_.journal().Admit(), Reason::kNone);
}

TEST_F(LocalJournalTest, AFailedSyncMakesItReadOnlyUntilAllIsInANewSegment) {
  Submit(3);
  lives_.Write();
  const std::string before = folder_.Contents(SegmentName(1));
  Submit(4);
  folder_.FailSyncs(3);
  lives_.Write();
  EXPECT_EQ(lives_.journal().Admit(), Reason::kReadOnly);
  EXPECT_EQ(Durable(), 3u) << "nothing is acknowledged that is not on the disk";
  EXPECT_NE(lives_.journal().status().problem.find("cannot be synced"), std::string::npos);
  lives_.PassTime(100'000);
  lives_.Write();  // and fails again
  EXPECT_EQ(lives_.journal().Admit(), Reason::kReadOnly);
  EXPECT_EQ(Durable(), 3u);
  for (int i = 0; i < 8; ++i) {
    lives_.PassTime(1'000'000);
    lives_.Write();
  }
  EXPECT_EQ(lives_.journal().Admit(), Reason::kNone);
  EXPECT_EQ(Durable(), 7u);
  EXPECT_EQ(lives_.told().back(), "journal: changes are accepted again");
  Submit(2);
  lives_.Write();
  EXPECT_EQ(Durable(), 9u);
  // Even if the disk has nothing of what the failed sync was to write.
  folder_.CutAt(1);
  EXPECT_FALSE(folder_.Sync().ok());
  folder_.PowerOn();
  EXPECT_EQ(lives_.Begin(), "");
  EXPECT_EQ(lives_.engine().sequence(), 9u);
  EXPECT_EQ(folder_.Contents(SegmentName(1)).substr(0, before.size()), before);
}

TEST_F(LocalJournalTest, AFailedWriteIsMendedTheSameWay) {
  Submit(3);
  folder_.FailAppends(1);
  lives_.Write();
  EXPECT_EQ(lives_.journal().Admit(), Reason::kReadOnly);
  EXPECT_EQ(Durable(), 0u);
  lives_.PassTime(1'000'000);
  lives_.Write();
  EXPECT_EQ(Durable(), 3u);
  EXPECT_EQ(lives_.Begin(), "");
  EXPECT_EQ(lives_.engine().sequence(), 3u);
}

TEST_F(LocalJournalTest, AFullDiskRefusesChangesLosesNothingAndHeals) {
  Submit(3);
  lives_.Write();
  // Whatever was admitted fits into what is reserved.
  folder_.LimitBytes(folder_.bytes());
  int taken = 0;
  while (lives_.journal().Admit() != Reason::kReadOnly && taken < 10'000) {
    taken += lives_.Submit() ? 1 : 0;
    lives_.Write();
  }
  EXPECT_GT(taken, 10);
  EXPECT_LT(taken, 10'000);
  EXPECT_EQ(Durable(), lives_.submitted());
  EXPECT_EQ(lives_.told().back(),
            "journal: changes are refused: journal: no space left on the disk");
  lives_.PassTime(60'000'000);
  lives_.Write();
  EXPECT_EQ(lives_.journal().Admit(), Reason::kReadOnly);
  folder_.LimitBytes(UINT64_MAX);
  lives_.PassTime(60'000'000);
  lives_.Write();
  EXPECT_EQ(lives_.journal().Admit(), Reason::kNone);
  EXPECT_EQ(lives_.journal().status().failures, 0u);
  Submit(2);
  lives_.Write();
  EXPECT_EQ(lives_.Begin(), "");
}

TEST_F(LocalJournalTest, SegmentsEndWithTheHashOfTheState) {
  while (lives_.journal().status().segment_ordinal < 4) {
    lives_.Submit();
    lives_.Write();
    ASSERT_LT(lives_.submitted(), 2'000u);
  }
  const auto recovered = Recover(folder_, 3);
  ASSERT_TRUE(recovered.ok());
  EXPECT_TRUE(recovered.value().ends_with_hash);
  EXPECT_EQ(recovered.value().engine.StateHash(), lives_.hashes()[recovered.value().sequence]);
  EXPECT_TRUE(recovered.value().findings.empty());
}

TEST_F(LocalJournalTest, ASnapshotIsNamedWhenTheDiskHasItsEvents) {
  Submit(2);
  lives_.AskForSnapshot();
  lives_.MakeDueSnapshot();
  const std::string name = SnapshotName(2);
  EXPECT_TRUE(folder_.Has(name + ".new"));
  EXPECT_FALSE(folder_.Has(name));
  Submit(3);  // the state goes on; the snapshot does not
  lives_.Write();
  lives_.MakeDueSnapshot();
  EXPECT_EQ(lives_.snapshots(), 1u);
  EXPECT_TRUE(folder_.Has(name));
  EXPECT_FALSE(folder_.Has(name + ".new"));
}

TEST_F(LocalJournalTest, WhoWaitsForTheDiskItselfIsCalledByIt) {
  Submit(2);
  int called = 0;
  lives_.journal().WhenOnDisk(2, [&called] { ++called; });
  EXPECT_EQ(called, 0);
  lives_.Write();
  EXPECT_EQ(called, 1);
  lives_.journal().WhenOnDisk(1, [&called] { ++called; });
  EXPECT_EQ(called, 2);
}

TEST_F(LocalJournalTest, AnOrderlyEndLeavesNothingInDoubt) {
  Submit(7);
  ASSERT_TRUE(lives_.End().ok());
  const auto recovered = Recover(folder_);
  ASSERT_TRUE(recovered.ok());
  EXPECT_EQ(recovered.value().certain, 7u);
  EXPECT_TRUE(recovered.value().tail.empty());
  EXPECT_FALSE(recovered.value().lost);
}

TEST(LocalJournalRelaxed, AnswersBeforeItSyncsAndSaysSoToTheNextLife) {
  CrashFolder folder(2);
  JournalSettings settings = SmallJournal();
  settings.relaxed = true;
  Lives lives(&folder, settings, 3);
  ASSERT_EQ(lives.Begin(), "");
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(lives.Submit());
  }
  EXPECT_EQ(lives.journal().DurableSequence(), 5u);
  int called = 0;
  EXPECT_TRUE(lives.journal().WhenDurable(5, [&called] { ++called; }));
  EXPECT_EQ(called, 1);
  lives.journal().WhenOnDisk(5, [&called] { ++called; });
  lives.PassTime(999'999);
  lives.Write();
  EXPECT_EQ(lives.journal().status().stalled_us, 0u) << "it waits for the next sync by design";
  EXPECT_EQ(lives.journal().status().durable, 0u);
  lives.PassTime(2'000'000);
  lives.Write();
  EXPECT_EQ(called, 2);
  EXPECT_EQ(lives.journal().status().durable, 5u);
  EXPECT_NE(lives.Begin(), "");  // without an orderly end it may have lost what it had told of
  EXPECT_TRUE(lives.opened().state_lost);
  ASSERT_TRUE(lives.End().ok());
  EXPECT_EQ(lives.Begin(), "");
}

// The bytes of large events are made later, and are the same bytes in the same places.
TEST(LocalJournalLargeEvents, AreWrittenInOrderAsAllOthers) {
  CrashFolder folder(4);
  LocalJournal journal(
      &folder, JournalSettings{}, [] { return uint64_t{0}; }, [](bool, const std::string&) {},
      LocalJournal::Start{});
  journal.WriteOnce();
  engine::FieldEdited small;
  small.edit.points.assign(30, {1, 2});
  engine::FieldEdited large;
  large.edit.points.assign(1'000, {3, -4});
  engine::ConfigChanged config{engine::testing::RichConfig(true), 3, false};
  const std::vector<engine::Event> events = {engine::Advance{}, large, large, small, config,
                                             engine::Advance{}};
  std::string expected;
  ByteWriter scratch;
  uint64_t sequence = 0;
  for (const engine::Event& event : events) {
    const engine::Stamp stamp{100 + sequence, 7};
    EXPECT_EQ(journal.Append(stamp, event), ++sequence);
    AppendEvent(sequence, stamp, event, &scratch, &expected);
  }
  EXPECT_GE(journal.status().queued_bytes, expected.size()) << "they count before they are bytes";
  journal.WriteOnce();
  EXPECT_EQ(journal.status().queued_bytes, 0u);
  EXPECT_EQ(journal.DurableSequence(), sequence);
  const std::string file = folder.Contents(SegmentName(1));
  ASSERT_GE(file.size(), expected.size());
  EXPECT_EQ(file.substr(file.size() - expected.size()), expected);
}

TEST(LocalJournalLargeEvents, AreWrittenAgainAfterAFailure) {
  CrashFolder folder(5);
  uint64_t now_us = 0;
  LocalJournal journal(
      &folder, JournalSettings{}, [&now_us] { return now_us; }, [](bool, const std::string&) {},
      LocalJournal::Start{});
  journal.WriteOnce();
  engine::FieldEdited large;
  large.edit.points.assign(1'000, {3, -4});
  journal.Append({1, 1}, large);
  folder.FailAppends(1);
  journal.WriteOnce();
  EXPECT_EQ(journal.DurableSequence(), 0u);
  now_us += 1'000'000;
  journal.WriteOnce();
  EXPECT_EQ(journal.DurableSequence(), 1u);
  std::string expected;
  ByteWriter scratch;
  AppendEvent(1, {1, 1}, large, &scratch, &expected);
  EXPECT_TRUE(folder.Contents(SegmentName(2)).ends_with(expected));
}

// For ThreadSanitizer: the service's side and the writing thread's.
TEST(LocalJournalThreads, AppendsAndGroupsMeet) {
  CrashFolder folder(3);
  LocalJournal journal(
      &folder, JournalSettings{}, [] { return uint64_t{0}; }, [](bool, const std::string&) {},
      LocalJournal::Start{});
  journal.WriteOnce();
  std::thread writer([&] { journal.WriteUntilStopped(); });
  for (uint64_t i = 0; i < 2'000; ++i) {
    ASSERT_EQ(journal.Admit(), Reason::kNone);
    journal.Append({i, 0}, engine::Advance{});
  }
  journal.Stop();
  writer.join();
  ASSERT_TRUE(journal.Close(0).ok());
  EXPECT_EQ(journal.status().durable, 2'000u);
}

}  // namespace
}  // namespace pheromone::journal
