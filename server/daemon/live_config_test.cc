#include "server/daemon/live_config.h"

#include <gtest/gtest.h>

#include <cstdint>

#include "server/core/engine/testing/bench.h"
#include "server/core/engine/testing/scripted_log.h"
#include "server/daemon/captures.h"

namespace pheromone::daemon {
namespace {

config::Config ConfigOf(const engine::EngineConfig& engine) {
  config::Config config;
  config.engine = engine;
  return config;
}

class LiveConfigTest : public ::testing::Test {
 protected:
  LiveConfigTest() { EXPECT_TRUE(config_.TakeAtStart(false).ok()); }

  int64_t TauOfFirst() const { return config_.Get().engine.field.pheromones[0].tau_ms; }

  config::Config read_ = ConfigOf(engine::testing::SmallConfig());
  engine::testing::ScriptedLog log_;
  engine::Service service_{&log_, [] { return engine::ClockReading{1'000, 1'700'000'000'000}; }};
  Captures captures_{&service_, read_};
  LiveConfig config_{read_, [this] { return Result<config::Config>(read_); }, &service_,
                     &captures_};
};

TEST_F(LiveConfigTest, TheConfigurationThatAnotherServerOrderedIsTheOneInEffect) {
  engine::EngineConfig other = read_.engine;
  other.field.pheromones[0].tau_ms = 12'000;
  ASSERT_TRUE(service_.Configure(other, 7).ok());
  EXPECT_EQ(TauOfFirst(), 12'000);
  ASSERT_TRUE(config_.ChangeTau(2, 5'000).ok());
  EXPECT_EQ(TauOfFirst(), 12'000) << "the change of one law leaves what is in effect else";
}

TEST_F(LiveConfigTest, AChangedLawIsInEffectUntilTheConfigurationIsReadAgain) {
  ASSERT_TRUE(config_.ChangeTau(1, 5'000).ok());
  EXPECT_EQ(TauOfFirst(), 5'000);
  EXPECT_EQ(config_.AsRead(), engine::SharedConfig(read_.engine));
  ASSERT_TRUE(config_.ReadAgain().ok());
  EXPECT_EQ(TauOfFirst(), read_.engine.field.pheromones[0].tau_ms);
}

}  // namespace
}  // namespace pheromone::daemon
