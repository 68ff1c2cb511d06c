#include "server/cluster/testing/log_contract.h"

#include <optional>
#include <string>
#include <utility>

namespace pheromone::cluster {

Leader WaitingLog::TakeLead(Term seen, const std::string& node) {
  Result<Leader> leader = TryTakeLead(seen, node);
  for (int i = 1; i < kMaxTries && !leader.ok(); ++i) {
    leader = TryTakeLead(seen, node);
  }
  EXPECT_TRUE(leader.ok()) << leader.error();
  return leader.ok() ? leader.value() : Leader{};
}

Result<Leader> WaitingLog::TryTakeLead(Term seen, const std::string& node) {
  std::optional<Result<Leader>> answer;
  log_->TakeLead(seen, node, [&](const Result<Leader>& leader) { answer = leader; });
  EXPECT_FALSE(answer) << "inside of the call";
  EXPECT_TRUE(harness_->RunUntil([&] { return answer.has_value(); }));
  return answer.value_or(Error{"no answer"});
}

Appended WaitingLog::Append(const Group& group) {
  Appended outcome = TryAppend(group);
  for (int i = 1; i < kMaxTries && outcome == Appended::kUnknown; ++i) {
    outcome = TryAppend(group);
  }
  return outcome;
}

Appended WaitingLog::TryAppend(const Group& group) {
  std::optional<Appended> answer;
  log_->Append(group, [&](Appended outcome) { answer = outcome; });
  EXPECT_FALSE(answer) << "inside of the call";
  EXPECT_TRUE(harness_->RunUntil([&] { return answer.has_value(); }));
  return answer.value_or(Appended::kUnknown);
}

Status WaitingLog::Trim(Sequence floor) {
  std::optional<Status> answer;
  log_->Trim(floor, [&](const Status& status) { answer = status; });
  EXPECT_TRUE(harness_->RunUntil([&] { return answer.has_value(); }));
  return answer.value_or(Error{"no answer"});
}

Follower::Follower(LogHarness* harness, Sequence from)
    : harness_(harness), log_(harness->NewClient()) {
  log_->Follow(from, [this](const Result<Page>& news) { OnNews(news); });
  EXPECT_EQ(pages_, 0u) << "inside of the call";
}

void Follower::OnNews(const Result<Page>& news) {
  if (!news.ok()) {
    errors_.push_back(news.error());
    return;
  }
  page_ = news.value();
  ++pages_;
  for (const Group& group : page_.groups) {
    if (!groups_.empty()) {
      EXPECT_EQ(group.first, groups_.back().first + groups_.back().count);
    }
    groups_.push_back(group);
  }
}

bool Follower::AwaitPage() {
  return harness_->RunUntil([this, before = pages_] { return pages_ > before; });
}

bool Follower::AwaitGroups(size_t count) {
  return harness_->RunUntil([this, count] { return groups_.size() >= count; });
}

bool Follower::Await(const std::function<bool(const Page&)>& is_so) {
  return harness_->RunUntil([&] { return pages_ > 0 && is_so(page_); });
}

Group MakeGroup(Term term, Sequence first, uint32_t count, size_t bytes) {
  Group group{first, count, term, std::string(bytes, '\0')};
  for (size_t i = 0; i < bytes; ++i) {
    group.records[i] = static_cast<char>((first * 131 + i * 7 + i / 251) & 0xff);
  }
  return group;
}

LogContractTest::LogContractTest() : harness_(GetParam()()) {}
LogContractTest::~LogContractTest() = default;

namespace {

constexpr Appended kCommitted = Appended::kCommitted;
constexpr Appended kFenced = Appended::kFenced;

TEST_P(LogContractTest, AnEmptyLogHasNoLeader) {
  Follower follower(harness(), 1);
  ASSERT_TRUE(follower.AwaitPage());
  EXPECT_EQ(follower.page(), (Page{"", Leader{0, ""}, 1, 1, {}}));
}

TEST_P(LogContractTest, TheFirstLeaderMakesTheClusterAndTheNextOneKeepsIt) {
  WaitingLog a(harness());
  WaitingLog b(harness());
  const Leader first = a.TakeLead(0, "a");
  EXPECT_EQ(first.node, "a");
  EXPECT_GT(first.term, 0u);
  Follower follower(harness(), 1);
  ASSERT_TRUE(follower.AwaitPage());
  const std::string id = follower.page().id;
  EXPECT_NE(id, "");
  EXPECT_EQ(follower.page().leader, first);

  const Leader second = b.TakeLead(first.term, "b");
  EXPECT_EQ(second.node, "b");
  EXPECT_GT(second.term, first.term);
  EXPECT_TRUE(follower.Await([&](const Page& page) { return page.leader == second; }));
  EXPECT_EQ(follower.page().id, id);
}

TEST_P(LogContractTest, WhoSawAnOlderTermDoesNotTakeTheLead) {
  WaitingLog a(harness());
  WaitingLog b(harness());
  const Leader first = a.TakeLead(0, "a");
  EXPECT_EQ(b.TakeLead(0, "b"), first);
  EXPECT_EQ(b.TakeLead(first.term + 1000, "b"), first);
}

TEST_P(LogContractTest, OfTwoThatTakeTheLeadOneHasIt) {
  const auto a = harness()->NewClient();
  const auto b = harness()->NewClient();
  std::vector<Leader> leaders;
  const auto note = [&](const Result<Leader>& leader) {
    ASSERT_TRUE(leader.ok()) << leader.error();
    leaders.push_back(leader.value());
  };
  Term seen = 0;
  for (int round = 0; round < 5; ++round) {
    leaders.clear();
    a->TakeLead(seen, "a", note);
    b->TakeLead(seen, "b", note);
    ASSERT_TRUE(harness()->RunUntil([&] { return leaders.size() == 2; }));
    EXPECT_EQ(leaders[0], leaders[1]);
    EXPECT_GT(leaders[0].term, seen);
    seen = leaders[0].term;
  }
}

TEST_P(LogContractTest, FollowersGetWhatIsAppended) {
  Follower early(harness(), 1);
  WaitingLog leader(harness());
  const Term term = leader.TakeLead(0, "a").term;
  std::vector<Group> groups = {MakeGroup(term, 1, 3), MakeGroup(term, 4, 1),
                               MakeGroup(term, 5, 1, 0), MakeGroup(term, 6, 300, 100'000)};
  for (const Group& group : groups) {
    EXPECT_EQ(leader.Append(group), kCommitted);
  }
  EXPECT_TRUE(early.AwaitGroups(4));
  EXPECT_EQ(early.groups(), groups);
  EXPECT_EQ(early.page().next, 306u);
  Follower late(harness(), 1);
  EXPECT_TRUE(late.AwaitGroups(4));
  EXPECT_EQ(late.groups(), groups);
  groups.push_back(MakeGroup(term, 306, 2));
  EXPECT_EQ(leader.Append(groups.back()), kCommitted);
  EXPECT_TRUE(late.AwaitGroups(5));
  EXPECT_TRUE(early.AwaitGroups(5));
  EXPECT_EQ(late.groups(), groups);
  EXPECT_EQ(early.groups(), groups);
}

TEST_P(LogContractTest, TheSameGroupAgainIsCommittedAndThereOnce) {
  WaitingLog leader(harness());
  const Term term = leader.TakeLead(0, "a").term;
  for (const Group& group : {MakeGroup(term, 1, 3), MakeGroup(term, 4, 2, 0)}) {
    EXPECT_EQ(leader.Append(group), kCommitted);
    EXPECT_EQ(leader.Append(group), kCommitted);
  }
  Follower follower(harness(), 1);
  ASSERT_TRUE(follower.Await([](const Page& page) { return page.next == 6; }));
  EXPECT_EQ(follower.groups().size(), 2u);
}

TEST_P(LogContractTest, AnotherGroupAtATakenPlaceIsFenced) {
  WaitingLog leader(harness());
  const Term term = leader.TakeLead(0, "a").term;
  const Group group = MakeGroup(term, 1, 3);
  ASSERT_EQ(leader.Append(group), kCommitted);
  Group other = group;
  other.records[5] ^= 1;
  EXPECT_EQ(leader.Append(other), kFenced);
  other = group;
  other.count = 4;
  EXPECT_EQ(leader.Append(other), kFenced);
  Follower follower(harness(), 1);
  ASSERT_TRUE(follower.AwaitGroups(1));
  EXPECT_EQ(follower.groups(), std::vector<Group>{group});
}

TEST_P(LogContractTest, WhoWasDeposedIsFenced) {
  WaitingLog a(harness());
  WaitingLog b(harness());
  const Term old_term = a.TakeLead(0, "a").term;
  const Group committed = MakeGroup(old_term, 1, 3);
  ASSERT_EQ(a.Append(committed), kCommitted);
  const Term term = b.TakeLead(old_term, "b").term;
  EXPECT_EQ(a.Append(MakeGroup(old_term, 4, 1)), kFenced);
  EXPECT_EQ(a.Append(committed), kCommitted) << "it was";
  const Group next = MakeGroup(term, 4, 2);
  EXPECT_EQ(b.Append(next), kCommitted);
  EXPECT_EQ(a.Append(MakeGroup(old_term, 4, 2)), kFenced) << "the same events, but of another term";
  Follower follower(harness(), 1);
  ASSERT_TRUE(follower.AwaitGroups(2));
  EXPECT_EQ(follower.groups(), (std::vector<Group>{committed, next}));
}

TEST_P(LogContractTest, AFollowerBeginsWithTheGroupThatContainsItsPlace) {
  WaitingLog leader(harness());
  const Term term = leader.TakeLead(0, "a").term;
  const Group long_one = MakeGroup(term, 3, 2000);
  const Group last = MakeGroup(term, 2003, 1);
  for (const Group& group : {MakeGroup(term, 1, 2), long_one, last}) {
    ASSERT_EQ(leader.Append(group), kCommitted);
  }
  for (const Sequence from : {Sequence{3}, Sequence{4}, Sequence{2002}}) {
    Follower follower(harness(), from);
    ASSERT_TRUE(follower.AwaitGroups(2)) << from;
    EXPECT_EQ(follower.groups(), (std::vector<Group>{long_one, last})) << from;
  }
  Follower at_end(harness(), 2003);
  ASSERT_TRUE(at_end.AwaitGroups(1));
  EXPECT_EQ(at_end.groups(), std::vector<Group>{last});
}

TEST_P(LogContractTest, AFollowerAtTheEndWaits) {
  WaitingLog leader(harness());
  const Term term = leader.TakeLead(0, "a").term;
  ASSERT_EQ(leader.Append(MakeGroup(term, 1, 2)), kCommitted);
  Follower follower(harness(), 3);
  ASSERT_TRUE(follower.AwaitPage());
  EXPECT_EQ(follower.page().next, 3u);
  EXPECT_TRUE(follower.groups().empty());
  const Group next = MakeGroup(term, 3, 5);
  ASSERT_EQ(leader.Append(next), kCommitted);
  ASSERT_TRUE(follower.AwaitGroups(1));
  EXPECT_EQ(follower.groups(), std::vector<Group>{next});
}

TEST_P(LogContractTest, AFollowerBeyondTheEndIsToldWhereItIs) {
  WaitingLog leader(harness());
  const Term term = leader.TakeLead(0, "a").term;
  ASSERT_EQ(leader.Append(MakeGroup(term, 1, 2)), kCommitted);
  Follower follower(harness(), 100'000);
  ASSERT_TRUE(follower.AwaitPage());
  EXPECT_EQ(follower.page().next, 3u);
  EXPECT_TRUE(follower.groups().empty());
}

TEST_P(LogContractTest, ALateFollowerReadsManyGroups) {
  WaitingLog leader(harness());
  const Term term = leader.TakeLead(0, "a").term;
  std::vector<Group> groups;
  for (Sequence first = 1; first <= 100; ++first) {
    groups.push_back(MakeGroup(term, first, 1));
    ASSERT_EQ(leader.Append(groups.back()), kCommitted);
  }
  Follower follower(harness(), 1);
  ASSERT_TRUE(follower.AwaitGroups(100));
  EXPECT_EQ(follower.groups(), groups);
}

TEST_P(LogContractTest, AGroupMayBeLarge) {
  WaitingLog leader(harness());
  Follower early(harness(), 1);
  const Term term = leader.TakeLead(0, "a").term;
  const std::vector<Group> groups = {MakeGroup(term, 1, 1), MakeGroup(term, 2, 3, 5'000'000),
                                     MakeGroup(term, 5, 1)};
  for (const Group& group : groups) {
    ASSERT_EQ(leader.Append(group), kCommitted);
    ASSERT_EQ(leader.Append(group), kCommitted) << "again";
  }
  Group other = groups[1];
  other.records[4'000'000] ^= 1;
  EXPECT_EQ(leader.Append(other), kFenced);
  ASSERT_TRUE(early.AwaitGroups(3));
  EXPECT_TRUE(early.groups() == groups);
  Follower late(harness(), 2);
  ASSERT_TRUE(late.AwaitGroups(2));
  EXPECT_TRUE(late.groups()[0] == groups[1]);
}

TEST_P(LogContractTest, TrimForgetsGroupsThatEndBeforeTheFloor) {
  WaitingLog leader(harness());
  const Term term = leader.TakeLead(0, "a").term;
  const std::vector<Group> groups = {MakeGroup(term, 1, 2), MakeGroup(term, 3, 2, 2'000'000),
                                     MakeGroup(term, 5, 10), MakeGroup(term, 15, 1)};
  for (const Group& group : groups) {
    ASSERT_EQ(leader.Append(group), kCommitted);
  }
  Follower watching(harness(), 16);
  ASSERT_TRUE(watching.AwaitPage());
  ASSERT_TRUE(leader.Trim(7).ok());
  ASSERT_TRUE(watching.Await([](const Page& page) { return page.floor == 7; }));
  for (const Sequence from : {Sequence{1}, Sequence{3}, Sequence{7}}) {
    Follower follower(harness(), from);
    ASSERT_TRUE(follower.AwaitGroups(2)) << from;
    EXPECT_EQ(follower.groups(), (std::vector<Group>{groups[2], groups[3]})) << from;
    EXPECT_EQ(follower.page().floor, 7u);
  }
  ASSERT_TRUE(leader.Trim(2).ok());
  ASSERT_TRUE(leader.Trim(16).ok());
  ASSERT_TRUE(watching.Await([](const Page& page) { return page.floor == 16; }));
  Follower follower(harness(), 1);
  ASSERT_TRUE(follower.AwaitPage());
  EXPECT_EQ(follower.page().next, 16u);
  const Group next = MakeGroup(term, 16, 1);
  ASSERT_EQ(leader.Append(next), kCommitted);
  ASSERT_TRUE(follower.AwaitGroups(1));
  ASSERT_TRUE(watching.AwaitGroups(1));
  EXPECT_EQ(follower.groups(), std::vector<Group>{next});
  EXPECT_EQ(watching.groups(), std::vector<Group>{next});
}

TEST_P(LogContractTest, TheLatestFollowReplacesTheEarlierOne) {
  WaitingLog leader(harness());
  const Term term = leader.TakeLead(0, "a").term;
  ASSERT_EQ(leader.Append(MakeGroup(term, 1, 2)), kCommitted);
  Follower follower(harness(), 1);
  size_t called = 0;
  follower.log().Follow(3, [&](const Result<Page>& page) { called += page.ok() ? 1u : 0u; });
  ASSERT_TRUE(harness()->RunUntil([&] { return called > 0; }));
  EXPECT_EQ(follower.pages(), 0u);
  const size_t before = called;
  ASSERT_EQ(leader.Append(MakeGroup(term, 3, 2)), kCommitted);
  ASSERT_TRUE(harness()->RunUntil([&] { return called > before; }));
  EXPECT_EQ(follower.pages(), 0u);
}

TEST_P(LogContractTest, ARegisterIsSetByWhoSawItsLastChange) {
  const auto a = harness()->NewClient();
  const auto b = harness()->NewClient();
  Result<Register> told = Error{"not called"};
  const auto wait =
      [&](const std::function<void(std::function<void(const Result<Register>&)>)>& ask) {
        bool is_told = false;
        ask([&](const Result<Register>& answer) {
          told = answer;
          is_told = true;
        });
        EXPECT_FALSE(is_told) << "inside of the call";
        EXPECT_TRUE(harness()->RunUntil([&] { return is_told; }));
        EXPECT_TRUE(told.ok()) << told.error();
        return told.ok() ? told.value() : Register{};
      };
  const auto read = [&](ReplicatedLog& log, const std::string& name) {
    return wait([&](auto done) { log.ReadRegister(name, std::move(done)); });
  };
  const auto set = [&](ReplicatedLog& log, uint64_t seen, const std::string& value) {
    return wait([&](auto done) { log.SetRegister("x", seen, value, std::move(done)); });
  };
  EXPECT_EQ(read(*a, "x"), Register{});
  EXPECT_EQ(set(*a, 5, "a0"), Register{});
  const Register first = set(*a, 0, "a1");
  EXPECT_EQ(first.value, "a1");
  EXPECT_GT(first.revision, 0u);
  EXPECT_EQ(read(*b, "x"), first);
  EXPECT_EQ(read(*b, "y"), Register{});
  EXPECT_EQ(set(*b, 0, "b1"), first);
  const Register second = set(*b, first.revision, "b2");
  EXPECT_EQ(second.value, "b2");
  EXPECT_GT(second.revision, first.revision);
  EXPECT_EQ(set(*a, first.revision, "a2"), second);
  EXPECT_EQ(set(*b, second.revision, "b2").value, "b2");  // the same value is a change
  EXPECT_GT(read(*a, "x").revision, second.revision);
}

TEST_P(LogContractTest, AfterStopNobodyIsCalled) {
  WaitingLog leader(harness());
  const Term term = leader.TakeLead(0, "a").term;
  Follower follower(harness(), 1);
  ASSERT_TRUE(follower.AwaitPage());
  const size_t pages = follower.pages();
  bool called = false;
  auto stopped = harness()->NewClient();
  stopped->Append(MakeGroup(term, 1, 1), [&](Appended) { called = true; });
  stopped->Trim(1, [&](const Status&) { called = true; });
  stopped->TakeLead(0, "x", [&](const Result<Leader>&) { called = true; });
  stopped->Stop();
  follower.log().Stop();
  ASSERT_EQ(leader.Append(MakeGroup(term, 1, 1)), kCommitted);
  Follower other(harness(), 1);
  ASSERT_TRUE(other.AwaitGroups(1));
  harness()->RunReady();
  EXPECT_EQ(follower.pages(), pages);
  EXPECT_FALSE(called);
  stopped.reset();
  harness()->RunReady();
  EXPECT_FALSE(called);
}

}  // namespace
}  // namespace pheromone::cluster
