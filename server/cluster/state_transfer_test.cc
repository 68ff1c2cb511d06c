// state_sender.h and state_receiver.h, connected by hand.
#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/cluster/state_receiver.h"
#include "server/cluster/state_sender.h"
#include "server/core/engine/testing/bench.h"
#include "server/store/journal/format.h"
#include "server/store/journal/snapshot.h"
#include "server/store/journal/snapshot_writer.h"
#include "server/store/journal/testing/crash_folder.h"

namespace pheromone::cluster {
namespace {

using engine::testing::Bench;
using journal::testing::CrashFolder;

class StateTransferTest : public testing::Test {
 protected:
  // A map of several portions.
  void SetUp() override {
    field::FieldEdit edit;
    edit.type = 1;
    edit.shape = field::FieldEdit::Shape::kRectangle;
    edit.action = field::FieldEdit::Action::kAdd;
    edit.level = 1;
    edit.points = {{100'000, 100'000}, {9'900'000, 9'900'000}};
    bench_.Apply(engine::FieldEdited{edit});
    while (bench_.engine.NextDeadline() && bench_.sequence < 200) {
      bench_.Apply(engine::Advance{});
    }
  }

  void Begin(uint64_t least = 0) { receiver_.Begin("a", least, now_ms_); }

  // Until nothing more is said.
  void Exchange(uint64_t committed) {
    while (request_ || portion_) {
      if (request_) {
        sender_.OnRequest("b", *std::exchange(request_, std::nullopt), committed, now_ms_);
        sender_.Continue(committed, now_ms_);
      }
      if (portion_) {
        ++portions_;
        StatePortion portion = *std::exchange(portion_, std::nullopt);
        if (portions_ == damaged_) {
          portion.bytes[portion.bytes.size() / 2] ^= 0x7F;
        }
        receiver_.OnPortion("a", portion, now_ms_);
      }
    }
  }
  void ExpectNoFile() {
    const auto files = folder_.List();
    for (const std::string& name : files.value()) {
      ADD_FAILURE() << name;
    }
  }

  const RunAside at_once_ = [](const std::function<void()>& work,
                               const std::function<void()>& done) {
    work();
    done();
  };
  uint64_t now_ms_ = 1'000;
  Bench bench_;
  CrashFolder folder_{1};
  bool is_busy_ = false;
  std::optional<StateRequest> request_;
  std::optional<StatePortion> portion_;
  std::vector<std::pair<std::string, StatePortion>> sent_;
  int portions_ = 0;
  int damaged_ = 0;
  std::optional<Result<uint64_t>> done_;
  bool makes_own_ = true;  // snapshots
  StateSender sender_{{.freeze = [this]() -> std::unique_ptr<journal::StateSource> {
                         return is_busy_ ? nullptr
                                         : std::make_unique<journal::CopiedState>(
                                               bench_.engine, engine::Stamp{bench_.now_ms, 7});
                       },
                       .aside = at_once_,
                       .send =
                           [this](const std::string& to, StatePortion portion) {
                             sent_.emplace_back(to, portion);
                             if (to == "b") {
                               portion_ = std::move(portion);
                             }
                           }}};
  StateReceiver receiver_{
      {.folder = &folder_,
       .aside = at_once_,
       .end_snapshots =
           [this] {
             makes_own_ = false;
             ExpectNoFile();
           },
       .send = [this](const std::string& /*to*/, StateRequest request) { request_ = request; },
       .done = [this](const Result<uint64_t>& sequence) { done_ = sequence; }}};
};

TEST_F(StateTransferTest, AStateOfSeveralPortionsBecomesASnapshot) {
  Begin(bench_.sequence);
  Exchange(bench_.sequence);
  EXPECT_GT(portions_, 2);
  ASSERT_TRUE(done_.has_value());
  ASSERT_TRUE(done_->ok()) << done_->error();
  EXPECT_EQ(done_->value(), bench_.sequence);
  uint64_t byte = 0;
  const auto read = journal::ReadSnapshot(folder_, journal::SnapshotName(bench_.sequence), &byte);
  ASSERT_TRUE(read.ok()) << read.error();
  EXPECT_EQ(engine::testing::Saved(read.value().engine), engine::testing::Saved(bench_.engine));
  EXPECT_EQ(read.value().stamp.utc_ms, 7);
  EXPECT_TRUE(sender_.to().empty());
  for (const auto& [to, portion] : sent_) {
    EXPECT_TRUE(EncodePeerMessage(portion).ok());
  }
}

// In a divergence both states may be those after the same event, and so have the same name.
TEST_F(StateTransferTest, AnOwnSnapshotOfTheSameEventIsNotInTheWay) {
  Bench other;
  while (other.sequence < bench_.sequence) {
    other.Apply(engine::Advance{});
  }
  Begin();
  Exchange(bench_.sequence);
  if (makes_own_) {
    journal::CopiedState state(other.engine, engine::Stamp{1, 1});
    ASSERT_TRUE(journal::SnapshotWriter::Write(&state, &folder_).value()->GiveName().ok());
  }
  ASSERT_TRUE(done_.has_value());
  ASSERT_TRUE(done_->ok()) << done_->error();
  uint64_t byte = 0;
  const auto read = journal::ReadSnapshot(folder_, journal::SnapshotName(bench_.sequence), &byte);
  ASSERT_TRUE(read.ok()) << read.error();
  EXPECT_EQ(read.value().engine.StateHash(), bench_.engine.StateHash());
}

TEST_F(StateTransferTest, TheLastPortionWaitsUntilAllEventsAreCommitted) {
  Begin();
  Exchange(bench_.sequence - 1);
  EXPECT_FALSE(done_.has_value());
  EXPECT_FALSE(folder_.Has(journal::SnapshotName(bench_.sequence)));
  sender_.Continue(bench_.sequence, now_ms_);
  Exchange(bench_.sequence);
  ASSERT_TRUE(done_.has_value());
  EXPECT_TRUE(done_->ok());
}

TEST_F(StateTransferTest, AStateThatEndsTooEarlyIsNotTaken) {
  Begin(bench_.sequence + 1);
  Exchange(bench_.sequence);
  ASSERT_TRUE(done_.has_value() && !done_->ok());
  EXPECT_EQ(done_->error(), "node a: its state is that after event " +
                                std::to_string(bench_.sequence) + ", expected one after event " +
                                std::to_string(bench_.sequence + 1) + " or later");
  ExpectNoFile();
}

TEST_F(StateTransferTest, WhatIsDamagedOnTheWayIsNotTaken) {
  for (damaged_ = 1; damaged_ <= 2; ++damaged_) {
    done_.reset();
    portions_ = 0;
    Begin();
    Exchange(bench_.sequence);
    ASSERT_TRUE(done_.has_value()) << damaged_;
    ASSERT_FALSE(done_->ok()) << damaged_;
    ExpectNoFile();
    now_ms_ += 2 * StateSender::kPatienceMs;
  }
}

TEST_F(StateTransferTest, OneTransferAtATimeAndOneThatIsNotGoneOnWithIsGivenUp) {
  sender_.OnRequest("b", {.number = 1, .offset = 0}, 1'000, now_ms_);
  sender_.OnRequest("c", {.number = 9, .offset = 0}, 1'000, now_ms_);
  ASSERT_EQ(sent_.size(), 2u);
  EXPECT_EQ(sent_[0].second.error, "");
  EXPECT_EQ(sent_[1].first, "c");
  EXPECT_EQ(sent_[1].second.number, 9u);
  EXPECT_EQ(sent_[1].second.error, "its state is being sent to b; that takes a while");
  sender_.Continue(1'000, now_ms_ + StateSender::kPatienceMs);
  sender_.OnRequest("c", {.number = 10, .offset = 0}, 1'000, now_ms_);
  EXPECT_EQ(sent_[2].second.error, "");
  sender_.OnDown("c");
  sender_.OnRequest("b", {.number = 1, .offset = kMaxPortionBytes}, 1'000, now_ms_);
  EXPECT_NE(sent_[3].second.error, "") << "it was given up";
}

TEST_F(StateTransferTest, AServerThatIsBusyOrSilentIsNotWaitedForForever) {
  is_busy_ = true;
  Begin();
  Exchange(1'000);
  ASSERT_TRUE(done_.has_value());
  EXPECT_EQ(
      done_->error(),
      "node a: it has no state yet, or its state is being copied for a snapshot or a recording");
  done_.reset();
  Begin();
  request_.reset();
  receiver_.Continue(now_ms_ + StateReceiver::kPatienceMs - 1);
  EXPECT_FALSE(done_.has_value());
  receiver_.Continue(now_ms_ + StateReceiver::kPatienceMs);
  EXPECT_TRUE(done_.has_value() && !done_->ok());
}

}  // namespace
}  // namespace pheromone::cluster
