#include "server/cluster/cluster.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "server/base/bytes.h"
#include "server/cluster/cluster_log.h"
#include "server/cluster/testing/memory_log.h"
#include "server/core/engine/service/service.h"
#include "server/core/engine/testing/service_bench.h"
#include "server/store/journal/format.h"

namespace pheromone::cluster {
namespace {

// A server of two, alone with a log in memory.
class ClusterTest : public ::testing::Test {
 protected:
  ClusterTest() { cluster_.Start(); }

  Cluster::Parts Parts() {
    return {.service = &service_,
            .log = &log_,
            .local = &local_,
            .now_ms = [this] { return now_ms_; },
            .wake_at = [](uint64_t) {},
            .send = [this](const std::string&, PeerMessage it) { sent_.push_back(std::move(it)); },
            .send_all = [](const PeerMessage&) {},
            .deliver = [](const std::vector<engine::Outgoing>&) {},
            .on_lead = [](bool) {},
            .restart = [this](const std::string& why) { restarts_.push_back(why); },
            .change = [](const OperatorChange&, const std::function<void(OperatorResult)>&) {},
            .halt = [] {},
            .on_id = [](const std::string&) { return Ok(); },
            .freeze = nullptr,  // no state is given or taken here
            .aside = nullptr,
            .end_snapshots = nullptr,
            .warn = nullptr};
  }

  void Pass(uint64_t ms) {
    constexpr uint64_t kStepMs = 10;
    for (uint64_t passed = 0; passed < ms; passed += kStepMs) {
      now_ms_ += kStepMs;
      while (!posted_.empty()) {
        const std::function<void()> run = std::move(posted_.front());
        posted_.pop_front();
        run();
      }
      cluster_.Continue();
    }
  }

  // Another one leads, and is connected.
  void FollowB() {
    other_.TakeLead(0, "b", [](const Result<Leader>&) {});
    cluster_.OnUp("b");
    Pass(10);
    ASSERT_TRUE(cluster_.has_leader());
  }

  // An operator's change; `results_` has what became of it.
  void ForwardAChange() {
    ASSERT_TRUE(cluster_.Forward({0, engine::EditReversed{}}, [this](const OperatorResult& result) {
      results_.push_back(result);
    }));
  }

  // While this server, which leads, is stopped, b takes the lead and appends an event.
  void LoseTheLeadWhileStopped() {
    replicated_.SetPaused(true);
    std::optional<Leader> leader;
    other_.TakeLead(engine_.leader().term, "b",
                    [&](const Result<Leader>& it) { leader = it.value(); });
    Pass(10);
    ASSERT_TRUE(leader);
    ASSERT_FALSE(local_.events.empty());
    Group group{.first = local_.events.size() + 1, .count = 1, .term = leader->term, .records = {}};
    ByteWriter scratch;
    journal::AppendEvent(group.first, {2'000, 1'700'000'001'000}, local_.events[0].second, &scratch,
                         &group.records);
    std::optional<Appended> appended;
    other_.Append(group, [&](Appended it) { appended = it; });
    Pass(10);
    ASSERT_EQ(appended, Appended::kCommitted);
  }

  uint64_t now_ms_ = 1'000;
  std::vector<std::string> restarts_;
  std::vector<PeerMessage> sent_;
  std::vector<OperatorResult> results_;
  std::deque<std::function<void()>> posted_;
  MemoryEngine engine_;
  MemoryLog replicated_{&engine_,
                        [this](std::function<void()> run) { posted_.push_back(std::move(run)); }};
  MemoryLog other_{&engine_,
                   [this](std::function<void()> run) { posted_.push_back(std::move(run)); }};
  engine::testing::ScriptedLog local_;
  ClusterLog log_{&local_, {}};
  engine::Service service_{&log_, [] { return engine::ClockReading{1'000, 1'700'000'000'000}; }};
  Cluster cluster_{{.node = "a", .nodes = {"a", "b"}}, 1, false, &replicated_, Parts()};
};

TEST_F(ClusterTest, WhatIsUncommittedIsNotToldAsCommittedWhileTheLeadIsHandedOver) {
  Pass(3'000);
  ASSERT_TRUE(log_.leads());
  replicated_.SetFault(MemoryLog::Fault::kRequestLost);
  ASSERT_TRUE(service_.Configure(engine::testing::SmallConfig(), 7).ok());
  Pass(100);
  EXPECT_EQ(cluster_.view().committed, 0);
  cluster_.StepDown("");
  Pass(100);
  ASSERT_FALSE(log_.leads());
  EXPECT_EQ(cluster_.view().committed, 0);
  replicated_.SetFault(MemoryLog::Fault::kNone);
  Pass(200);
  EXPECT_EQ(cluster_.view().committed, log_.appended());
}

TEST_F(ClusterTest, AFormerLeaderWithoutChangesOfItsOwnFollows) {
  Pass(3'000);
  ASSERT_TRUE(service_.Configure(engine::testing::SmallConfig(), 7).ok());
  Pass(100);
  ASSERT_TRUE(log_.leads());
  ASSERT_NO_FATAL_FAILURE(LoseTheLeadWhileStopped());
  replicated_.SetPaused(false);
  Pass(100);
  EXPECT_TRUE(restarts_.empty());
  EXPECT_FALSE(log_.leads());
  EXPECT_EQ(local_.events.size(), 2u);
  EXPECT_EQ(log_.DurableSequence(), 2u);
}

TEST_F(ClusterTest, AFormerLeaderWithAChangeThatIsNotInTheLogRestarts) {
  Pass(3'000);
  ASSERT_TRUE(service_.Configure(engine::testing::SmallConfig(), 7).ok());
  Pass(100);
  ASSERT_NO_FATAL_FAILURE(LoseTheLeadWhileStopped());
  ASSERT_TRUE(log_.leads());
  engine::EngineConfig config = engine::testing::SmallConfig();
  config.field.pheromones[0].tau_ms += 1'000;
  ASSERT_TRUE(service_.Configure(config, 7).ok());
  replicated_.SetPaused(false);
  Pass(100);
  EXPECT_EQ(restarts_.size(), 1u);
  EXPECT_EQ(local_.events.size(), 1u);
}

TEST_F(ClusterTest, AnOperatorIsToldTheResultOfAForwardedChangeOnce) {
  FollowB();
  ForwardAChange();
  ASSERT_EQ(sent_.size(), 1u);
  OperatorResult result;
  result.number = std::get<OperatorChange>(sent_[0]).number;
  result.ok = true;
  cluster_.OnMessage("b", result);
  cluster_.OnMessage("b", result);
  cluster_.OnDown("b");
  ASSERT_EQ(results_.size(), 1u);
  EXPECT_TRUE(results_[0].ok);
}

TEST_F(ClusterTest, AnOperatorIsToldWhenTheChangeWasNotSentWasLostOrTheServerStops) {
  FollowB();
  ForwardAChange();
  cluster_.OnNotSent(sent_.at(0));
  ASSERT_EQ(results_.size(), 1u);
  EXPECT_NE(results_[0].text.find("nothing was changed"), std::string::npos);
  ForwardAChange();
  cluster_.OnDown("b");
  ASSERT_EQ(results_.size(), 2u);
  EXPECT_NE(results_[1].text.find("connection to b"), std::string::npos);
  EXPECT_FALSE(cluster_.has_leader());
  cluster_.OnUp("b");
  ForwardAChange();
  cluster_.Stop();
  ASSERT_EQ(results_.size(), 3u);
  EXPECT_FALSE(results_[2].ok);
}

// Not before the server itself stops: operators may halt the robots of all, or end a lead.
TEST_F(ClusterTest, ForwardingEndsBeforeTheRest) {
  FollowB();
  ForwardAChange();
  cluster_.EndForwarding();
  ASSERT_EQ(results_.size(), 1u);
  EXPECT_FALSE(results_[0].ok);
  other_.TakeLead(engine_.leader().term, "b", [](const Result<Leader>&) {});
  Pass(100);
  EXPECT_EQ(cluster_.view().leader.term, 2u);
  EXPECT_FALSE(cluster_.Forward({0, engine::EditReversed{}}, [](const OperatorResult&) {}));
}

}  // namespace
}  // namespace pheromone::cluster
