// Large events are written before they happen, a piece with each group.

#include <gtest/gtest.h>

#include <functional>
#include <future>
#include <string>
#include <utility>
#include <vector>

#include "server/core/engine/event_codec.h"
#include "server/core/engine/testing/random_traffic.h"
#include "server/store/journal/event_reader.h"
#include "server/store/journal/local_journal.h"
#include "server/store/journal/testing/crash_folder.h"
#include "server/store/journal/testing/life.h"

namespace pheromone::journal {
namespace {

using protocol::Reason;
using testing::CrashFolder;

class WriteAheadTest : public ::testing::Test {
 protected:
  static JournalSettings Settings() {
    JournalSettings settings;
    settings.segment_bytes = 2'000;
    settings.piece_bytes = 200;
    return settings;
  }

  void SetUp() override { journal_.WriteOnce(); }

  static engine::Event Large() {
    return engine::ConfigChanged{engine::testing::RichConfig(true), 3, false};
  }
  static std::string BytesOf(const engine::Event& event) {
    ByteWriter writer;
    engine::EncodeEvent(event, &writer);
    return writer.Take();
  }
  static bool IsAhead(const engine::Event& event) {
    return std::get<engine::ConfigChanged>(event).ahead != nullptr;
  }

  // `between` is called after each group.
  Status WriteAhead(
      engine::Event* event, const std::function<void()>& between = [] {}) {
    uint64_t groups = journal_.status().groups;
    return testing::WriteAhead(&journal_, event, [&] {
      if (journal_.status().groups != std::exchange(groups, journal_.status().groups)) {
        between();
      }
    });
  }

  std::vector<std::string> Events() {
    std::vector<std::string> events;
    const auto walked =
        WalkEvents(folder_, [&events](const Record& record) { events.emplace_back(record.event); });
    EXPECT_TRUE(walked.ok());
    EXPECT_EQ(walked.value().cut_short, "");
    return events;
  }

  CrashFolder folder_{1};
  uint64_t now_us_ = 0;
  LocalJournal journal_{&folder_, Settings(), [this] { return now_us_; },
                        [](bool, const std::string&) {}, LocalJournal::Start{}};
};

TEST_F(WriteAheadTest, ItIsTheSameEventAndShortWhenItHappens) {
  engine::Event event = Large();
  const std::string bytes = BytesOf(event);
  ASSERT_GT(bytes.size(), 1'000u);
  ASSERT_TRUE(WriteAhead(&event).ok());
  ASSERT_TRUE(IsAhead(event));
  const uint64_t before = folder_.bytes();
  journal_.Append({1, 2}, event);
  EXPECT_LE(journal_.status().queued_bytes, 1'024u);
  journal_.WriteOnce();
  EXPECT_EQ(journal_.DurableSequence(), 1u);
  EXPECT_LT(folder_.bytes() - before, 100u);
  EXPECT_EQ(Events(), std::vector{bytes});
}

// A robot's change waits for its group and for one piece.
TEST_F(WriteAheadTest, OthersHaveTheirTurnBetweenTwoPieces) {
  engine::Event event = Large();
  const std::string bytes = BytesOf(event);
  const std::string small = BytesOf(engine::Advance{});
  uint64_t appended = 0;
  uint64_t size = folder_.bytes();
  uint64_t largest = 0;
  ASSERT_TRUE(WriteAhead(&event, [&] {
                EXPECT_EQ(journal_.DurableSequence(), appended);
                EXPECT_EQ(journal_.Admit(), Reason::kNone);
                appended = journal_.Append({1, 1}, engine::Advance{});
                largest = std::max(largest, folder_.bytes() - std::exchange(size, folder_.bytes()));
              }).ok());
  EXPECT_GE(appended, (bytes.size() + 199) / 200) << "one piece with a group";
  EXPECT_LT(largest, 200u + 100u);
  journal_.Append({2, 2}, event);
  journal_.WriteOnce();
  std::vector<std::string> expected(appended, small);
  expected.push_back(bytes);
  EXPECT_EQ(Events(), expected);
}

TEST_F(WriteAheadTest, WhatIsSmallIsNot) {
  engine::EngineConfig config = engine::testing::RichConfig(false);
  config.field.paths.clear();
  config.field.initial_rasters.clear();
  JournalSettings settings;
  settings.piece_bytes = engine::EncodedBytesAtMost(engine::ConfigChanged{config, 1});
  LocalJournal journal(
      &folder_, settings, [] { return uint64_t{0}; }, [](bool, const std::string&) {},
      LocalJournal::Start{0, 0, "", 7});
  engine::Event event = engine::ConfigChanged{config, 1};
  EXPECT_TRUE(journal.WriteAhead(&event).ok()) << "nobody writes, so it would not come back";
  EXPECT_FALSE(IsAhead(event));
}

// The reference to the pieces must be in the segment that has them.
TEST_F(WriteAheadTest, NoSegmentEndsBeforeTheEventHasComeOrIsGivenUp) {
  engine::Event event = Large();
  while (journal_.status().segment_bytes < 1'900) {
    journal_.Append({1, 1}, engine::Advance{});
    journal_.WriteOnce();
  }
  ASSERT_FALSE(journal_.IsRotationDue());
  ASSERT_TRUE(WriteAhead(&event).ok());
  journal_.Append({1, 1}, engine::Advance{});
  journal_.WriteOnce();
  journal_.WriteOnce();
  ASSERT_GT(journal_.status().segment_bytes, Settings().segment_bytes);
  EXPECT_FALSE(journal_.IsRotationDue());
  event = engine::Advance{};  // given up
  EXPECT_TRUE(journal_.IsRotationDue());
  event = Large();
  ASSERT_TRUE(WriteAhead(&event).ok());
  EXPECT_FALSE(journal_.IsRotationDue());
  journal_.Append({2, 2}, event);
  EXPECT_TRUE(journal_.IsRotationDue()) << "the event is in this segment";
  journal_.Rotate(5);
  journal_.WriteOnce();
  EXPECT_EQ(journal_.status().segment_ordinal, 1u);
  EXPECT_EQ(Events().back(), BytesOf(event));
  EXPECT_EQ(folder_.Contents(SegmentName(2)).size(), kSegmentHeaderBytes);
}

TEST_F(WriteAheadTest, ASegmentThatEndsMeanwhileHasThemAgain) {
  engine::Event event = Large();
  const std::string bytes = BytesOf(event);
  while (!journal_.IsRotationDue()) {
    journal_.Append({1, 1}, engine::Advance{});
    journal_.WriteOnce();
    journal_.WriteOnce();
  }
  int groups = 0;
  ASSERT_TRUE(WriteAhead(&event, [&] {
                if (++groups == 3) {
                  journal_.Rotate(5);
                }
              }).ok());
  EXPECT_EQ(journal_.status().segment_ordinal, 2u);
  journal_.Append({2, 2}, event);
  journal_.WriteOnce();
  EXPECT_EQ(Events().back(), bytes);
  EXPECT_EQ(folder_.Contents(SegmentName(2)).find(bytes.substr(0, 300)), std::string::npos)
      << "it is there in pieces";
}

TEST_F(WriteAheadTest, AWriteThatFailsIsToldAndTheNextTryWorks) {
  for (int at = 1; at < 5; ++at) {
    engine::Event event = Large();
    int groups = 0;
    const Status status = WriteAhead(&event, [&] {
      if (++groups == at) {
        folder_.FailAppends(1);
      }
    });
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error(),
              "changes are refused: journal: cannot be written: Input/output error");
    EXPECT_FALSE(IsAhead(event));
    EXPECT_FALSE(journal_.WriteAhead(&event).ok()) << "at once, while nothing is taken";
    now_us_ += 60'000'000;
    journal_.WriteOnce();
    EXPECT_EQ(journal_.Admit(), Reason::kNone);
  }
  engine::Event event = Large();
  ASSERT_TRUE(WriteAhead(&event).ok());
  journal_.Append({2, 2}, event);
  journal_.WriteOnce();
  EXPECT_EQ(Events(), std::vector{BytesOf(event)});
}

// What owes the event has not its pieces: it gets all of it.
TEST_F(WriteAheadTest, ASegmentThatTakesTheirsPlaceHasTheWholeEvent) {
  engine::Event event = Large();
  ASSERT_TRUE(WriteAhead(&event).ok());
  journal_.Append({2, 2}, event);
  folder_.FailSyncs(1);
  journal_.WriteOnce();
  EXPECT_EQ(journal_.DurableSequence(), 0u);
  now_us_ += 60'000'000;
  journal_.WriteOnce();
  EXPECT_EQ(journal_.DurableSequence(), 1u);
  EXPECT_EQ(Events(), std::vector{BytesOf(event)});
  EXPECT_NE(folder_.Contents(SegmentName(2)).find(BytesOf(event)), std::string::npos);
}

// Broken and mended before the event has come.
TEST_F(WriteAheadTest, AnEventWhosePiecesAreInABrokenSegmentIsWrittenWhole) {
  engine::Event event = Large();
  ASSERT_TRUE(WriteAhead(&event).ok());
  folder_.FailAppends(1);
  journal_.Append({1, 1}, engine::Advance{});
  journal_.WriteOnce();
  now_us_ += 60'000'000;
  journal_.WriteOnce();
  journal_.Append({2, 2}, event);
  journal_.WriteOnce();
  EXPECT_EQ(Events(), (std::vector{BytesOf(engine::Advance{}), BytesOf(event)}));
}

TEST_F(WriteAheadTest, ClosingEndsIt) {
  engine::Event event = Large();
  std::future<Status> written =
      std::async(std::launch::async, [this, &event] { return journal_.WriteAhead(&event); });
  journal_.Stop();
  const Status status = written.get();
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error(), "the journal is being closed");
}

}  // namespace
}  // namespace pheromone::journal
