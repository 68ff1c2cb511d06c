// The log in etcd, with three real members on this machine: the contract, and what can go wrong
// between them and their clients.
#include "server/cluster/etcd_log.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>

#include "proto_tests/cluster/etcd_members.h"
#include "proto_tests/cluster/relay.h"
#include "server/base/base64.h"
#include "server/cluster/etcd_client.h"
#include "server/cluster/etcd_format.h"
#include "server/cluster/etcd_messages.h"
#include "server/cluster/testing/log_contract.h"

namespace pheromone::cluster {
namespace {

using std::chrono::milliseconds;

constexpr std::chrono::seconds kMuchTooLong{30};

EtcdMembers& Members() {
  static EtcdMembers members;
  return members;
}

class EtcdHarness : public LogHarness {
 public:
  /// Each has a cluster of its own in the same etcd.
  EtcdHarness() {
    static int count = 0;
    settings_.members = Members().endpoints();
    settings_.cluster = "test" + std::to_string(++count);
    settings_.new_id = "id of " + settings_.cluster;
    settings_.silence = milliseconds(300);
    settings_.patience = milliseconds(5000);  // of a busy machine
    AwaitMembers();
  }

  std::unique_ptr<ReplicatedLog> NewClient() override { return NewClient(settings_); }
  std::unique_ptr<ReplicatedLog> NewClient(const EtcdSettings& settings) {
    return std::make_unique<EtcdLog>(io_.get_executor(), settings);
  }
  bool RunUntil(const std::function<bool()>& done) override {
    const auto end = std::chrono::steady_clock::now() + kMuchTooLong;
    while (!done()) {
      io_.restart();
      if (io_.run_one_until(end) == 0 && std::chrono::steady_clock::now() >= end) {
        return false;
      }
    }
    return true;
  }
  void RunReady() override {
    io_.restart();
    io_.poll();
  }

  boost::asio::io_context& io() { return io_; }
  /// For the next clients.
  EtcdSettings& settings() { return settings_; }

  /// Until each of them knows a leader.
  void AwaitMembers() {
    for (const Endpoint& endpoint : Members().endpoints()) {
      EtcdSettings one = settings_;
      one.members = {endpoint};
      const std::unique_ptr<ReplicatedLog> client = NewClient(one);
      bool is_ready = false;
      client->Follow(1, [&](const Result<Page>& page) { is_ready = is_ready || page.ok(); });
      ASSERT_TRUE(RunUntil([&] { return is_ready; }))
          << "etcd at " << ToText(endpoint) << " knows no leader, expected one within "
          << kMuchTooLong.count() << " s";
    }
  }

 private:
  boost::asio::io_context io_;
  EtcdSettings settings_;
};

INSTANTIATE_TEST_SUITE_P(Etcd, LogContractTest,
                         testing::Values([] { return std::make_unique<EtcdHarness>(); }));

// Makes the first member of the settings etcd's leader.
Status Transfer(EtcdHarness* harness, EtcdSettings settings) {
  settings.has_own_member = true;
  const std::unique_ptr<ReplicatedLog> log = harness->NewClient(settings);
  std::optional<Status> transferred;
  log->Transfer([&](const Status& status) { transferred = status; });
  EXPECT_TRUE(harness->RunUntil([&] { return transferred.has_value(); }));
  return transferred.value_or(Error{"no answer"});
}

bool IsWatch(std::string_view request) {
  return request.starts_with("POST /v3/watch");
}

class EtcdLogTest : public testing::Test {
 protected:
  EtcdLogTest() : harness_(std::make_unique<EtcdHarness>()) {}
  ~EtcdLogTest() override {
    for (size_t member = 0; member < EtcdMembers::kCount; ++member) {
      Members().Start(member);
    }
  }

  EtcdHarness* harness() { return harness_.get(); }
  EtcdSettings& settings() { return harness_->settings(); }
  std::unique_ptr<Relay> NewRelay(size_t member = 0) {
    return std::make_unique<Relay>(&harness_->io(), Members().endpoints()[member]);
  }

  // Past the log.
  bool Put(const std::string& key, const std::string& value) {
    const auto client = std::make_shared<EtcdClient>(
        harness_->io().get_executor(), Members().endpoints(), milliseconds(1000), nullptr);
    TxnRequest request;
    request.success.Put(key, value);
    std::optional<bool> is_put;
    boost::asio::co_spawn(
        harness_->io(),
        [&]() -> boost::asio::awaitable<void> {
          const std::string path = kTxnPath;
          const std::string body = request.Text();
          is_put = (co_await client->Call(path, body)).ok();
        },
        boost::asio::detached);
    return harness_->RunUntil([&] { return is_put.has_value(); }) && *is_put;
  }

 private:
  std::unique_ptr<EtcdHarness> harness_;
};

TEST_F(EtcdLogTest, AfterALostAnswerTheSameGroupIsCommitted) {
  const std::unique_ptr<Relay> relay = NewRelay();
  Follower follower(harness(), 1);
  settings().members = {relay->endpoint()};
  settings().patience = milliseconds(100);
  WaitingLog leader(harness());
  const Term term = leader.TakeLead(0, "a").term;
  const Group group = MakeGroup(term, 1, 3);
  relay->SetDecide([](std::string_view) { return Relay::Fate::kLoseAnswer; });
  EXPECT_EQ(leader.TryAppend(group), Appended::kUnknown);
  EXPECT_TRUE(follower.AwaitGroups(1)) << "it was written";
  relay->SetDecide(nullptr);
  EXPECT_EQ(leader.Append(group), Appended::kCommitted);
}

TEST_F(EtcdLogTest, AfterALostRequestTheGroupIsFencedIfAnotherLeads) {
  const std::unique_ptr<Relay> relay = NewRelay();
  WaitingLog other(harness());
  settings().members = {relay->endpoint()};
  settings().patience = milliseconds(100);
  WaitingLog leader(harness());
  const Term term = leader.TakeLead(0, "a").term;
  const Group group = MakeGroup(term, 1, 3);
  relay->SetDecide([](std::string_view) { return Relay::Fate::kSwallow; });
  EXPECT_EQ(leader.TryAppend(group), Appended::kUnknown);
  ASSERT_EQ(other.TakeLead(term, "b").node, "b");
  relay->SetDecide(nullptr);
  EXPECT_EQ(leader.Append(group), Appended::kFenced);
}

TEST_F(EtcdLogTest, ALostAnswerIsAskedForAtTheNextMember) {
  const std::unique_ptr<Relay> relay = NewRelay();
  std::vector<std::string> told;
  settings().members = {relay->endpoint(), Members().endpoints()[1]};
  settings().patience = milliseconds(300);
  settings().on_member = [&](const Endpoint& endpoint, const Status& status) {
    told.push_back(ToText(endpoint) + " " + status.ErrorOr("responds"));
  };
  WaitingLog leader(harness());
  const Term term = leader.TakeLead(0, "a").term;
  relay->SetDecide([](std::string_view) { return Relay::Fate::kLoseAnswer; });
  EXPECT_EQ(leader.Append(MakeGroup(term, 1, 3)), Appended::kCommitted);
  const std::string where = ToText(relay->endpoint());
  const auto is_told = [&](const std::string& what) {
    return std::find(told.begin(), told.end(), where + what) != told.end();
  };
  EXPECT_TRUE(is_told(" etcd at " + where + ": no answer within 300 ms"));
  told.clear();
  relay->SetDecide(nullptr);  // a probe notices it
  EXPECT_TRUE(harness()->RunUntil([&] { return is_told(" responds"); }));
}

TEST_F(EtcdLogTest, AMemberThatComesAndGoesHasOneProbe) {
  const std::unique_ptr<Relay> relay = NewRelay();
  size_t probes = 0;
  relay->SetDecide([&](std::string_view request) {
    const bool is_probe = request.starts_with("POST /v3/kv/range");
    probes += is_probe ? 1u : 0u;
    return is_probe ? Relay::Fate::kHold : Relay::Fate::kPass;
  });
  const auto new_client = [&](const Endpoint& member, EtcdClient::OnMember on_member) {
    return std::make_shared<EtcdClient>(harness()->io().get_executor(),
                                        std::vector<Endpoint>{member}, std::chrono::minutes(1),
                                        std::move(on_member));
  };
  const auto client = new_client(relay->endpoint(), nullptr);
  bool is_down = false;
  boost::asio::co_spawn(
      harness()->io(),
      [&]() -> boost::asio::awaitable<void> {
        const std::string path = kStatusPath;
        const std::string body = "{}";
        for (int i = 0; i < 3; ++i) {
          static_cast<void>(co_await client->Call(path, body));  // it is up
          client->SetDown(0, Error{"down"});
        }
        is_down = true;
      },
      boost::asio::detached);
  ASSERT_TRUE(harness()->RunUntil([&] { return is_down; }));
  // When this one was probed twice, the other was probed by all that probe it.
  size_t responds = 0;
  const auto later =
      new_client(Members().endpoints()[1],
                 [&](const Endpoint&, const Status& status) { responds += status.ok() ? 1u : 0u; });
  for (const size_t times : {1u, 2u}) {
    later->SetDown(0, Error{"down"});
    ASSERT_TRUE(harness()->RunUntil([&] { return responds == times; }));
  }
  EXPECT_EQ(probes, 1u);
}

TEST_F(EtcdLogTest, ALostAnswerToTakeLeadMayHaveSucceeded) {
  const std::unique_ptr<Relay> relay = NewRelay();
  settings().patience = milliseconds(100);
  Follower follower(harness(), 1);
  settings().members = {relay->endpoint()};
  relay->SetDecide([](std::string_view) { return Relay::Fate::kLoseAnswer; });
  WaitingLog leader(harness());
  const Result<Leader> unknown = leader.TryTakeLead(0, "a");
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.error(), "etcd at " + ToText(relay->endpoint()) + ": no answer within 100 ms");
  EXPECT_TRUE(follower.Await([](const Page& page) { return page.leader.node == "a"; }));
}

TEST_F(EtcdLogTest, WhatIsNotEtcdIsAnErrorThatNamesIt) {
  const std::unique_ptr<Relay> relay = NewRelay();
  const std::string where = "etcd at " + ToText(relay->endpoint());
  settings().members = {relay->endpoint()};
  relay->SetDecide([](std::string_view) { return Relay::Fate::kMakeUp; });
  WaitingLog log(harness());
  const auto error_of = [&](const std::string& body, int status) {
    relay->SetMadeUp(body, status);
    const Result<Leader> leader = log.TryTakeLead(0, "a");
    return leader.ok() ? "no error" : std::string(leader.error());
  };
  EXPECT_TRUE(error_of("<html>", 200).starts_with(where + ": not JSON: "));
  EXPECT_EQ(error_of("{}", 200),
            where + R"(: field "header.revision": expected a number in a string)");
  EXPECT_EQ(error_of("Not Found", 404), where + R"(: /v3/kv/txn: status 404: "Not Found")");
  EXPECT_EQ(error_of(R"({"message":"etcdserver: no leader","code":14})", 503),
            where + ": /v3/kv/txn: status 503: etcdserver: no leader");
  EXPECT_EQ(log.TryAppend(MakeGroup(1, 1, 1)), Appended::kUnknown);
  EXPECT_FALSE(log.Trim(5).ok());
  Follower follower(harness(), 1);
  EXPECT_TRUE(harness()->RunUntil([&] { return !follower.errors().empty(); }));
  relay->SetDecide(nullptr);
  EXPECT_TRUE(follower.AwaitPage());
}

TEST_F(EtcdLogTest, AFollowerReadsOnWhenTheMemberThatItWatchesIsKilled) {
  ASSERT_TRUE(Transfer(harness(), settings()).ok());  // it leads, too
  Follower follower(harness(), 2);
  settings().members = {Members().endpoints()[1], Members().endpoints()[2]};
  settings().patience = milliseconds(300);
  WaitingLog leader(harness());
  const Term term = leader.TakeLead(0, "a").term;
  std::vector<Group> groups;
  for (Sequence first = 1; first <= 60; first += 3) {
    if (first == 31) {
      Members().Kill(0);
    }
    groups.push_back(MakeGroup(term, first, 3));
    ASSERT_EQ(leader.Append(groups.back()), Appended::kCommitted);
  }
  ASSERT_TRUE(follower.AwaitGroups(groups.size()));
  EXPECT_EQ(follower.groups(), groups);
}

TEST_F(EtcdLogTest, AFollowerGoesOnWhenAllMembersWereDown) {
  settings().patience = milliseconds(200);
  WaitingLog leader(harness());
  Follower follower(harness(), 1);
  const Term term = leader.TakeLead(0, "a").term;
  std::vector<Group> groups = {MakeGroup(term, 1, 2)};
  ASSERT_EQ(leader.Append(groups[0]), Appended::kCommitted);
  ASSERT_TRUE(follower.AwaitGroups(1));
  for (size_t member = 0; member < EtcdMembers::kCount; ++member) {
    Members().Kill(member);
  }
  groups.push_back(MakeGroup(term, 3, 2));
  EXPECT_EQ(leader.TryAppend(groups[1]), Appended::kUnknown);
  EXPECT_TRUE(harness()->RunUntil([&] { return !follower.errors().empty(); }));
  for (size_t member = 0; member < EtcdMembers::kCount; ++member) {
    Members().Start(member);
  }
  EXPECT_EQ(leader.Append(groups[1]), Appended::kCommitted);
  ASSERT_TRUE(follower.AwaitGroups(2));
  EXPECT_EQ(follower.groups(), groups);
}

TEST_F(EtcdLogTest, AStuckWatchIsNoticed) {
  const std::unique_ptr<Relay> relay = NewRelay();
  relay->SetDecide([](std::string_view request) {
    return IsWatch(request) ? Relay::Fate::kSwallow : Relay::Fate::kPass;
  });
  WaitingLog leader(harness());
  settings().members = {relay->endpoint()};
  settings().patience = milliseconds(300);
  Follower follower(harness(), 1);
  ASSERT_TRUE(follower.AwaitPage());
  const Term term = leader.TakeLead(0, "a").term;
  const std::vector<Group> groups = {MakeGroup(term, 1, 2), MakeGroup(term, 3, 2)};
  for (const Group& group : groups) {
    ASSERT_EQ(leader.Append(group), Appended::kCommitted);
  }
  ASSERT_TRUE(follower.AwaitGroups(2));
  EXPECT_EQ(follower.groups(), groups);
}

// A follower whose watch is to begin with what was compacted meanwhile.
TEST_F(EtcdLogTest, AFollowerReadsOnAfterACompaction) {
  const std::unique_ptr<Relay> relay = NewRelay();
  WaitingLog leader(harness());
  const Term term = leader.TakeLead(0, "a").term;
  settings().members = {relay->endpoint()};
  settings().patience = std::chrono::minutes(1);  // with the watch that is held up
  settings().silence = std::chrono::minutes(1);
  std::vector<Group> groups = {MakeGroup(term, 1, 2)};
  ASSERT_EQ(leader.Append(groups[0]), Appended::kCommitted);
  size_t watches = 0;
  relay->SetDecide([&](std::string_view request) {
    watches += IsWatch(request) ? 1u : 0u;
    return IsWatch(request) && watches == 1 ? Relay::Fate::kHold : Relay::Fate::kPass;
  });
  Follower follower(harness(), 1);
  ASSERT_TRUE(follower.AwaitGroups(1));
  ASSERT_TRUE(harness()->RunUntil([&] { return watches == 1; }));
  for (const Sequence floor : {Sequence{2}, Sequence{3}}) {
    groups.push_back(MakeGroup(term, 2 * floor - 1, 2));
    ASSERT_EQ(leader.Append(groups.back()), Appended::kCommitted);
    const Status trimmed = leader.Trim(floor);
    ASSERT_TRUE(trimmed.ok()) << trimmed.error();
  }
  relay->Release();
  ASSERT_TRUE(follower.AwaitGroups(groups.size()));
  EXPECT_EQ(follower.groups(), groups);
  EXPECT_TRUE(harness()->RunUntil([&] { return watches == 2; }));
}

// Without a compaction: to begin again at once would ask without end.
TEST_F(EtcdLogTest, AWatchThatIsCanceledIsToldAndBegunAgain) {
  const std::unique_ptr<Relay> relay = NewRelay();
  WaitingLog leader(harness());
  const Term term = leader.TakeLead(0, "a").term;
  size_t watches = 0;
  relay->SetMadeUp(R"({"result":{"canceled":true,"cancel_reason":"no leader"}})"
                   "\n");
  relay->SetDecide([&](std::string_view request) {
    watches += IsWatch(request) ? 1u : 0u;
    return IsWatch(request) && watches == 1 ? Relay::Fate::kMakeUp : Relay::Fate::kPass;
  });
  settings().members = {relay->endpoint()};
  Follower follower(harness(), 1);
  ASSERT_TRUE(harness()->RunUntil([&] { return watches == 2; }));
  EXPECT_EQ(follower.errors(), std::vector<std::string>{"etcd at " + ToText(relay->endpoint()) +
                                                        ": etcd canceled the watch: no leader"});
  const std::vector<Group> groups = {MakeGroup(term, 1, 2)};
  ASSERT_EQ(leader.Append(groups[0]), Appended::kCommitted);
  ASSERT_TRUE(follower.AwaitGroups(1));
  EXPECT_EQ(follower.groups(), groups);
}

TEST_F(EtcdLogTest, AGroupWhosePieceCannotBeReadIsReadAgain) {
  const std::unique_ptr<Relay> relay = NewRelay();
  WaitingLog leader(harness());
  const Term term = leader.TakeLead(0, "a").term;
  const std::vector<Group> groups = {MakeGroup(term, 1, 1), MakeGroup(term, 2, 3, 2'000'000),
                                     MakeGroup(term, 5, 1)};
  for (const Group& group : groups) {
    ASSERT_EQ(leader.Append(group), Appended::kCommitted);
  }
  // Once, of the second piece.
  const std::string key = ToBase64(EtcdKeys(settings().cluster).Piece(groups[1], 1));
  bool has_failed = false;
  relay->SetMadeUp("Not Found", 404);
  relay->SetDecide([&](std::string_view request) {
    const bool fails = !has_failed && request.find(key) != std::string_view::npos;
    has_failed = has_failed || fails;
    return fails ? Relay::Fate::kMakeUp : Relay::Fate::kPass;
  });
  settings().members = {relay->endpoint()};
  Follower follower(harness(), 1);
  ASSERT_TRUE(follower.AwaitGroups(3));
  EXPECT_TRUE(has_failed);
  EXPECT_EQ(follower.errors().size(), 1u);
  EXPECT_TRUE(follower.groups() == groups);
}

// A process that begins with it would take a page without it for a log that has lost it.
TEST_F(EtcdLogTest, AFirstGroupWhosePieceCannotBeReadIsNotToldAsMissing) {
  const std::unique_ptr<Relay> relay = NewRelay();
  WaitingLog leader(harness());
  const Term term = leader.TakeLead(0, "a").term;
  const Group group = MakeGroup(term, 1, 3, 2'000'000);
  ASSERT_EQ(leader.Append(group), Appended::kCommitted);
  const std::string key = ToBase64(EtcdKeys(settings().cluster).Piece(group, 0));
  bool has_failed = false;
  relay->SetMadeUp("Not Found", 404);
  relay->SetDecide([&](std::string_view request) {
    const bool fails = !has_failed && request.find(key) != std::string_view::npos;
    has_failed = has_failed || fails;
    return fails ? Relay::Fate::kMakeUp : Relay::Fate::kPass;
  });
  settings().members = {relay->endpoint()};
  Follower follower(harness(), 3);
  ASSERT_TRUE(follower.AwaitPage());
  EXPECT_TRUE(has_failed);
  EXPECT_EQ(follower.errors().size(), 1u);
  EXPECT_TRUE(follower.groups() == std::vector<Group>{group});
}

TEST_F(EtcdLogTest, TransferMovesTheLeadershipToTheOwnMember) {
  const std::vector<Endpoint> all = Members().endpoints();
  for (size_t own = 0; own < all.size(); ++own) {
    settings().members = {all[own], all[(own + 1) % 3], all[(own + 2) % 3]};
    const Status transferred = Transfer(harness(), settings());
    EXPECT_TRUE(transferred.ok()) << transferred.error();

    const auto client = std::make_shared<EtcdClient>(harness()->io().get_executor(), all,
                                                     milliseconds(1000), nullptr);
    std::optional<Result<std::string>> text;
    boost::asio::co_spawn(
        harness()->io(),
        [&]() -> boost::asio::awaitable<void> {
          const std::string path = kStatusPath;
          const std::string body = "{}";
          text = co_await client->CallMember(own, path, body);
        },
        boost::asio::detached);
    ASSERT_TRUE(harness()->RunUntil([&] { return text.has_value(); }));
    ASSERT_TRUE(text->ok()) << text->error();
    const Result<StatusAnswer> status = ParseStatus(text->value());
    ASSERT_TRUE(status.ok()) << status.error();
    EXPECT_EQ(status.value().leader, status.value().member) << own;
  }
}

TEST_F(EtcdLogTest, AStoredGroupThatIsDamagedIsAnErrorThatNamesItsKey) {
  WaitingLog leader(harness());
  const Term term = leader.TakeLead(0, "a").term;
  ASSERT_EQ(leader.Append(MakeGroup(term, 1, 2)), Appended::kCommitted);
  const std::string key = EtcdKeys(settings().cluster).Log(3);
  ASSERT_TRUE(Put(key, "nonsense"));
  Follower follower(harness(), 1);
  ASSERT_TRUE(harness()->RunUntil([&] { return !follower.errors().empty(); }));
  EXPECT_EQ(follower.groups().size(), 1u);
  EXPECT_TRUE(follower.errors().front().starts_with("etcd at 127.0.0.1:"));
  EXPECT_TRUE(follower.errors().front().ends_with(": key " + key +
                                                  ": a group of 8 bytes, expected at least 21"))
      << follower.errors().front();
}

// Its revisions, and so the terms, begin anew.
TEST_F(EtcdLogTest, AnotherClusterInItsPlaceFencesALeader) {
  WaitingLog leader(harness());
  const Term term = leader.TakeLead(0, "a").term;
  const Group group = MakeGroup(term, 1, 2);
  ASSERT_EQ(leader.Append(group), Appended::kCommitted);
  ASSERT_TRUE(Put(EtcdKeys(settings().cluster).id(), "another"));
  EXPECT_EQ(leader.Append(MakeGroup(term, 3, 2)), Appended::kFenced);
  EXPECT_EQ(leader.Append(group), Appended::kFenced);
}

TEST_F(EtcdLogTest, AnotherClusterInItsPlaceIsToldToWhoOnlyFollows) {
  WaitingLog leader(harness());
  const Term term = leader.TakeLead(0, "a").term;
  const std::vector<Group> groups = {MakeGroup(term, 1, 2), MakeGroup(term, 3, 2)};
  ASSERT_EQ(leader.Append(groups[0]), Appended::kCommitted);
  Follower follower(harness(), 1);
  ASSERT_TRUE(follower.AwaitGroups(1));
  const std::string key = EtcdKeys(settings().cluster).id();
  ASSERT_TRUE(Put(key, "another"));
  ASSERT_TRUE(harness()->RunUntil([&] { return !follower.errors().empty(); }));
  EXPECT_TRUE(follower.errors().front().ends_with(
      ": key " + key + ": found \"another\", expected \"" + settings().new_id +
      "\": this is another log; check addresses and data of etcd"))
      << follower.errors().front();
  std::optional<bool> is_taken;
  follower.log().TakeLead(term, "b", [&](const Result<Leader>& now) { is_taken = now.ok(); });
  ASSERT_TRUE(harness()->RunUntil([&] { return is_taken.has_value(); }));
  EXPECT_FALSE(*is_taken);
  ASSERT_TRUE(Put(key, settings().new_id));  // the addresses were wrong
  ASSERT_EQ(leader.Append(groups[1]), Appended::kCommitted);
  ASSERT_TRUE(follower.AwaitGroups(2));
  EXPECT_EQ(follower.groups(), groups);
}

}  // namespace
}  // namespace pheromone::cluster
