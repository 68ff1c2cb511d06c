// Nobody without the key: proved for one robot and small counters over both real ends.

#include <gtest/gtest.h>

#include <cstddef>
#include <string>

#include "client_fw/verify/explore.h"
#include "client_fw/verify/signing_world.h"

namespace pheromone::verify {
namespace {

Explored Check(const SigningLimits& limits, size_t max_states = 400'000) {
  return Explore(SigningWorld(limits),
                 Model<SigningWorld>{
                     .key = [](const SigningWorld& world) { return world.Key(); },
                     .next = [](const SigningWorld& world,
                                const Model<SigningWorld>::Visit& visit) { world.Next(visit); },
                     .wrong = [](const SigningWorld& world) { return world.Wrong(); },
                     .max_states = max_states});
}

std::string TraceOf(const Explored& found) {
  std::string text = found.wrong;
  for (const std::string& step : found.trace) {
    text += "\n  " + step;
  }
  return text;
}

void ExpectProved(const SigningLimits& limits) {
  const Explored found = Check(limits);
  EXPECT_EQ(found.verdict, Verdict::kProved) << found.states << " states\n" << TraceOf(found);
  EXPECT_GT(found.states, 50u);
  testing::Test::RecordProperty("states", static_cast<int>(found.states));
}

void ExpectRefuted(const SigningLimits& limits) {
  const Explored found = Check(limits);
  EXPECT_EQ(found.verdict, Verdict::kRefuted) << found.states << " states";
}

TEST(Attacker, HearsRepeatsReordersAndChanges) {
  ExpectProved({.greetings = 1, .requests = 3, .commands = 2, .to_all = 1});
}

TEST(Attacker, RepeatsWhatIsOfAnEarlierSession) {
  ExpectProved({.greetings = 2, .requests = 2, .commands = 2, .to_all = 1});
}

TEST(Attacker, WhileTheRobotLosesPower) {
  ExpectProved({.greetings = 2, .requests = 2, .commands = 1, .to_all = 1, .power_losses = 1});
}

TEST(Attacker, WhileTheRobotIsReset) {
  ExpectProved({.greetings = 2, .requests = 2, .commands = 1, .to_all = 1, .warm_resets = 1});
}

TEST(Attacker, WhileTheServerIsRestarted) {
  ExpectProved({.greetings = 2, .requests = 2, .commands = 1, .to_all = 1, .restarts = 1});
}

TEST(Attacker, WhoHasTheGroupsKey) {
  ExpectProved({.greetings = 2, .requests = 2, .commands = 2, .insider = true});
}

TEST(SigningMutant, AServerThatForgetsCounters) {
  ExpectRefuted({.mutant = SigningMutant::kServerForgetsCounters});
}

TEST(SigningMutant, ARobotThatForgetsCounters) {
  ExpectRefuted({.mutant = SigningMutant::kRobotForgetsCounters});
}

TEST(SigningMutant, AServerWithOneNonce) {
  ExpectRefuted({.greetings = 1,
                 .requests = 1,
                 .commands = 0,
                 .to_all = 0,
                 .restarts = 1,
                 .mutant = SigningMutant::kNonceAgain});
}

TEST(SigningMutant, AServerThatKeepsASessionOverARestart) {
  ExpectRefuted({.greetings = 1,
                 .requests = 1,
                 .commands = 0,
                 .to_all = 0,
                 .restarts = 1,
                 .mutant = SigningMutant::kSessionAfterRestart});
}

TEST(SigningMutant, ARobotThatUsesANumberAgain) {
  ExpectRefuted({.greetings = 2,
                 .requests = 0,
                 .commands = 1,
                 .to_all = 0,
                 .warm_resets = 1,
                 .mutant = SigningMutant::kNumberAgain});
}

TEST(SigningMutant, AServerThatTakesUnsignedFrames) {
  ExpectRefuted({.mutant = SigningMutant::kTakesUnsigned});
}

TEST(SigningMutant, ARobotThatTakesTheGroupsKeyForACommand) {
  ExpectRefuted({.insider = true, .mutant = SigningMutant::kGroupKeyToOne});
}

TEST(SigningMutant, AServerThatTakesTheGroupsKeyForARequest) {
  ExpectRefuted({.insider = true, .mutant = SigningMutant::kGroupKeyOfOne});
}

}  // namespace
}  // namespace pheromone::verify
