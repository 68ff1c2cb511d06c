#include "server/cluster/election.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

namespace pheromone::cluster {
namespace {

// Heartbeats of 50 ms, suspicion after 300, as by default; and no longer before the first one.
Election ElectionOf(const std::string& node,
                    const std::vector<std::string>& nodes = {"a", "b", "c"}) {
  return Election({.node = node, .nodes = nodes, .meet_ms = 300}, 0);
}

Heartbeat Following(Term term) {
  return {.term = term};
}

Heartbeat Leading(Term term) {
  return {.term = term, .leads = true};
}

// What Ask says at that time to one who has asked often before.
std::optional<Term> AskAt(Election* election, uint64_t at_ms) {
  for (uint64_t now_ms = at_ms < 600 ? 0 : at_ms - 600; now_ms < at_ms; now_ms += 50) {
    EXPECT_EQ(election->Ask(now_ms), std::nullopt) << now_ms;
  }
  return election->Ask(at_ms);
}

std::optional<Heartbeat> BeatAt(Election* election, uint64_t now_ms, bool is_drained = true) {
  return election->NextHeartbeat(is_drained, kNever, 8, now_ms);
}

// A daemon that was granted term 6 and has caught up, at 300.
Election LeaderOf6(const std::string& node) {
  Election election = ElectionOf(node);
  election.OnLeader({5, "c"}, 0);
  EXPECT_EQ(AskAt(&election, 300), 5u);
  election.OnLead(Leader{6, node}, 300);
  EXPECT_EQ(election.role(), Role::kCatchesUp);
  election.OnCaughtUp();
  EXPECT_TRUE(election.admits());
  return election;
}

TEST(Election, DoesNotAskBeforeItKnowsWhatTheLogSays) {
  Election election = ElectionOf("a");
  EXPECT_EQ(AskAt(&election, 10'000), std::nullopt);
  election.OnLeader({}, 10'000);
  EXPECT_EQ(AskAt(&election, 10'299), std::nullopt);
  EXPECT_EQ(AskAt(&election, 10'300), 0u);  // the first leader follows on term 0
  EXPECT_EQ(election.role(), Role::kTakes);
}

TEST(Election, ALeaderThatWasNotHeardYetHasMoreTime) {
  Election election({.node = "a", .nodes = {"a", "b"}, .meet_ms = 1'500}, 0);
  election.OnLeader({5, "b"}, 1'000);
  EXPECT_EQ(AskAt(&election, 2'499), std::nullopt) << "there may be no connection yet";
  election.OnHeartbeat("b", Leading(5), 2'499);
  EXPECT_EQ(AskAt(&election, 2'798), std::nullopt);
  EXPECT_EQ(AskAt(&election, 2'799), 5u) << "it was heard, and is silent";
}

TEST(Election, SuspectsALeaderThatIsSilentWhileTheLogStands) {
  Election election = ElectionOf("a");
  election.OnLeader({5, "c"}, 1000);
  election.OnHeartbeat("c", Leading(5), 1100);
  EXPECT_EQ(AskAt(&election, 1399), std::nullopt);
  EXPECT_EQ(AskAt(&election, 1400), 5u);
}

TEST(Election, DoesNotSuspectWhileTheLogGrows) {
  Election election = ElectionOf("a");
  election.OnLeader({5, "c"}, 1000);
  election.OnProgress(1250);
  EXPECT_EQ(AskAt(&election, 1549), std::nullopt);
  EXPECT_EQ(AskAt(&election, 1550), 5u);
}

TEST(Election, ANewLeaderRestartsTheTimer) {
  Election election = ElectionOf("a");
  election.OnLeader({5, "c"}, 1000);
  election.OnLeader({6, "b"}, 1290);
  EXPECT_EQ(election.leader(), (Leader{6, "b"}));
  EXPECT_EQ(AskAt(&election, 1589), std::nullopt);
  EXPECT_EQ(AskAt(&election, 1590), 6u);
}

TEST(Election, HeartbeatsOfFormerLeadersAndFollowersAreNoSign) {
  Election election = ElectionOf("a");
  election.OnLeader({5, "c"}, 1000);
  election.OnHeartbeat("c", Leading(4), 1200);
  election.OnHeartbeat("b", Following(5), 1200);
  election.OnHeartbeat("stranger", Leading(9), 1200);
  EXPECT_EQ(AskAt(&election, 1300), 5u);
}

TEST(Election, AHeartbeatOfALeaderThatTheLogHasNotToldYetIsASign) {
  Election election = ElectionOf("a");
  election.OnLeader({5, "c"}, 1000);
  election.OnHeartbeat("b", Leading(6), 1200);
  EXPECT_EQ(election.leader(), (Leader{5, "c"}));  // only the log says who leads
  EXPECT_EQ(AskAt(&election, 1499), std::nullopt);
  EXPECT_EQ(AskAt(&election, 1500), 5u);
}

TEST(Election, WhoComesLaterWaitsForEachHealthyPeerBefore) {
  Election election = ElectionOf("c");
  election.OnLeader({5, "a"}, 1000);
  election.OnHeartbeat("a", Leading(5), 1000);
  EXPECT_EQ(election.Deadline(), 0u);  // a heartbeat is due
  BeatAt(&election, 1000);
  election.OnHeartbeat("b", Following(5), 1200);
  EXPECT_EQ(AskAt(&election, 1349),
            std::nullopt);  // b before it; a, which is suspected, does not count
  EXPECT_EQ(AskAt(&election, 1350), 5u);
}

TEST(Election, DoesNotWaitForPeersThatAreGoneOrCannotLead) {
  Election election = ElectionOf("c");
  election.OnLeader({5, "a"}, 1000);
  election.OnHeartbeat("b", Following(5), 1100);
  election.OnHeartbeat("a", Leading(5), 2000);  // b was not heard for long
  EXPECT_EQ(AskAt(&election, 2300), 5u);

  election = ElectionOf("c");
  election.OnLeader({5, "a"}, 1000);
  election.OnHeartbeat("b", {.term = 5, .is_healthy = false}, 1200);
  EXPECT_EQ(AskAt(&election, 1300), 5u);
}

TEST(Election, ALoneNodeLeadsAtOnceAndTellsNobody) {
  Election election = ElectionOf("a", {"a"});
  election.OnLeader({3, "b"}, 1000);
  EXPECT_EQ(AskAt(&election, 1000), 3u);
  election.OnLead(Leader{4, "a"}, 1002);
  election.OnCaughtUp();
  EXPECT_TRUE(election.admits());
  EXPECT_EQ(BeatAt(&election, 5000), std::nullopt);
  EXPECT_EQ(election.Deadline(), kNever);
  election.StepDown("");
  EXPECT_TRUE(election.admits());
}

TEST(Election, AsksAgainForTheSameTermWithoutAnAnswer) {
  Election election = ElectionOf("a");
  election.OnLeader({5, "c"}, 0);
  ASSERT_EQ(AskAt(&election, 300), 5u);
  EXPECT_EQ(AskAt(&election, 900), std::nullopt);  // one at a time
  election.OnLead(Error{"no answer"}, 900);
  EXPECT_EQ(election.role(), Role::kFollows);
  EXPECT_EQ(AskAt(&election, 949), std::nullopt);
  EXPECT_EQ(AskAt(&election, 950), 5u);
}

TEST(Election, LeadsIfTheLogShowsThatAnUnansweredAskingWasGranted) {
  Election election = ElectionOf("a");
  election.OnLeader({5, "c"}, 0);
  ASSERT_EQ(AskAt(&election, 300), 5u);
  election.OnLead(Error{"no answer"}, 320);
  election.OnHeartbeat("c", Leading(5), 330);
  election.OnLeader({6, "a"}, 340);
  EXPECT_EQ(election.role(), Role::kCatchesUp);
}

TEST(Election, LeadsIfTheLogShowsItBeforeTheAnswerComes) {
  Election election = ElectionOf("a");
  election.OnLeader({5, "c"}, 0);
  ASSERT_EQ(AskAt(&election, 300), 5u);
  election.OnLeader({6, "a"}, 302);
  EXPECT_EQ(election.role(), Role::kCatchesUp);
  election.OnCaughtUp();
  election.OnLead(Leader{6, "a"}, 303);
  EXPECT_EQ(election.role(), Role::kLeads);
}

TEST(Election, FollowsIfAnotherOneWasFaster) {
  Election election = ElectionOf("a");
  election.OnLeader({5, "c"}, 0);
  ASSERT_EQ(AskAt(&election, 300), 5u);
  election.OnLead(Leader{6, "b"}, 302);
  EXPECT_EQ(election.role(), Role::kFollows);
  EXPECT_EQ(election.leader(), (Leader{6, "b"}));
  EXPECT_EQ(AskAt(&election, 601), std::nullopt);
  EXPECT_EQ(AskAt(&election, 602), 6u);
}

// An answer that was under way while pages told more.
TEST(Election, ALateAnswerChangesNothing) {
  Election election = ElectionOf("a");
  election.OnLeader({5, "c"}, 0);
  ASSERT_EQ(AskAt(&election, 300), 5u);
  election.OnLeader({8, "b"}, 310);
  election.OnLead(Leader{6, "a"}, 320);
  EXPECT_EQ(election.role(), Role::kFollows);
  EXPECT_EQ(election.leader(), (Leader{8, "b"}));
}

// Groups of the process before may be on their way into the log.
TEST(Election, TheTermOfAnEarlierProcessIsNotItsOwnAndIsTakenAgainAtOnce) {
  Election election = ElectionOf("b");
  election.OnHeartbeat("a", Following(5), 0);
  election.OnLeader({5, "b"}, 10);
  EXPECT_EQ(election.role(), Role::kFollows);
  EXPECT_EQ(AskAt(&election, 10), 5u);
  election.OnLead(Leader{6, "b"}, 12);
  EXPECT_EQ(election.role(), Role::kCatchesUp);
}

TEST(Election, AnAskingThatFailedGrantsNoLaterTerm) {
  Election election = ElectionOf("a");
  election.OnLeader({5, "c"}, 0);
  ASSERT_EQ(AskAt(&election, 300), 5u);
  election.OnLead(Error{"no answer"}, 310);
  election.OnLeader({6, "b"}, 320);
  election.OnLeader({7, "a"}, 330);  // of an earlier process
  EXPECT_EQ(election.role(), Role::kFollows);
}

TEST(Election, ALeaderFollowsWhenAnotherOneLeads) {
  Election election = LeaderOf6("a");
  election.OnLeader({7, "b"}, 400);
  EXPECT_EQ(election.role(), Role::kFollows);
  EXPECT_FALSE(election.admits());
}

TEST(Election, TellsItsPeersInTimeAndWhenItBeginsToLead) {
  Election election = ElectionOf("a");
  election.OnLeader({5, "c"}, 0);
  EXPECT_EQ(BeatAt(&election, 0), (Heartbeat{.term = 5, .leads = false, .next = 8}));
  EXPECT_EQ(BeatAt(&election, 49), std::nullopt);
  EXPECT_EQ(election.Deadline(), 50u);
  EXPECT_TRUE(BeatAt(&election, 50));
  ASSERT_EQ(AskAt(&election, 300), 5u);
  EXPECT_TRUE(BeatAt(&election, 300));
  election.OnLead(Leader{6, "a"}, 301);
  EXPECT_EQ(BeatAt(&election, 301), (Heartbeat{.term = 6, .leads = true, .next = 8}));
  EXPECT_EQ(BeatAt(&election, 302), std::nullopt);
}

TEST(Election, HandsOverWhenNothingIsUncommitted) {
  Election election = LeaderOf6("a");
  BeatAt(&election, 300);
  election.StepDown("c");
  EXPECT_FALSE(election.admits());
  EXPECT_EQ(BeatAt(&election, 310, false), std::nullopt);
  EXPECT_EQ(BeatAt(&election, 320),
            (Heartbeat{.term = 6, .leads = false, .next = 8, .successor = "c"}));
  EXPECT_EQ(election.role(), Role::kLeads);  // in the log
  election.OnLeader({7, "c"}, 330);
  EXPECT_EQ(election.role(), Role::kFollows);
  EXPECT_EQ(BeatAt(&election, 1000), (Heartbeat{.term = 7, .leads = false, .next = 8}));
}

TEST(Election, TakesOverAtOnceFromALeaderThatHandsOver) {
  Election election = ElectionOf("c");
  election.OnLeader({5, "a"}, 1000);
  election.OnHeartbeat("b", Following(5), 1000);
  election.OnHeartbeat("a", Following(5), 1010);
  EXPECT_EQ(AskAt(&election, 1059), std::nullopt);  // b is before it
  EXPECT_EQ(AskAt(&election, 1060), 5u);
}

TEST(Election, OnlyANamedSuccessorTakesOverAtOnce) {
  Election b = ElectionOf("b");
  Election c = ElectionOf("c");
  for (Election* const election : {&b, &c}) {
    election->OnLeader({5, "a"}, 1000);
    election->OnHeartbeat(election == &b ? "c" : "b", Following(5), 1000);
    election->OnHeartbeat("a", {.term = 5, .successor = "c"}, 1010);
  }
  EXPECT_EQ(AskAt(&c, 1010), 5u);
  EXPECT_EQ(AskAt(&b, 1309), std::nullopt);
  EXPECT_EQ(AskAt(&b, 1310), 5u);
}

TEST(Election, ALeaderThatNobodyRelievesLeadsOn) {
  Election election = LeaderOf6("a");
  election.StepDown("");
  EXPECT_FALSE(BeatAt(&election, 1000)->leads);
  EXPECT_FALSE(BeatAt(&election, 1899)->leads);
  EXPECT_FALSE(election.admits());
  EXPECT_TRUE(BeatAt(&election, 1900)->leads);
  EXPECT_TRUE(election.admits());
}

TEST(Election, AnUnhealthyLeaderHandsOverToAHealthyPeer) {
  Election election = LeaderOf6("a");
  election.SetHealthy(false);
  election.OnHeartbeat("b", {.term = 6, .is_healthy = false}, 1000);
  EXPECT_TRUE(BeatAt(&election, 1000)->leads);
  EXPECT_TRUE(election.admits());
  election.OnHeartbeat("c", Following(6), 1100);
  EXPECT_FALSE(BeatAt(&election, 1100)->leads);
  EXPECT_FALSE(election.admits());
  EXPECT_TRUE(BeatAt(&election, 2000)->leads);  // c is not heard any more
}

TEST(Election, ALeaderThatTheLogDoesNotAnswerSaysThatItDoesNotLead) {
  Election election = LeaderOf6("a");
  EXPECT_TRUE(election.NextHeartbeat(false, 1000, 8, 9999)->leads);
  EXPECT_FALSE(election.NextHeartbeat(false, 1000, 8, 10'000)->leads);
  EXPECT_TRUE(election.NextHeartbeat(false, 10'010, 8, 10'010)->leads);
}

// Its peers' heartbeats are in its sockets, behind the timer.
TEST(Election, ADaemonThatWasStoppedSuspectsNobodyAtOnce) {
  Election election = ElectionOf("a");
  election.OnLeader({5, "c"}, 1000);
  EXPECT_EQ(election.Ask(1000), std::nullopt);
  EXPECT_EQ(election.Ask(5000), std::nullopt);
  for (uint64_t now_ms = 5050; now_ms < 5300; now_ms += 50) {
    EXPECT_EQ(election.Ask(now_ms), std::nullopt);
  }
  EXPECT_EQ(election.Ask(5300), 5u);
}

TEST(Election, AnUnhealthyFollowerDoesNotTakeOver) {
  Election election = ElectionOf("a");
  election.OnLeader({5, "c"}, 0);
  election.SetHealthy(false);
  EXPECT_EQ(AskAt(&election, 10'000), std::nullopt);
  election.SetHealthy(true);
  EXPECT_EQ(election.Ask(10'050), 5u);
}

}  // namespace
}  // namespace pheromone::cluster
