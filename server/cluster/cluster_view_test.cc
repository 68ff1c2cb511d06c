#include <gtest/gtest.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <utility>
#include <vector>

#include "server/cluster/cluster.h"
#include "server/cluster/cluster_log.h"
#include "server/cluster/testing/memory_log.h"
#include "server/core/engine/service/service.h"
#include "server/core/engine/testing/service_bench.h"

namespace pheromone::cluster {
namespace {

// A server of two, alone with a log in memory.
class ClusterViewTest : public ::testing::Test {
 protected:
  ClusterViewTest() { cluster_.Start(); }

  Cluster::Parts Parts() {
    return {.service = &service_,
            .log = &log_,
            .local = &local_,
            .now_ms = [this] { return now_ms_; },
            .wake_at = [](uint64_t) {},
            .send = [](const std::string&, const PeerMessage&) {},
            .send_all = [](const PeerMessage&) {},
            .deliver = [](const std::vector<engine::Outgoing>&) {},
            .on_lead = [](bool) {},
            .restart = [](const std::string&) {},
            .change = [](const OperatorChange&, const std::function<void(OperatorResult)>&) {},
            .halt = [](const HaltAll&) { return HaltDone{}; }};
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

  uint64_t now_ms_ = 1'000;
  std::deque<std::function<void()>> posted_;
  MemoryEngine engine_;
  MemoryLog replicated_{&engine_,
                        [this](std::function<void()> run) { posted_.push_back(std::move(run)); }};
  engine::testing::ScriptedLog local_;
  ClusterLog log_{&local_, {}};
  engine::Service service_{&log_, [] { return engine::ClockReading{1'000, 1'700'000'000'000}; }};
  Cluster cluster_{{.node = "a", .nodes = {"a", "b"}}, 1, &replicated_, Parts()};
};

TEST_F(ClusterViewTest, WhatIsUncommittedIsNotToldAsCommittedWhileTheLeadIsHandedOver) {
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

}  // namespace
}  // namespace pheromone::cluster
