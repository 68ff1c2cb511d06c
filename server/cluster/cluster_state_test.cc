// Servers that join, diverge, or find another log, in virtual time.
#include <gtest/gtest.h>

#include <string>

#include "server/cluster/cluster.h"
#include "server/cluster/testing/cluster_world.h"
#include "server/core/engine/testing/bench.h"
#include "server/store/journal/format.h"

namespace pheromone::cluster {
namespace {

using engine::testing::Deposit;
using engine::testing::Hello;

class ClusterStateTest : public testing::Test {
 protected:
  void StartBoth() {
    world_.Start("a");
    ASSERT_TRUE(world_.RunUntil([&] { return world_.leader() == "a"; }));
    world_.Start("b");
    AwaitEqual();
  }
  void AwaitEqual() {
    ASSERT_TRUE(world_.RunUntil([&] {
      return world_["a"].sequence() == world_["b"].sequence() &&
             world_["a"].view().committed == world_["a"].sequence();
    })) << world_["b"].view().transfer;
    EXPECT_EQ(world_["a"].service().StateHash(), world_["b"].service().StateHash());
  }
  // Robot 1 at that server.
  void Lay(const std::string& node, int count) {
    for (int i = 0; i < count; ++i) {
      world_[node].Handle({Deposit(1, static_cast<uint8_t>(++nonce_))});
      world_.Run(12);
    }
  }
  void TrimAll() {
    MemoryLog log(&world_.engine(), [](const std::function<void()>& /*call*/) {});
    log.Trim(world_["a"].sequence() + 1, [](const Status& /*trimmed*/) {});
  }
  // As after a fault of memory.
  void ChangeUnnoticed(const std::string& node, const engine::Event& event) {
    world_[node].service().Inspect([&](const engine::Engine& engine) {
      std::vector<engine::Outgoing> out;
      const_cast<engine::Engine&>(engine).Apply(engine.sequence(), {engine.field_time_ms(), 0},
                                                event, &out);
    });
    ASSERT_NE(world_["a"].service().StateHash(), world_["b"].service().StateHash());
  }
  // At b, which begins again and has it.
  void ExpectTheLeadersState(const std::string& warning) {
    ASSERT_TRUE(world_.RunUntil([&] { return !world_["b"].runs(); }));
    ASSERT_EQ(world_["b"].restarts.size(), 1u);
    EXPECT_NE(world_["b"].restarts[0].find("took the state after event"), std::string::npos);
    ASSERT_EQ(world_["b"].warnings.size(), 1u);
    EXPECT_NE(world_["b"].warnings[0].find(warning), std::string::npos) << world_["b"].warnings[0];
    world_.Start("b");
    AwaitEqual();
  }

  ClusterWorld world_{"ab"};
  int nonce_ = 0;
};

TEST_F(ClusterStateTest, AChangeAtAFollowerIsForwardedAndAnsweredThere) {
  StartBoth();
  world_["b"].Handle({Hello(1, 1)});
  ASSERT_TRUE(world_.RunUntil([&] { return !world_["b"].sent.empty(); }));
  EXPECT_EQ(world_["b"].view().forwarded, 1u);
  EXPECT_TRUE(world_["a"].sent.empty());
  AwaitEqual();
}

TEST_F(ClusterStateTest, WhenTheLeaderDiesTheFollowerLeadsWithAllThatWasAnswered) {
  StartBoth();
  world_["a"].Handle({Hello(1, 1)});
  ASSERT_TRUE(world_.RunUntil([&] { return !world_["a"].sent.empty(); }));
  const uint64_t sequence = world_["a"].sequence();
  world_.Kill("a");
  ASSERT_TRUE(world_.RunUntil([&] { return world_.leader() == "b"; }));
  EXPECT_EQ(world_["b"].sequence(), sequence);
  world_.Start("a");
  AwaitEqual();
}

TEST_F(ClusterStateTest, ALeaderWhoseChangesAreNotInTheLogBeginsAgainWithoutThem) {
  StartBoth();
  world_["a"].Handle({Hello(1, 1)});
  AwaitEqual();
  world_["a"].log().SetCutOff(true);
  world_.SetCut("a", "b", true);
  world_["a"].Handle({Deposit(1, 1)});
  const uint64_t applied = world_["a"].sequence();
  ASSERT_TRUE(world_.RunUntil([&] { return world_["b"].view().role == Role::kLeads; }));
  EXPECT_LT(world_["b"].sequence(), applied);
  world_["b"].Handle({Hello(2, 2)});
  world_.Run(100);
  world_["a"].log().SetCutOff(false);
  world_.SetCut("a", "b", false);
  ASSERT_TRUE(world_.RunUntil([&] { return !world_["a"].runs(); }));
  ASSERT_EQ(world_["a"].restarts.size(), 1u);
  world_.Start("a");
  AwaitEqual();
}

// Its own state after an event that never was in the log is nobody's divergence.
TEST_F(ClusterStateTest, ALeaderThatOnlyTheLogHasLostComparesNoUncommittedState) {
  StartBoth();
  world_["a"].Handle({Hello(1, 1)});
  AwaitEqual();
  world_.Run(ClusterLog::kHashEveryMs);
  world_["a"].log().SetCutOff(true);
  world_["a"].Handle({Deposit(1, 1)});
  ASSERT_TRUE(world_.RunUntil([&] { return world_["b"].view().role == Role::kLeads; }));
  world_["b"].Handle({Hello(2, 2)});
  world_.Run(1'000);
  EXPECT_EQ(world_["b"].view().committed, world_["a"].sequence()) << "the number of a's event";
  EXPECT_EQ(world_["a"].view().divergences, 0u);
  world_["a"].log().SetCutOff(false);
  ASSERT_TRUE(world_.RunUntil([&] { return !world_["a"].runs(); }));
  world_.Start("a");
  AwaitEqual();
  EXPECT_TRUE(world_["a"].warnings.empty()) << world_["a"].warnings[0];
  EXPECT_TRUE(world_["b"].warnings.empty()) << world_["b"].warnings[0];
}

TEST_F(ClusterStateTest, AnEmptyServerTakesAStateAndTheLogsTail) {
  world_.Start("a");
  ASSERT_TRUE(world_.RunUntil([&] { return world_.leader() == "a"; }));
  world_["a"].Handle({Hello(1, 1)});
  Lay("a", 20);
  TrimAll();
  world_.Start("b");
  ASSERT_TRUE(world_.RunUntil([&] { return !world_["b"].runs(); }));
  ASSERT_EQ(world_["b"].restarts.size(), 1u);
  EXPECT_EQ(world_["b"].restarts[0], "took the state after event 22 from a");
  EXPECT_TRUE(world_["b"].disk().Has(journal::SnapshotName(22)));
  EXPECT_EQ(world_["b"].id, "memory") << "noted before the state is there";
  Lay("a", 3);
  world_.Start("b");
  EXPECT_EQ(world_["b"].sequence(), 22u);
  AwaitEqual();
  EXPECT_EQ(world_["b"].sequence(), 25u);
  world_["b"].sent.clear();
  Lay("b", 1);
  AwaitEqual();
  EXPECT_FALSE(world_["b"].sent.empty()) << "it answers";
}

// A leader's state has events that a majority may never accept.
TEST_F(ClusterStateTest, AStateIsUsedWhenAllOfItsEventsAreCommitted) {
  world_.Start("a");
  ASSERT_TRUE(world_.RunUntil([&] { return world_.leader() == "a"; }));
  world_["a"].Handle({Hello(1, 1)});
  Lay("a", 5);
  TrimAll();
  world_["a"].log().SetFault(MemoryLog::Fault::kRequestLost);
  world_["a"].Handle({Deposit(1, 99)});
  world_.Run(20);
  world_.Start("b");
  world_.Run(3'000);
  EXPECT_TRUE(world_["b"].restarts.empty());
  EXPECT_FALSE(world_["b"].disk().Has(journal::SnapshotName(8)));
  world_["a"].log().SetFault(MemoryLog::Fault::kNone);
  ASSERT_TRUE(world_.RunUntil([&] { return !world_["b"].runs(); }));
  EXPECT_EQ(world_["b"].restarts[0], "took the state after event 8 from a");
}

TEST_F(ClusterStateTest, ATransferGoesOnWithWhoeverIsThereAgain) {
  world_.Start("a");
  ASSERT_TRUE(world_.RunUntil([&] { return world_.leader() == "a"; }));
  Lay("a", 3);
  TrimAll();
  world_.Start("b");
  ASSERT_TRUE(world_.RunUntil([&] { return world_["b"].view().transfer.starts_with("takes"); }));
  world_.SetCut("a", "b", true);
  world_.Run(15'000);
  EXPECT_TRUE(world_["b"].runs());
  world_.SetCut("a", "b", false);
  EXPECT_TRUE(world_.RunUntil([&] { return !world_["b"].runs(); }));
  EXPECT_EQ(world_["b"].restarts.size(), 1u);
}

TEST_F(ClusterStateTest, AFollowerWithAnotherStateDropsItAndTakesTheLeaders) {
  StartBoth();
  world_["a"].Handle({Hello(1, 1)});
  AwaitEqual();
  field::FieldEdit edit;
  edit.type = 1;
  edit.shape = field::FieldEdit::Shape::kRectangle;
  edit.action = field::FieldEdit::Action::kAdd;
  edit.level = 1;
  edit.points = {{100'000, 100'000}, {200'000, 200'000}};
  ChangeUnnoticed("b", engine::FieldEdited{edit});
  for (int i = 0; i < 3 && world_["b"].runs(); ++i) {
    Lay("a", 1);
    world_.Run(10'000);
  }
  ExpectTheLeadersState("divergence: node a, which leads, has another state than this one");
  EXPECT_TRUE(world_["a"].restarts.empty());
  EXPECT_EQ(world_["a"].view().divergences, 1u);
}

TEST_F(ClusterStateTest, AFollowerInWhoseStateAnEventIsNotPossibleTakesTheLeaders) {
  StartBoth();
  world_["a"].Handle({Hello(1, 1)});
  AwaitEqual();
  ChangeUnnoticed("b", engine::RequestReceived{0, Deposit(1, 1)});
  Lay("a", 1);  // the same, which b has already
  Lay("a", 2);
  ExpectTheLeadersState("divergence: event 3 of the log is not possible in the state here");
}

TEST_F(ClusterStateTest, EqualStatesAreComparedAndNothingIsTold) {
  StartBoth();
  world_["a"].Handle({Hello(1, 1)});
  for (int i = 0; i < 4; ++i) {
    Lay("a", 2);
    world_.Run(10'000);
  }
  AwaitEqual();
  EXPECT_TRUE(world_["a"].warnings.empty());
  EXPECT_TRUE(world_["b"].warnings.empty());
  EXPECT_EQ(world_["b"].view().divergences, 0u);
}

TEST_F(ClusterStateTest, AWipedLogIsNotFollowedAndNotBegunAnew) {
  StartBoth();
  world_["a"].Handle({Hello(1, 1)});
  AwaitEqual();
  world_.engine().Wipe("other");
  world_.Run(5'000);
  for (const char* node : {"a", "b"}) {
    EXPECT_EQ(world_[node].view().gap, LogGap::kOtherLog) << node;
    EXPECT_EQ(world_[node].id, "memory");
  }
  EXPECT_EQ(world_.engine().leader().term, 0u);
  world_["b"].Handle({Deposit(1, 1)});
  ASSERT_EQ(world_["b"].sent.size(), 1u);
  EXPECT_EQ(world_["b"].sent[0].message.opcode, protocol::kError);
  world_.Kill("a");
  world_.Start("a");
  world_.Run(5'000);
  EXPECT_EQ(world_["a"].view().gap, LogGap::kOtherLog) << "after a restart, too";
}

TEST_F(ClusterStateTest, ALogIsBegunAnewWithAJournalThatIsToFoundIt) {
  StartBoth();
  world_["a"].Handle({Hello(1, 1)});
  AwaitEqual();
  const uint64_t sequence = world_["a"].sequence();
  world_.Kill("a");
  world_.Kill("b");
  world_.engine().Wipe("new");
  world_["a"].id = "new";
  world_["a"].founds = true;
  world_.Start("a");
  ASSERT_TRUE(world_.RunUntil([&] { return world_.leader() == "a"; }));
  EXPECT_EQ(world_.engine().floor(), sequence + 1);
  EXPECT_FALSE(world_["a"].founds);
  Lay("a", 3);
  world_.Start("b");
  world_.Run(3'000);
  EXPECT_EQ(world_["b"].view().gap, LogGap::kOtherLog) << "it has the old cluster's journal";
}

TEST_F(ClusterStateTest, ALogThatIsNotEmptyIsNotBegunAnew) {
  StartBoth();
  world_.Kill("b");
  world_["b"].id = "new";
  world_["b"].founds = true;
  world_.Start("b");
  world_.Run(3'000);
  EXPECT_EQ(world_["b"].view().gap, LogGap::kOtherLog);
  EXPECT_EQ(world_.engine().floor(), 1u);
  EXPECT_EQ(world_.leader(), "a");
}

}  // namespace
}  // namespace pheromone::cluster
