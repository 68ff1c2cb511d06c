#include "server/cluster/cluster_log.h"

#include <gtest/gtest.h>

#include <utility>
#include <variant>
#include <vector>

#include "server/core/engine/event_codec.h"
#include "server/core/engine/service/service.h"
#include "server/core/engine/testing/service_bench.h"
#include "server/store/journal/format.h"

namespace pheromone::cluster {
namespace {

using engine::ClockReading;
using engine::Outgoing;
using engine::Service;
using engine::testing::Deposit;
using engine::testing::Hello;
using engine::testing::ScriptedLog;
using protocol::Reason;

class ClusterLogTest : public ::testing::Test {
 protected:
  // It leads, and has configured its service.
  void Lead() {
    log_.Lead();
    ASSERT_TRUE(service_.Configure(engine::testing::SmallConfig(), 7).ok());
  }

  std::vector<Outgoing> Handle(const std::vector<protocol::Message>& messages) {
    std::vector<Outgoing> out;
    service_.Handle(0, messages, &out);
    return out;
  }
  std::vector<Outgoing> Release() {
    std::vector<Outgoing> out;
    service_.Release(&out);
    return out;
  }

  ScriptedLog local_;
  int submitted_ = 0;
  int committed_ = 0;
  ClusterLog log_{&local_,
                  {.max_pending = 4,
                   .submitted = [this] { ++submitted_; },
                   .committed = [this] { ++committed_; }}};
  ClockReading now_{1'000, 1'700'000'000'000};
  Service service_{&log_, [this] { return now_; }};
};

TEST_F(ClusterLogTest, AnswersAndTheLocalLogWaitForTheCommit) {
  Lead();
  EXPECT_TRUE(Handle({Hello(1, 1)}).empty());
  EXPECT_TRUE(Release().empty());
  EXPECT_TRUE(local_.events.empty()) << "nothing is committed yet";
  log_.Commit(1);
  EXPECT_TRUE(Release().empty());
  log_.Commit(2);
  EXPECT_EQ(committed_, 2);
  EXPECT_EQ(Release().size(), 1u);
  ASSERT_EQ(local_.events.size(), 2u);
  EXPECT_TRUE(std::holds_alternative<engine::RequestReceived>(local_.events[1].second));
}

TEST_F(ClusterLogTest, WhatIsSubmittedAreTheRecordsOfTheJournalEachOnce) {
  Lead();
  Handle({Hello(1, 1)});
  EXPECT_EQ(submitted_, 1) << "told once until they are collected";
  const auto first = log_.CollectSubmitted();
  ASSERT_EQ(first.size(), 2u);
  EXPECT_TRUE(log_.CollectSubmitted().empty());
  log_.Commit(1);
  now_.boottime_ms += 40;
  Handle({Deposit(1, 1)});
  EXPECT_EQ(submitted_, 2);
  const auto second = log_.CollectSubmitted();
  ASSERT_EQ(second.size(), 1u);
  EXPECT_EQ(second[0].sequence, 3u);
  journal::RecordReader reader(second[0].record, 0);
  journal::Record record;
  ASSERT_EQ(reader.Next(&record), journal::RecordReader::Found::kRecord);
  EXPECT_EQ(record.sequence, 3u);
  EXPECT_EQ(record.stamp.field_time_ms, 40u);
  ByteReader bytes(record.event);
  const engine::Event event = engine::DecodeEvent(&bytes);
  EXPECT_EQ(std::get<engine::RequestReceived>(event).message.opcode, Deposit(1, 1).opcode);
}

TEST_F(ClusterLogTest, AServerThatDoesNotLeadRefusesChangesAndSaysWhy) {
  EXPECT_EQ(log_.Admit(), Reason::kBusy);
  EXPECT_EQ(log_.Trouble(), "no leader yet");
  Lead();
  EXPECT_EQ(log_.Admit(), Reason::kNone);
  EXPECT_EQ(log_.Trouble(), "");
  log_.EndLead();
  EXPECT_EQ(log_.Admit(), Reason::kBusy);
  log_.SetTrouble("nobody leads");
  log_.Lead();
  EXPECT_EQ(log_.Admit(), Reason::kNone) << "who sees that it leads may change the state at once";
}

TEST_F(ClusterLogTest, TooManyPendingEventsAreBusyUntilTheyAreCommitted) {
  Lead();
  Handle({Hello(1, 1), Hello(2, 1), Hello(3, 1)});
  EXPECT_EQ(log_.Admit(), Reason::kBusy);
  log_.Commit(1);
  EXPECT_EQ(log_.Admit(), Reason::kNone);
}

TEST_F(ClusterLogTest, ALocalLogThatRefusesChangesRefusesThemHere) {
  Lead();
  local_.admit = Reason::kReadOnly;
  EXPECT_EQ(log_.Admit(), Reason::kReadOnly);
  local_.trouble = "no space";
  EXPECT_EQ(log_.Trouble(), "no space");
}

TEST_F(ClusterLogTest, AFollowedEventIsInTheLocalLogAtOnce) {
  Lead();
  Handle({Hello(1, 1)});
  log_.Commit(2);
  ScriptedLog other_local;
  ClusterLog other(&other_local, {});
  Service follower(&other, [this] { return now_; });
  std::vector<Outgoing> out;
  for (const auto& [stamp, event] : local_.events) {
    ASSERT_TRUE(follower.Follow(stamp, event, &out).ok());
  }
  EXPECT_EQ(other_local.events.size(), 2u);
  EXPECT_EQ(other.DurableSequence(), 2u);
  EXPECT_EQ(follower.StateHash(), service_.StateHash());
  // It takes over, and goes on with the next sequence.
  other.Lead();
  follower.Handle(0, std::vector<protocol::Message>{Deposit(1, 1)}, &out);
  EXPECT_EQ(other.CollectSubmitted().at(0).sequence, 3u);
  other.Commit(3);
  EXPECT_EQ(other_local.events.size(), 3u);
}

TEST_F(ClusterLogTest, TheHashOfARotationStaysAfterItsEvent) {
  Lead();
  Handle({Hello(1, 1)});
  const uint64_t hash = service_.StateHash();
  local_.rotation_due = true;
  Handle({Deposit(1, 1)});
  EXPECT_FALSE(log_.IsRotationDue()) << "it is on its way";
  log_.CollectSubmitted();
  log_.Commit(2);
  EXPECT_EQ(local_.rotated, (std::vector<std::pair<size_t, uint64_t>>{{2, hash}}));
  log_.Commit(3);
  EXPECT_EQ(local_.events.size(), 3u);
  Handle({Deposit(1, 2)});
  EXPECT_EQ(log_.CollectSubmitted().size(), 1u);
  log_.Commit(4);
  EXPECT_EQ(local_.rotated.size(), 1u);
}

// The first event of each interval of field time, which is the same on each server.
TEST_F(ClusterLogTest, TheStateIsHashedAfterTheFirstEventOfEachTenSeconds) {
  Lead();
  Handle({Hello(1, 1)});
  EXPECT_TRUE(log_.CollectHashes().empty()) << "what was before is not known";
  now_.boottime_ms += 10'000;
  Handle({Deposit(1, 1)});
  const uint64_t hash = service_.StateHash();
  now_.boottime_ms += 10;
  Handle({Deposit(1, 2)});
  Handle({Hello(2, 2)});
  const auto hashes = log_.CollectHashes();
  ASSERT_EQ(hashes.size(), 1u);
  EXPECT_EQ(hashes[0].sequence, 3u);
  EXPECT_EQ(hashes[0].hash, hash);
  EXPECT_TRUE(log_.CollectHashes().empty());
  EXPECT_TRUE(local_.rotated.empty()) << "the journal did not ask";
}

TEST_F(ClusterLogTest, ThoseWhoWaitAreCalledWhenTheirEventIsCommitted) {
  Lead();
  Handle({Hello(1, 1)});
  std::vector<int> called;
  EXPECT_TRUE(log_.WhenDurable(2, [&] { called.push_back(2); }));
  EXPECT_TRUE(log_.WhenDurable(1, [&] { called.push_back(1); }));
  log_.Commit(1);
  EXPECT_EQ(called, std::vector<int>{1});
  log_.Commit(2);
  EXPECT_EQ(called, (std::vector<int>{1, 2}));
  EXPECT_TRUE(log_.WhenDurable(2, [&] { called.push_back(3); }));
  EXPECT_EQ(called.size(), 3u) << "at once";
}

}  // namespace
}  // namespace pheromone::cluster
