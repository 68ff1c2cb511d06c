#include "server/daemon/live_config.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "server/core/engine/testing/bench.h"
#include "server/core/engine/testing/scripted_log.h"
#include "server/daemon/captures.h"
#include "server/daemon/describe.h"

namespace pheromone::daemon {
namespace {

config::Config ConfigOf(const engine::EngineConfig& engine) {
  config::Config config;
  config.engine = engine;
  config.web.tls = Certificate{"a chain", "a key"};
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
  std::string error_;  // when it is read again
  LiveConfig config_{
      read_, [this] { return error_.empty() ? Result<config::Config>(read_) : Error{error_}; },
      &service_, &captures_};
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

TEST_F(LiveConfigTest, ALimitThatTakesARestartIsNotCalledAChangedLink) {
  using Notes = std::vector<std::string>;
  read_.links.resize(2);
  LiveConfig config{read_, [this] { return Result<config::Config>(read_); }, &service_, &captures_};
  for (links::LinkConfig& link : read_.links) {
    link.admission.per_client_per_s = 20;
  }
  const std::string limits =
      "changed requests_per_client_s or requests_per_link_s of [limits] require a restart";
  EXPECT_EQ(config.ReadAgain().value(), Notes{limits});
  read_.links[0].admission.clients.reset(7);
  EXPECT_EQ(config.ReadAgain().value(), (Notes{"changed links require a restart", limits}));
}

TEST_F(LiveConfigTest, OtherKeysAreTakenUnlessTheFileIsWrong) {
  read_.keys = {{"radio-a", {{7, {1}}}}};
  ASSERT_TRUE(config_.ReadAgain().ok());
  EXPECT_EQ(config_.Keys(), read_.keys);
  const auto before = read_.keys;
  read_.keys.clear();
  error_ = "robots.keys:2: robot 7 has no key";
  EXPECT_FALSE(config_.ReadAgain().ok());
  EXPECT_EQ(config_.Keys(), before);
}

TEST_F(LiveConfigTest, OnlySecretsAreTakenWhereAnotherServerHasTheRest) {
  read_.web.tls = Certificate{"another chain", "another key"};
  read_.engine.field.pheromones[0].tau_ms += 1'000;
  read_.web.max_viewers += 1;
  read_.keys = {{"radio-a", {{7, {1}}}}};
  const int64_t tau_ms = TauOfFirst();
  const config::WebSettings before = config_.Web();
  ASSERT_TRUE(config_.ReadSecretsAgain().ok());
  EXPECT_EQ(config_.Web().tls, read_.web.tls);
  EXPECT_EQ(config_.Keys(), read_.keys);
  EXPECT_EQ(config_.Web().max_viewers, before.max_viewers);
  EXPECT_EQ(TauOfFirst(), tau_ms);
}

TEST_F(LiveConfigTest, AServerWithoutACertificateReadsItsFileAllTheSameAndTakesNone) {
  config::Config plain = read_;
  plain.web.tls.reset();
  Result<config::Config> file = Error{"a mistake in line 3"};
  LiveConfig without(
      plain, [&] { return file; }, &service_, &captures_);
  EXPECT_EQ(without.ReadSecretsAgain().error(), "a mistake in line 3");
  file = read_;
  EXPECT_TRUE(without.ReadSecretsAgain().ok());
  EXPECT_EQ(without.Web().tls, std::nullopt) << "that takes a restart";
}

TEST_F(LiveConfigTest, ACertificateThatIsNotReadChangesNothing) {
  const auto before = config_.Web().tls;
  error_ = "lab.key: found no private key";
  EXPECT_EQ(config_.ReadSecretsAgain().error(), error_);
  EXPECT_EQ(config_.Web().tls, before);
}

TEST(DescribeKeysTest, RobotsWhoseKeysDifferAreNamed) {
  EXPECT_EQ(DescribeKeys({{1, {1}}, {2, {2}}, {3, {3}}}, {{2, {9}}, {3, {3}}, {7, {7}}, {8, {8}}}),
            "revoked 1, changed 2, added 7 8");
  EXPECT_EQ(DescribeKeys({}, {{7, {7}}}), "added 7");
}

}  // namespace
}  // namespace pheromone::daemon
