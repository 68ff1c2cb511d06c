// A changed configuration is written to the log before it happens.

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/engine/service.h"
#include "server/engine/testing/bench.h"

namespace pheromone::engine {
namespace {

using protocol::Reason;

// Notes what was asked of it; `lock_is_free` tells whether the service's lock could be had
// meanwhile.
class AheadLog final : public OrderedLog {
 public:
  Reason Admit() override { return sequence_ < most_events ? Reason::kNone : Reason::kReadOnly; }
  Status WriteAhead(Event* event) override {
    calls.emplace_back("ahead");
    if (service != nullptr) {
      static_cast<void>(service->counters());  // takes the lock
    }
    if (!failure.empty()) {
      return Error{failure};
    }
    std::get<ConfigChanged>(*event).ahead = std::make_shared<const WrittenAhead>(WrittenAhead{4});
    kept = std::get<ConfigChanged>(*event).ahead;
    return Ok();
  }
  uint64_t Append(const Stamp& /*stamp*/, const Event& event) override {
    const auto* const changed = std::get_if<ConfigChanged>(&event);
    if (changed != nullptr) {
      calls.emplace_back(changed->ahead != nullptr && changed->ahead->segment == 4
                             ? "append short"
                             : "append whole");
    }
    return ++sequence_;
  }
  uint64_t DurableSequence() const override { return UINT64_MAX; }
  bool WhenDurable(uint64_t /*sequence*/, std::function<void()> done) override {
    done();
    return true;
  }
  void Probe(std::function<void()> done) override { done(); }

  const Service* service = nullptr;
  std::string failure;
  uint64_t most_events = UINT64_MAX;  // then it takes no changes
  std::vector<std::string> calls;
  std::weak_ptr<const WrittenAhead> kept;

 private:
  uint64_t sequence_ = 0;
};

class ConfigureTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(service_.Configure(testing::SmallConfig(), 7).ok());
    // Nobody waits for the first one.
    EXPECT_EQ(std::exchange(log_.calls, {}), std::vector<std::string>{"append whole"});
    log_.service = &service_;
  }
  static EngineConfig Other() {
    EngineConfig config = testing::SmallConfig();
    config.pose_unit_10um = 50;
    return config;
  }

  AheadLog log_;
  Service service_{&log_, [] { return ClockReading{1'000, 0}; }};
};

TEST_F(ConfigureTest, ItIsWrittenAheadWithoutTheLockAndLetGoOf) {
  EXPECT_TRUE(service_.Configure(Other(), 8).ok());
  EXPECT_EQ(log_.calls, (std::vector<std::string>{"ahead", "append short"}));
  EXPECT_TRUE(log_.kept.expired()) << "else the log could begin no other segment";
}

TEST_F(ConfigureTest, ALogThatCannotWriteItChangesNothing) {
  log_.failure = "changes are refused: no space left";
  const uint64_t before = service_.StateHash();
  const Status status = service_.Configure(Other(), 8);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error(), log_.failure);
  EXPECT_EQ(log_.calls, std::vector<std::string>{"ahead"});
  EXPECT_EQ(service_.StateHash(), before);
  log_.failure.clear();
  EXPECT_TRUE(service_.Configure(Other(), 8).ok());
}

// The configuration is in the log and in the state; to say that it failed would be false.
TEST_F(ConfigureTest, ALogThatStopsWhileTheMapFollowsHasTakenItAllTheSame) {
  EngineConfig config = Other();
  std::vector<field::PrintNode> nodes;
  for (int32_t column = 0; column < 100; ++column) {
    for (int32_t row = 0; row < 100; ++row) {
      nodes.push_back({{column, row}, 64});
    }
  }
  config.field.prints.push_back({config.field.pheromones[0].type, field::Shared(std::move(nodes))});
  log_.most_events = 2;  // the one of SetUp, and this one without its portions
  EXPECT_TRUE(service_.Configure(config, 8).ok());
  service_.Inspect([&](const Engine& engine) {
    EXPECT_TRUE(engine.is_busy());
    EXPECT_TRUE(engine.config() == config);
  });
  log_.most_events = UINT64_MAX;
  EXPECT_TRUE(service_.Configure(Other(), 9).ok()) << "waits for the one before";
  service_.Inspect([&](const Engine& engine) { EXPECT_FALSE(engine.is_busy()); });
}

TEST_F(ConfigureTest, TheSameConfigurationIsNotWritten) {
  EXPECT_TRUE(service_.Configure(testing::SmallConfig(), 8).ok());
  EXPECT_TRUE(log_.calls.empty());
}

}  // namespace
}  // namespace pheromone::engine
