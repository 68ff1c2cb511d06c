// A changed configuration is written to the log before it happens.

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/core/engine/service/service.h"
#include "server/core/engine/testing/bench.h"
#include "server/core/engine/testing/random_tags.h"
#include "server/core/engine/testing/scripted_log.h"

namespace pheromone::engine {
namespace {

using protocol::Reason;

// Records the order of its calls for a configuration, takes the service's lock meanwhile, and may
// stop accepting changes after some events.
class AheadLog final : public testing::ScriptedLog {
 public:
  Status WriteAhead(Event* event) override {
    calls.emplace_back("ahead");
    if (service != nullptr) {
      static_cast<void>(service->counters());
    }
    if (meanwhile) {
      meanwhile();
    }
    if (!failure.empty()) {
      return Error{failure};
    }
    std::get<ConfigChanged>(*event).ahead = std::make_shared<const WrittenAhead>(WrittenAhead{4});
    kept = std::get<ConfigChanged>(*event).ahead;
    return Ok();
  }
  uint64_t Append(const Stamp& stamp, const Event& event) override {
    if (const auto* const changed = std::get_if<ConfigChanged>(&event)) {
      const bool is_ahead = changed->ahead != nullptr && changed->ahead->segment == 4;
      calls.emplace_back(is_ahead ? "append short" : "append whole");
    }
    const uint64_t sequence = ScriptedLog::Append(stamp, event);
    events.clear();  // they would keep the data written ahead alive
    admit = sequence < most_events ? Reason::kNone : Reason::kReadOnly;
    return sequence;
  }

  const Service* service = nullptr;
  std::function<void()> meanwhile;
  std::string failure;
  uint64_t most_events = UINT64_MAX;
  std::vector<std::string> calls;
  std::weak_ptr<const WrittenAhead> kept;
};

class ConfigureTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(service_.Configure(testing::SmallConfig(), 7).ok());
    // The first one is not written ahead.
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
  const auto status = service_.Configure(Other(), 8);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error(), log_.failure);
  EXPECT_EQ(log_.calls, std::vector<std::string>{"ahead"});
  EXPECT_EQ(service_.StateHash(), before);
  log_.failure.clear();
  EXPECT_TRUE(service_.Configure(Other(), 8).ok());
}

// The configuration is in the log and in the state, so it has not failed.
TEST_F(ConfigureTest, ALogThatStopsWhileTheMapFollowsHasTakenItAllTheSame) {
  EngineConfig config = Other();
  std::vector<field::InitialNode> nodes;
  for (int32_t column = 0; column < 100; ++column) {
    for (int32_t row = 0; row < 100; ++row) {
      nodes.push_back({{column, row}, 64});
    }
  }
  config.field.initial_rasters.push_back(
      {config.field.pheromones[0].type, field::Shared(std::move(nodes))});
  log_.most_events = 2;  // the one of SetUp, and this one without its portions
  const auto taken = service_.Configure(config, 8);
  ASSERT_TRUE(taken.ok());
  EXPECT_FALSE(taken.value().all_laid);
  service_.Inspect([&](const Engine& engine) {
    EXPECT_TRUE(engine.is_busy());
    EXPECT_TRUE(engine.config() == config);
  });
  log_.most_events = UINT64_MAX;
  log_.admit = Reason::kNone;
  const auto next = service_.Configure(Other(), 9);
  ASSERT_TRUE(next.ok()) << "waits for the one before";
  EXPECT_TRUE(next.value().all_laid);
  service_.Inspect([&](const Engine& engine) { EXPECT_FALSE(engine.is_busy()); });
}

// Nodes still stored under the earlier law are already answered under the new one.
TEST_F(ConfigureTest, AnotherLawIsNothingToBeLaid) {
  field::FieldEdit all;
  all.type = 1;
  all.level = 64;
  all.shape = field::FieldEdit::Shape::kAll;
  ASSERT_TRUE(service_.Edit(all).ok());
  EngineConfig config = testing::SmallConfig();
  config.field.pheromones[0].tau_ms += 1'000;
  const auto taken = service_.Configure(config, 8);
  ASSERT_TRUE(taken.ok());
  EXPECT_TRUE(taken.value().all_laid);
  service_.Inspect([](const Engine& engine) { EXPECT_TRUE(engine.is_busy()); });
}

// The change is prepared without the lock: a robot or an operator may write on a tag that goes.
TEST_F(ConfigureTest, ATagThatGoesKeepsWhatIsWrittenOnItMeanwhile) {
  EngineConfig config = testing::SmallConfig();
  config.tags = testing::RichTags();
  ASSERT_TRUE(service_.Configure(config, 7).ok());
  std::vector<Outgoing> out;
  const TagsChanged define{TagsChanged::Define{{tags::RowKind::kRobot, 1, 1, "one"}}};
  ASSERT_TRUE(service_.Submit(define, &out).ok());
  log_.meanwhile = [&] {
    const TagsChanged write{
        TagsChanged::Write{.tag = 2, .block = {1, 1, {-17, 1}, {1, 2}, {-3, 1}}}};
    EXPECT_TRUE(service_.Submit(write, &out).ok());
  };
  ASSERT_TRUE(service_.Configure(testing::SmallConfig(), 7).ok());
  service_.Inspect([](const Engine& engine) {
    const tags::Store& store = engine.tags();
    EXPECT_EQ(store.NumberOf("a"), std::nullopt);
    EXPECT_EQ(store.NumberOf("b"), 2);
    EXPECT_EQ(store.figures().blocks, 1u);
    EXPECT_EQ(store.figures().configured, 0u);
  });
}

TEST_F(ConfigureTest, TheSameConfigurationIsNotWritten) {
  EXPECT_TRUE(service_.Configure(testing::SmallConfig(), 8).ok());
  EXPECT_TRUE(log_.calls.empty());
}

}  // namespace
}  // namespace pheromone::engine
