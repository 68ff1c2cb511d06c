#include "server/cluster/replica.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

namespace pheromone::cluster {
namespace {

Group GroupOf(Sequence first, Term term, const std::string& records) {
  return {.first = first,
          .count = static_cast<uint32_t>(records.size()),  // an event is a letter
          .term = term,
          .records = records};
}

Page PageOf(const Leader& leader, std::vector<Group> groups = {}, Sequence floor = 1) {
  return {.id = "id", .leader = leader, .floor = floor, .groups = std::move(groups)};
}

ReplicaSettings SettingsOf(const std::string& node) {
  return {.node = node, .nodes = {"a", "b", "c"}, .meet_ms = 300};
}

// What Next says at that time to one that was asked often before, and then had nothing else to do.
Replica::Actions NextAt(Replica* replica, uint64_t at_ms) {
  for (uint64_t now_ms = at_ms < 600 ? 0 : at_ms - 600; now_ms < at_ms; now_ms += 50) {
    const Replica::Actions actions = replica->Next(now_ms);
    EXPECT_TRUE(actions.committed.empty() && !actions.take_lead && !actions.append) << now_ms;
  }
  return replica->Next(at_ms);
}

// A daemon that has applied "xy" of term 5, was granted term 6 at 1000, and leads.
Replica LeaderOfTerm6() {
  Replica replica(SettingsOf("a"), 1, 0);
  replica.OnPage(PageOf({5, "b"}, {GroupOf(1, 5, "xy")}), 700);
  replica.Next(700);
  EXPECT_EQ(NextAt(&replica, 1000).take_lead, 5u);
  replica.OnLead(Leader{6, "a"}, 1000);
  replica.OnPage(PageOf({6, "a"}), 1000);
  replica.Next(1000);
  EXPECT_EQ(replica.role(), Role::kLeads);
  return replica;
}

// Another log, or the same one begun anew, may have other events with the same sequences.
TEST(Replica, ALogWithAnotherIdIsNotFollowed) {
  ReplicaSettings settings = SettingsOf("a");
  settings.id = "first";
  const Page other{.id = "second", .leader = {5, "b"}, .groups = {GroupOf(1, 4, "xyz")}};
  const Page empty{.id = "", .leader = {}, .groups = {}};
  for (const Page& page : {other, empty}) {
    Replica replica(settings, 3, 0);
    replica.OnPage(page, 0);
    EXPECT_EQ(replica.gap(), LogGap::kOtherLog);
    EXPECT_TRUE(replica.Next(0).committed.empty());
    for (uint64_t now_ms = 0; now_ms < 5'000; now_ms += 50) {
      EXPECT_FALSE(replica.Next(now_ms).take_lead) << now_ms;
    }
  }
}

TEST(Replica, ALogThatIsWipedEndsALeader) {
  Replica idle = LeaderOfTerm6();
  Replica busy = idle;
  busy.Submit(3, "z");
  for (Replica* const replica : {&idle, &busy}) {
    EXPECT_EQ(replica->id(), "id");
    replica->OnPage({.id = "", .leader = {}, .groups = {}}, 1'010);
    EXPECT_EQ(replica->gap(), LogGap::kOtherLog);
    EXPECT_FALSE(replica->admits());
  }
  EXPECT_EQ(idle.role(), Role::kFollows);
  EXPECT_EQ(busy.role(), Role::kDeposed) << "it has applied what is in no log";
}

TEST(Replica, WhatItWasBarredForStays) {
  Replica replica(SettingsOf("a"), 3, 0);
  replica.Bar(LogGap::kOtherLog);
  replica.OnPage(PageOf({5, "b"}, {GroupOf(9, 5, "z")}, 9), 0);
  EXPECT_EQ(replica.gap(), LogGap::kOtherLog) << "and not that a state is needed";
  EXPECT_TRUE(replica.Next(0).committed.empty());
}

TEST(Replica, DeliversEachGroupOnceInOrder) {
  Replica replica(SettingsOf("a"), 1, 0);
  EXPECT_EQ(replica.follow_from(), 1u);
  replica.OnPage(PageOf({5, "b"}, {GroupOf(1, 4, "xy"), GroupOf(3, 5, "z")}), 0);
  EXPECT_EQ(replica.Deadline(), 0u);
  const Replica::Actions actions = replica.Next(0);
  EXPECT_EQ(actions.committed, (std::vector<Group>{GroupOf(1, 4, "xy"), GroupOf(3, 5, "z")}));
  EXPECT_EQ(actions.own, 0u);
  EXPECT_TRUE(replica.Next(0).committed.empty());
  EXPECT_EQ(replica.committed(), 3u);
  EXPECT_EQ(replica.leader(), (Leader{5, "b"}));
  replica.OnPage(PageOf({5, "b"}, {GroupOf(4, 5, "!")}), 0);
  EXPECT_EQ(replica.Next(0).committed, (std::vector<Group>{GroupOf(4, 5, "!")}));
}

TEST(Replica, FollowsFromTheLastAppliedEventAndDoesNotDeliverItAgain) {
  Replica replica(SettingsOf("a"), 3, 0);
  EXPECT_EQ(replica.follow_from(), 2u);
  replica.OnPage(PageOf({5, "b"}, {GroupOf(1, 4, "xy"), GroupOf(3, 5, "z")}), 0);
  EXPECT_EQ(replica.Next(0).committed, (std::vector<Group>{GroupOf(3, 5, "z")}));
}

TEST(Replica, AJournalMayEndWithinAGroup) {
  Replica replica(SettingsOf("a"), 2, 0);
  replica.OnPage(PageOf({5, "b"}, {GroupOf(1, 4, "xy")}), 0);
  EXPECT_EQ(replica.Next(0).committed, (std::vector<Group>{GroupOf(1, 4, "xy")}));
  EXPECT_EQ(replica.committed(), 2u);
}

TEST(Replica, NeedsAStateIfWhatComesNextWasTrimmed) {
  Replica replica(SettingsOf("a"), 3, 0);
  replica.OnPage(PageOf({5, "b"}, {GroupOf(5, 5, "z")}, 5), 0);
  EXPECT_EQ(replica.gap(), LogGap::kTrimmed);
  EXPECT_TRUE(replica.Next(0).committed.empty());
  EXPECT_EQ(NextAt(&replica, 10'000).take_lead, std::nullopt);
  replica.OnPage(PageOf({6, "c"}, {GroupOf(6, 6, "z")}, 5), 10'000);
  EXPECT_TRUE(replica.Next(10'000).committed.empty());
  EXPECT_EQ(replica.leader(), (Leader{6, "c"}));

  Replica trimmed_to_the_end(SettingsOf("a"), 3, 0);
  trimmed_to_the_end.OnPage(PageOf({5, "b"}, {}, 5), 0);
  EXPECT_EQ(trimmed_to_the_end.gap(), LogGap::kTrimmed);

  Replica slow(SettingsOf("a"), 1, 0);
  slow.OnPage(PageOf({5, "b"}, {GroupOf(1, 5, "z")}), 0);
  slow.OnPage(PageOf({5, "b"}, {GroupOf(5, 5, "z")}, 5), 0);
  EXPECT_EQ(slow.gap(), LogGap::kTrimmed);
}

TEST(Replica, GoesOnWhereAllThatItHasWasTrimmed) {
  Replica replica(SettingsOf("a"), 3, 0);
  replica.OnPage(PageOf({5, "b"}, {}, 3), 0);
  EXPECT_EQ(replica.gap(), LogGap::kNone);
  replica.OnPage(PageOf({5, "b"}, {GroupOf(3, 5, "z")}, 3), 0);
  EXPECT_EQ(replica.Next(0).committed, (std::vector<Group>{GroupOf(3, 5, "z")}));
}

TEST(Replica, NoticesALogThatLacksWhatWasApplied) {
  for (const std::vector<Group>& groups :
       {std::vector<Group>{}, std::vector<Group>{GroupOf(1, 4, "x")}}) {
    Replica replica(SettingsOf("a"), 3, 0);
    replica.OnPage(PageOf({5, "b"}, groups), 0);
    EXPECT_EQ(replica.gap(), LogGap::kRewound);
    EXPECT_EQ(NextAt(&replica, 10'000).take_lead, std::nullopt);
  }
  Replica running(SettingsOf("a"), 1, 0);
  running.OnPage(PageOf({5, "b"}, {GroupOf(1, 4, "xy")}), 0);
  running.OnPage(PageOf({5, "b"}, {GroupOf(2, 4, "z")}), 0);
  EXPECT_EQ(running.gap(), LogGap::kRewound);
}

TEST(Replica, LeadsWhenAllOfTheLogIsHandedOut) {
  Replica replica(SettingsOf("a"), 1, 0);
  replica.OnPage(PageOf({5, "b"}), 700);
  ASSERT_EQ(NextAt(&replica, 1000).take_lead, 5u);
  replica.OnLead(Leader{6, "a"}, 1000);
  EXPECT_EQ(replica.role(), Role::kCatchesUp);
  replica.OnPage(PageOf({5, "b"}, {GroupOf(1, 5, "x")}), 1010);  // of before the takeover
  EXPECT_EQ(replica.Next(1010).committed.size(), 1u);
  EXPECT_EQ(replica.role(), Role::kCatchesUp);
  replica.OnPage(PageOf({6, "a"}, {GroupOf(2, 5, "y")}), 1020);
  EXPECT_FALSE(replica.admits());  // "y" is not applied yet
  EXPECT_EQ(replica.Deadline(), 0u);
  EXPECT_EQ(replica.Next(1020).committed, (std::vector<Group>{GroupOf(2, 5, "y")}));
  EXPECT_TRUE(replica.admits());
  replica.Submit(3, "z");
  EXPECT_EQ(replica.Next(1020).append, GroupOf(3, 6, "z"));
}

TEST(Replica, ReadsALongLogInPortionsBeforeItLeads) {
  Replica replica(SettingsOf("a"), 1, 0);
  replica.OnPage(PageOf({5, "b"}), 700);
  ASSERT_EQ(NextAt(&replica, 1000).take_lead, 5u);
  replica.OnLead(Leader{6, "a"}, 1000);
  replica.OnPage(PageOf({}, {GroupOf(1, 5, "x")}), 1010);
  replica.Next(1010);
  EXPECT_EQ(replica.role(), Role::kCatchesUp);
  EXPECT_EQ(replica.leader(), (Leader{6, "a"}));
  replica.OnPage(PageOf({6, "a"}, {GroupOf(2, 5, "y")}), 1020);
  replica.OnPage(PageOf({}), 1020);
  replica.Next(1020);
  EXPECT_TRUE(replica.admits());
}

TEST(Replica, LosesTheLeadWhileItCatchesUpWithoutHarm) {
  Replica replica(SettingsOf("a"), 1, 0);
  replica.OnPage(PageOf({5, "b"}), 700);
  ASSERT_EQ(NextAt(&replica, 1000).take_lead, 5u);
  replica.OnLead(Leader{6, "a"}, 1000);
  replica.OnPage(PageOf({7, "c"}, {GroupOf(1, 7, "x")}), 1020);
  EXPECT_EQ(replica.Next(1020).committed.size(), 1u);
  EXPECT_EQ(replica.role(), Role::kFollows);
}

TEST(Replica, CommitsItsOwnByTheAnswer) {
  Replica replica = LeaderOfTerm6();
  replica.Submit(3, "p");
  EXPECT_EQ(replica.Next(1100).append, GroupOf(3, 6, "p"));
  replica.Submit(4, "q");
  EXPECT_EQ(replica.Next(1200).append, std::nullopt);
  replica.OnAppended(Appended::kCommitted, 1200);
  const Replica::Actions actions = replica.Next(1200);
  EXPECT_EQ(actions.committed, (std::vector<Group>{GroupOf(3, 6, "p")}));
  EXPECT_EQ(actions.own, 1u);
  EXPECT_EQ(actions.append, GroupOf(4, 6, "q"));
  replica.OnPage(PageOf({6, "a"}, {GroupOf(3, 6, "p")}), 1210);  // it is known already
  EXPECT_TRUE(replica.Next(1210).committed.empty());
  EXPECT_EQ(replica.committed(), 3u);
}

TEST(Replica, CommitsItsOwnByAPage) {
  Replica replica = LeaderOfTerm6();
  replica.Submit(3, "p");
  replica.Next(1100);
  replica.Submit(4, "q");
  replica.OnPage(PageOf({6, "a"}, {GroupOf(3, 6, "p")}), 1110);
  Replica::Actions actions = replica.Next(1110);
  EXPECT_EQ(actions.committed.size(), 1u);
  EXPECT_EQ(actions.own, 1u);
  EXPECT_EQ(actions.append, std::nullopt);  // the first append is not answered: one at a time
  replica.OnAppended(Appended::kUnknown, 1200);
  EXPECT_EQ(replica.Next(1200).append, GroupOf(4, 6, "q"));
}

TEST(Replica, RepeatsTheSameGroupWithoutAnAnswer) {
  Replica replica = LeaderOfTerm6();
  replica.Submit(3, "p");
  EXPECT_EQ(replica.Next(1100).append, GroupOf(3, 6, "p"));
  replica.Submit(4, "q");
  replica.OnAppended(Appended::kUnknown, 1200);
  EXPECT_EQ(replica.Next(1200).append, std::nullopt);
  EXPECT_LE(replica.Deadline(), 1250u);
  EXPECT_EQ(replica.Next(1250).append, GroupOf(3, 6, "p"));
}

TEST(Replica, IsDeposedIfItsGroupIsFenced) {
  Replica replica = LeaderOfTerm6();
  replica.Submit(3, "p");
  replica.Next(1100);
  replica.OnAppended(Appended::kFenced, 1200);
  EXPECT_EQ(replica.role(), Role::kDeposed);
  EXPECT_TRUE(replica.Next(1200).is_deposed);
  EXPECT_FALSE(replica.admits());
  replica.OnPage(PageOf({7, "b"}, {GroupOf(3, 7, "z")}), 1210);
  const Replica::Actions actions = replica.Next(9000);
  EXPECT_TRUE(actions.is_deposed);
  EXPECT_TRUE(actions.committed.empty());
  EXPECT_EQ(actions.heartbeat, std::nullopt);
  EXPECT_EQ(replica.Deadline(), kNever);
}

TEST(Replica, IsDeposedByANewLeaderIfSomethingIsUncommitted) {
  Replica replica = LeaderOfTerm6();
  replica.Submit(3, "p");
  replica.Next(1100);
  replica.Submit(4, "q");
  // "p" was in time, "q" not.
  replica.OnPage(PageOf({7, "b"}, {GroupOf(3, 6, "p"), GroupOf(4, 7, "z")}), 1110);
  const Replica::Actions actions = replica.Next(1110);
  EXPECT_TRUE(actions.is_deposed);
  EXPECT_EQ(actions.committed, (std::vector<Group>{GroupOf(3, 6, "p")}));
  EXPECT_EQ(actions.own, 1u);
}

TEST(Replica, IsDeposedByANewLeaderThatHasWrittenNothingYet) {
  Replica replica = LeaderOfTerm6();
  replica.Submit(3, "p");
  replica.OnPage(PageOf({7, "b"}), 1110);
  EXPECT_TRUE(replica.Next(1110).is_deposed);
}

TEST(Replica, FollowsANewLeaderIfAllWasCommitted) {
  Replica replica = LeaderOfTerm6();
  replica.Submit(3, "p");
  replica.Next(1100);
  replica.OnPage(PageOf({7, "b"}, {GroupOf(3, 6, "p"), GroupOf(4, 7, "z")}), 1110);
  const Replica::Actions actions = replica.Next(1110);
  EXPECT_FALSE(actions.is_deposed);
  EXPECT_EQ(actions.committed, (std::vector<Group>{GroupOf(3, 6, "p"), GroupOf(4, 7, "z")}));
  EXPECT_EQ(actions.own, 1u);
  EXPECT_EQ(replica.role(), Role::kFollows);
  replica.OnAppended(Appended::kFenced, 1120);  // says nothing that a page has not told
  EXPECT_EQ(replica.role(), Role::kFollows);
}

TEST(Replica, IsDeposedByAnotherGroupAtItsPlace) {
  Replica replica = LeaderOfTerm6();
  replica.OnPage(PageOf({6, "a"}, {GroupOf(3, 6, "z")}), 1110);  // two daemons of one name
  EXPECT_TRUE(replica.Next(1110).is_deposed);
}

TEST(Replica, IsDeposedByAnEventThatComesTooLate) {
  Replica replica = LeaderOfTerm6();
  replica.OnPage(PageOf({7, "b"}), 1110);
  replica.Submit(3, "p");  // it was admitted before
  EXPECT_TRUE(replica.Next(1110).is_deposed);
}

TEST(Replica, CommitsWhatIsSubmittedBeforeItHandsOver) {
  Replica replica = LeaderOfTerm6();
  replica.Submit(3, "p");
  replica.Next(1100);
  replica.StepDown("");
  EXPECT_FALSE(replica.admits());
  replica.Submit(4, "q");  // it was admitted before
  EXPECT_TRUE(replica.Next(1150).heartbeat->leads);
  replica.OnAppended(Appended::kCommitted, 1160);
  EXPECT_EQ(replica.Next(1160).append, GroupOf(4, 6, "q"));
  EXPECT_TRUE(replica.Next(1210).heartbeat->leads);
  replica.OnAppended(Appended::kCommitted, 1220);
  const Replica::Actions actions = replica.Next(1220);
  ASSERT_TRUE(actions.heartbeat);
  EXPECT_FALSE(actions.heartbeat->leads);
  EXPECT_EQ(actions.heartbeat->next, 5u);
  replica.OnPage(PageOf({7, "b"}, {GroupOf(3, 6, "p"), GroupOf(4, 6, "q")}), 1230);
  EXPECT_FALSE(replica.Next(1230).is_deposed);
  EXPECT_EQ(replica.role(), Role::kFollows);
}

TEST(Replica, LeadsAgainAfterOthersDid) {
  Replica replica = LeaderOfTerm6();
  replica.OnPage(PageOf({7, "b"}, {GroupOf(3, 7, "z")}), 2000);
  replica.Next(2000);
  ASSERT_EQ(NextAt(&replica, 2300).take_lead, 7u);
  replica.OnPage(PageOf({8, "a"}, {GroupOf(4, 7, "!")}), 2310);
  EXPECT_EQ(replica.Next(2310).committed.size(), 1u);
  replica.OnLead(Leader{8, "a"}, 2320);
  ASSERT_TRUE(replica.admits());
  replica.Submit(5, "p");
  EXPECT_EQ(replica.Next(2330).append, GroupOf(5, 8, "p"));
}

TEST(Replica, ALoneDaemonOrdersFromTheFirstPageOn) {
  Replica replica({.node = "a", .nodes = {"a"}}, 1, 0);
  replica.OnPage(PageOf({}), 10);
  ASSERT_EQ(replica.Next(10).take_lead, 0u);
  replica.OnLead(Leader{1, "a"}, 12);
  replica.OnPage(PageOf({1, "a"}), 12);
  replica.Next(12);
  EXPECT_TRUE(replica.admits());
  EXPECT_EQ(replica.Deadline(), kNever);
}

}  // namespace
}  // namespace pheromone::cluster
