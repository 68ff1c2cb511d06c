// Exactly once, proved for one robot and small counters over the real client and the real engine.

#include <gtest/gtest.h>

#include <string>

#include "client_fw/verify/conversation_world.h"
#include "client_fw/verify/explore.h"
#include "client_fw/verify/testing/proofs.h"

namespace pheromone::verify {
namespace {

TEST(Explore, FindsTheShortestWayToWhatIsWrong) {
  const Model<int> model{.key = [](const int& n) { return std::to_string(n); },
                         .next =
                             [](const int& n, const Model<int>::Visit& visit) {
                               visit("+1", n + 1);
                               visit("*2", n * 2);
                             },
                         .wrong = [](const int& n) { return n == 10 ? "ten" : ""; },
                         .max_states = 1'000};
  const Explored found = Explore(1, model);
  EXPECT_EQ(found.verdict, Verdict::kRefuted);
  EXPECT_EQ(found.trace, (std::vector<std::string>{"+1", "*2", "+1", "*2"}));
}

TEST(Explore, ProvesWhatHoldsInAllStatesAndGivesUpBeyondTheLimit) {
  Model<int> model{
      .key = [](const int& n) { return std::to_string(n); },
      .next = [](const int& n, const Model<int>::Visit& visit) { visit("+1", (n + 1) % 100); },
      .wrong = [](const int& n) { return n >= 100 ? "too many" : ""; },
      .max_states = 1'000};
  const Explored found = Explore(0, model);
  EXPECT_EQ(found.verdict, Verdict::kProved);
  EXPECT_EQ(found.states, 100u);
  EXPECT_EQ(found.transitions, 100u);
  model.max_states = 50;
  EXPECT_EQ(Explore(0, model).verdict, Verdict::kUnknown);
}

TEST(Explore, ProvesThatEachStateThatMustCanFinish) {
  Model<int> model{.key = [](const int& n) { return std::to_string(n); },
                   .next =
                       [](const int& n, const Model<int>::Visit& visit) {
                         visit("to the next", n % 10 == 9 ? n - 9 : n + 1);  // rings of ten
                         if (n == 3) {
                           visit("to the second ring", 10);
                         }
                       },
                   .wrong = [](const int&) { return ""; },
                   .finished = [](const int& n) { return n == 7; },
                   .must_finish = [](const int& n) { return n != 10; }};
  const Explored found = Explore(0, model);
  EXPECT_EQ(found.wrong, "cannot finish");
  EXPECT_EQ(found.trace.size(), 5u);  // to 11
  model.must_finish = [](const int& n) { return n < 10; };
  EXPECT_EQ(Explore(0, model).verdict, Verdict::kProved);
}

// Proved is that no change is made twice, that none that was acknowledged is missing, and that the
// robot can always go on: whatever has happened, one more silence and HELLO suffice.
void ExpectProved(const ConversationLimits& limits) {
  ExpectProof(ExploreConversation(limits));
}

void ExpectRefuted(const ConversationLimits& limits, const std::string& wrong) {
  ExpectRefutation(ExploreConversation(limits), wrong);
}

// Frames may be lost, overtake each other, and arrive again later.
TEST(Network, ThroughACrashOfTheServer) {
  ExpectProved({.changes = 3, .crashes = 1, .silences = 1});
}

TEST(Network, ThroughPowerLossAndACrash) {
  ExpectProved({.changes = 2, .power_losses = 1, .crashes = 1});
  ExpectProved({.changes = 1, .power_losses = 1, .crashes = 1, .silences = 1});
}

TEST(Network, ThroughPowerLossTwice) {
  ExpectProved({.changes = 1, .power_losses = 2});
}

TEST(Network, ThroughAWarmReset) {
  ExpectProved({.changes = 2, .warm_resets = 1, .silences = 1});
}

TEST(Network, ThroughAWarmResetAndPowerLoss) {
  ExpectProved({.changes = 1, .warm_resets = 1, .power_losses = 1});
}

TEST(Network, WhileAnotherRobotSaysHello) {
  ExpectProved({.changes = 2, .crashes = 1, .silences = 1, .other_robots = 1});
}

// A radio channel holds one frame at a time in each direction.
TEST(Radio, ThroughEverything) {
  ExpectProved({.changes = 2,
                .warm_resets = 1,
                .power_losses = 2,
                .crashes = 1,
                .silences = 2,
                .in_flight = 1});
}

// The faults that the server's rules are for come back without them.
TEST(Mutant, ServerThatForgetsARobot) {
  ExpectRefuted(
      {.changes = 2, .in_flight = 1, .other_robots = 1, .server = ServerMutant::kForgetsRobot},
      "change 0 was made 2 times");
}

TEST(Mutant, ServerThatForgetsTheLastRequestAtHello) {
  ExpectRefuted({.changes = 1, .power_losses = 1, .server = ServerMutant::kForgetsRequest},
                "change 0 was made 2 times");
}

TEST(Mutant, RobotThatTakesItsNumberFromALateHelloAnswer) {
  ExpectRefuted({.changes = 2, .warm_resets = 1, .takes_numbers_back = true},
                "change 1 was acknowledged and is gone");
}

// Answers in ROUNDs, at the places of the turns before, with another robot in the same rounds.
TEST(InRounds, ThroughLosses) {
  ExpectProved({.changes = 2, .silences = 1, .in_flight = 1, .rounds = 5});
}

TEST(InRounds, ThroughACrashOfTheServer) {
  ExpectProved({.changes = 2, .crashes = 1, .silences = 1, .in_flight = 1, .rounds = 3});
}

TEST(InRounds, ThroughAWarmResetAndPowerLoss) {
  ExpectProved({.changes = 2, .warm_resets = 1, .power_losses = 1, .in_flight = 1, .rounds = 4});
}

TEST(InRoundsMutant, ServerThatAnswersInTheNewOrder) {
  ExpectRefuted(
      {.changes = 2, .in_flight = 1, .rounds = 4, .server = ServerMutant::kAnswersInNewOrder},
      "change 0 was acknowledged and is gone");
}

TEST(InRoundsMutant, ServerThatAnswersWhatIsNotDurable) {
  ExpectRefuted({.changes = 1,
                 .crashes = 1,
                 .in_flight = 1,
                 .rounds = 4,
                 .server = ServerMutant::kAnswersUnsynced},
                "change 0 was acknowledged and is gone");
}

TEST(InRoundsMutant, ServerThatSaysAnAnswerAgainToTheNextChange) {
  ExpectRefuted(
      {.changes = 2, .in_flight = 1, .rounds = 4, .server = ServerMutant::kSaysAgainToTheNext},
      "change 1 was acknowledged and is gone");
}

// Whoever still awaits a ROUND takes the answer to another robot for its own.
TEST(InRoundsMutant, ServerWhoseNumbersAreStillAwaited) {
  ExpectRefuted({.changes = 1,
                 .crashes = 1,
                 .in_flight = 1,
                 .rounds = 4,
                 .server = ServerMutant::kNumbersAgain},
                "change 0 was acknowledged and is gone");
}

// Log: the changes that arrive meanwhile are refused as busy or read-only.
TEST(Network, WhileTheLogAcceptsNothing) {
  ExpectProved({.changes = 2, .turned_away = 1});
}

// The same for WRITEs of a tag. Proved is, beyond the above, that the robot is told what became of
// each: answered, it was executed once, is durable, and has these generations; refused, it is not
// executed, then or later; and that as long as power lasts none is left open.
TEST(TagNetwork, ThroughACrashOfTheServer) {
  ExpectProved({.kind = ChangeKind::kWrite, .changes = 2, .crashes = 1, .silences = 1});
}

TEST(TagNetwork, ThroughPowerLossAndACrash) {
  ExpectProved({.kind = ChangeKind::kWrite, .changes = 1, .power_losses = 1, .crashes = 1});
}

TEST(TagNetwork, ThroughAWarmReset) {
  ExpectProved({.kind = ChangeKind::kConditionalWrite, .changes = 2, .warm_resets = 1});
}

TEST(TagNetwork, WhileTheLogAcceptsNothing) {
  ExpectProved({.kind = ChangeKind::kWrite, .changes = 2, .turned_away = 1});
  ExpectProved({.kind = ChangeKind::kConditionalWrite, .changes = 2, .turned_away = 1});
}

TEST(TagRadio, ThroughEverything) {
  for (const ChangeKind kind : {ChangeKind::kWrite, ChangeKind::kConditionalWrite}) {
    ExpectProved({.kind = kind,
                  .changes = 2,
                  .warm_resets = 1,
                  .power_losses = 1,
                  .crashes = 1,
                  .silences = 1,
                  .in_flight = 1});
  }
}

TEST(TagMutant, ServerThatForgetsARobot) {
  ConversationLimits limits{.kind = ChangeKind::kWrite,
                            .changes = 2,
                            .in_flight = 1,
                            .other_robots = 1,
                            .server = ServerMutant::kForgetsRobot};
  ExpectRefuted(limits, "change 0 was made 2 times");
  limits.kind = ChangeKind::kConditionalWrite;
  ExpectRefuted(limits, "change 0 was refused and is made");  // its generation has changed
}

TEST(TagMutant, ServerThatForgetsTheLastRequestAtHello) {
  ConversationLimits limits{.kind = ChangeKind::kWrite,
                            .changes = 1,
                            .power_losses = 1,
                            .server = ServerMutant::kForgetsRequest};
  ExpectRefuted(limits, "change 0 was made 2 times");
  limits.kind = ChangeKind::kConditionalWrite;
  ExpectRefuted(limits, "change 0 was refused and is made");
}

TEST(TagMutant, RobotThatTakesItsNumberFromALateHelloAnswer) {
  ExpectRefuted(
      {.kind = ChangeKind::kWrite, .changes = 2, .warm_resets = 1, .takes_numbers_back = true},
      "change 0 was given up");
}

TEST(TagMutant, RobotThatRepeatsAWriteWithItsPresentPose) {
  ExpectRefuted({.kind = ChangeKind::kWrite, .changes = 1, .repeats_with_pose = true},
                "change 0 was given up");
}

}  // namespace
}  // namespace pheromone::verify
