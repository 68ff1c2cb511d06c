// Exactly once, proved for one robot and small counters over the real client and the real engine.

#include <gtest/gtest.h>

#include <iostream>
#include <string>

#include "server/verify/conversation_world.h"
#include "server/verify/explore.h"

namespace pheromone::verify {
namespace {

Explored Told(const Explored& found) {
  std::cout << found.states << " states, " << found.transitions << " transitions\n";
  for (const std::string& step : found.trace) {
    std::cout << "  " << step << '\n';
  }
  return found;
}

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

// Frames may be lost, overtake each other, and arrive again later.
TEST(Conversation, EachChangeIsMadeExactlyOnceOverANetworkAndThroughACrash) {
  const Explored found = Told(ExploreConversation({.changes = 2, .crashes = 1, .hellos = 3}));
  EXPECT_EQ(found.wrong, "");
  EXPECT_EQ(found.verdict, Verdict::kProved);
}

// A radio channel holds one frame at a time in each direction. After power loss a change is made at
// most once.
TEST(Conversation, OverARadioAlsoThroughResetsAndPowerLoss) {
  const Explored found = Told(ExploreConversation({.changes = 2,
                                                   .warm_resets = 1,
                                                   .power_losses = 1,
                                                   .crashes = 1,
                                                   .hellos = 4,
                                                   .in_flight = 1}));
  EXPECT_EQ(found.wrong, "");
  EXPECT_EQ(found.verdict, Verdict::kProved);
}

// A known fault, for which robots_per_link must be below the number of robots: the server forgets a
// robot whose first change it has made, and whose answer was lost.
TEST(Conversation, AChangeIsMadeTwiceIfTheServerForgetsTheRobot) {
  const Explored found =
      ExploreConversation({.changes = 2, .hellos = 3, .in_flight = 1, .other_robots = 1});
  EXPECT_EQ(found.verdict, Verdict::kRefuted);
  EXPECT_EQ(found.wrong, "change 0 was made 2 times");
}

// A second known fault, of a network that repeats what it delivered before the robot booted.
TEST(Conversation, AnOldFrameThatArrivesAfterPowerLossIsTakenForANewOne) {
  const Explored found = Told(ExploreConversation({.changes = 1, .power_losses = 1, .hellos = 2}));
  EXPECT_EQ(found.verdict, Verdict::kRefuted);
  EXPECT_EQ(found.wrong, "change 0 was made 2 times");
}

}  // namespace
}  // namespace pheromone::verify
