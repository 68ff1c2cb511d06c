#include "server/cluster/testing/memory_log.h"

#include <gtest/gtest.h>

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/cluster/testing/log_contract.h"

namespace pheromone::cluster {
namespace {

class Calls {
 public:
  MemoryLog::Post poster() {
    return [this](std::function<void()> call) { calls_.push_back(std::move(call)); };
  }
  bool RunOne() {
    if (calls_.empty()) {
      return false;
    }
    const std::function<void()> call = std::move(calls_.front());
    calls_.pop_front();
    call();
    return true;
  }
  void Run() {
    while (RunOne()) {
    }
  }

 private:
  std::deque<std::function<void()>> calls_;
};

class MemoryHarness final : public LogHarness {
 public:
  std::unique_ptr<ReplicatedLog> NewClient() override {
    return std::make_unique<MemoryLog>(&engine_, calls_.poster());
  }
  bool RunUntil(const std::function<bool()>& done) override {
    while (!done()) {
      if (!calls_.RunOne()) {
        return false;
      }
    }
    return true;
  }
  void RunReady() override { calls_.Run(); }

 private:
  Calls calls_;
  MemoryEngine engine_;
};

INSTANTIATE_TEST_SUITE_P(Memory, LogContractTest,
                         testing::Values([] { return std::make_unique<MemoryHarness>(); }));

class MemoryLogTest : public testing::Test {
 protected:
  MemoryLogTest() : log_(&engine_, calls_.poster()) {
    log_.TakeLead(0, "a", [this](const Result<Leader>& leader) { term_ = leader.value().term; });
    calls_.Run();
  }
  void Append(Sequence first) {
    outcome_.reset();
    log_.Append(MakeGroup(term_, first, 1), [this](Appended outcome) { outcome_ = outcome; });
    calls_.Run();
  }

  Calls calls_;
  MemoryEngine engine_;
  MemoryLog log_;
  Term term_ = 0;
  std::optional<Appended> outcome_;
};

TEST_F(MemoryLogTest, ALostRequestIsNotInTheLog) {
  log_.SetFault(MemoryLog::Fault::kRequestLost);
  Append(1);
  EXPECT_EQ(outcome_, Appended::kUnknown);
  EXPECT_TRUE(engine_.groups().empty());
}

TEST_F(MemoryLogTest, ALostAnswerLeavesTheGroupInTheLog) {
  log_.SetFault(MemoryLog::Fault::kAnswerLost);
  Append(1);
  EXPECT_EQ(outcome_, Appended::kUnknown);
  EXPECT_EQ(engine_.groups().size(), 1u);
  log_.SetFault(MemoryLog::Fault::kNone);
  Append(1);
  EXPECT_EQ(outcome_, Appended::kCommitted);
}

TEST_F(MemoryLogTest, ADelayedRequestWaitsForItsRelease) {
  log_.SetFault(MemoryLog::Fault::kDelayed);
  Append(1);
  EXPECT_FALSE(outcome_);
  EXPECT_TRUE(engine_.groups().empty());
  engine_.Release();
  calls_.Run();
  EXPECT_EQ(outcome_, Appended::kCommitted);
}

TEST_F(MemoryLogTest, ADelayedRequestThatWasGivenUpArrivesYet) {
  log_.SetFault(MemoryLog::Fault::kDelayed);
  Append(1);
  log_.GiveUp();
  calls_.Run();
  EXPECT_EQ(outcome_, Appended::kUnknown);
  outcome_.reset();
  engine_.Release();
  calls_.Run();
  EXPECT_FALSE(outcome_) << "told twice";
  EXPECT_EQ(engine_.groups().size(), 1u);
}

TEST_F(MemoryLogTest, ADelayedRequestOutlivesItsClient) {
  auto client = std::make_unique<MemoryLog>(&engine_, calls_.poster());
  client->SetFault(MemoryLog::Fault::kDelayed);
  client->Append(MakeGroup(term_, 1, 1), [](Appended) { FAIL(); });
  client.reset();
  engine_.Release();
  calls_.Run();
  EXPECT_EQ(engine_.groups().size(), 1u);
}

TEST_F(MemoryLogTest, ADelayedRequestOfADeposedLeaderIsFenced) {
  log_.SetFault(MemoryLog::Fault::kDelayed);
  Append(1);
  MemoryLog other(&engine_, calls_.poster());
  other.TakeLead(term_, "b", [](const Result<Leader>&) {});
  engine_.Release();
  calls_.Run();
  EXPECT_EQ(outcome_, Appended::kFenced);
  EXPECT_TRUE(engine_.groups().empty());
}

TEST_F(MemoryLogTest, ACopyOfARequestArrivesLater) {
  log_.SetFault(MemoryLog::Fault::kDoubled);
  Append(1);
  EXPECT_EQ(outcome_, Appended::kCommitted);
  EXPECT_EQ(engine_.held(), 1u);
  engine_.Release();
  EXPECT_EQ(engine_.groups().size(), 1u);
}

TEST_F(MemoryLogTest, WhoIsCutOffHasNoNewsUntilItIsConnectedAgain) {
  MemoryLog other(&engine_, calls_.poster());
  size_t groups = 0;
  size_t errors = 0;
  other.Follow(1, [&](const Result<Page>& page) {
    groups += page.ok() ? page.value().groups.size() : 0;
    errors += page.ok() ? 0u : 1u;
  });
  calls_.Run();
  other.SetCutOff(true);
  Append(1);
  Append(2);
  EXPECT_EQ(groups, 0u);
  EXPECT_EQ(errors, 1u);
  std::optional<Appended> outcome;
  other.Append(MakeGroup(term_, 3, 1), [&](Appended appended) { outcome = appended; });
  calls_.Run();
  EXPECT_EQ(outcome, Appended::kUnknown);
  EXPECT_EQ(engine_.groups().size(), 2u);
  other.SetCutOff(false);
  calls_.Run();
  EXPECT_EQ(groups, 2u);
}

TEST_F(MemoryLogTest, WhoIsPausedIsCalledWhenItGoesOn) {
  log_.SetPaused(true);
  Append(1);
  EXPECT_FALSE(outcome_);
  EXPECT_EQ(engine_.groups().size(), 1u);
  log_.SetPaused(false);
  calls_.Run();
  EXPECT_EQ(outcome_, Appended::kCommitted);
}

TEST_F(MemoryLogTest, ALogFromABackupEndsBeforeItsFollower) {
  Append(1);
  Append(2);
  Page last;
  log_.Follow(3, [&](const Result<Page>& page) { last = page.value(); });
  calls_.Run();
  EXPECT_EQ(last.next, 3u);
  engine_.Forget(2);
  calls_.Run();
  EXPECT_EQ(last.next, 2u);
}

}  // namespace
}  // namespace pheromone::cluster
