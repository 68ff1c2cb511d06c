// Connections of peers that end, and what becomes of them.
#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <boost/asio/awaitable.hpp>

#include "server/cluster/peer_connection.h"
#include "server/cluster/peers.h"
#include "server/cluster/testing/peers_fixture.h"

namespace pheromone::cluster {
namespace {

namespace asio = boost::asio;
using namespace std::chrono_literals;

class PeersEndsTest : public PeersFixture {};

TEST_F(PeersEndsTest, ANodeThatDoesNotReadIsDroppedBeforeItsQueueIsLarge) {
  const auto b = Make("b");
  const auto a = Make("a");
  ASSERT_TRUE(RunUntil([&] { return a->IsUp("b") && b->IsUp("a"); }));
  size_t sent = 0;
  while (b->peers->Send("a", LongMessage(sent))) {  // nothing is read meanwhile
    ASSERT_LT(++sent * 100'000, Peers::kMaxQueuedBytes);
    EXPECT_GE(b->StateOf("a").queued_bytes, sent * 100'000);
  }
  EXPECT_GT((sent + 2) * 100'100, Peers::kMaxQueuedBytes);
  EXPECT_FALSE(b->IsUp("a"));
  ASSERT_TRUE(RunUntil([&] { return b->downs.size() == 1; }));
  EXPECT_TRUE(b->WasDown("a: the other side does not read: "));
  ASSERT_TRUE(RunUntil([&] { return b->IsUp("a") && a->IsUp("b"); }));  // and again
}

TEST_F(PeersEndsTest, ANodeThatDoesNotReadForAWhileIsDropped) {
  const auto b = Make("b", [](PeersSettings* it) { it->times.stuck = 200ms; });
  const auto relay = MakeRelay("b");
  const auto a = Make("a");
  ASSERT_TRUE(RunUntil([&] { return a->IsUp("b") && b->IsUp("a"); }));
  relay->Hold(false, true);
  for (uint64_t i = 0; i < 80; ++i) {  // more than sockets keep
    ASSERT_TRUE(b->peers->Send("a", LongMessage(i)));
  }
  ASSERT_TRUE(RunUntil([&] { return !b->downs.empty(); }));
  EXPECT_EQ(b->downs.front(), "a: the other side does not read: nothing can be sent for 200 ms");
}

TEST_F(PeersEndsTest, ADeadConnectionIsNoticedAndDialedAgain) {
  const auto quick = [](PeersSettings* it) {
    it->times.silence = 500ms;
    it->times.open = 500ms;
  };
  const auto b = Make("b", quick);
  const auto relay = MakeRelay("b");
  const auto a = Make("a", quick);
  const auto beats_of_a = BeatOften(a.get());
  const auto beats_of_b = BeatOften(b.get());
  ASSERT_TRUE(RunUntil([&] { return a->messages.size() > 5 && b->messages.size() > 5; }));
  relay->Hold(true, true);  // neither end is told
  ASSERT_TRUE(RunUntil([&] { return !a->downs.empty() && !b->downs.empty(); }));
  EXPECT_EQ(a->downs.back(), "b: silent for 500 ms");
  relay->Hold(false, false);
  ASSERT_TRUE(RunUntil([&] { return a->IsUp("b") && b->IsUp("a"); }));
  EXPECT_GE(a->StateOf("b").times_up, 2u);
}

TEST_F(PeersEndsTest, AClosedConnectionIsDialedAgain) {
  const auto b = Make("b");
  const auto relay = MakeRelay("b");
  const auto a = Make("a");
  ASSERT_TRUE(RunUntil([&] { return a->IsUp("b") && b->IsUp("a"); }));
  relay->Cut();
  ASSERT_TRUE(RunUntil([&] { return a->ups.size() == 2 && b->ups.size() == 2; }));
  EXPECT_EQ(a->downs.size(), 1u);
  EXPECT_EQ(b->downs.size(), 1u);
}

TEST_F(PeersEndsTest, ANodeThatStartsLaterIsFound) {
  const auto b = Make("b");
  const uint16_t port = ports_["b"];
  auto first = Make("a");
  ASSERT_TRUE(RunUntil([&] { return first->IsUp("b") && b->IsUp("a"); }));
  b->peers->Stop();
  ASSERT_TRUE(RunUntil([&] { return !first->IsUp("b"); }));
  ASSERT_TRUE(RunUntil([&] { return first->IsRefused("b", "cannot connect to 127.0.0.1:"); }));
  const auto again = Make("b", [port](PeersSettings* it) { it->nodes["b"] = {"127.0.0.1", port}; });
  ASSERT_TRUE(RunUntil([&] { return first->IsUp("b") && again->IsUp("a"); }));
  EXPECT_TRUE(b->downs.empty());  // a stopped one says nothing
}

TEST_F(PeersEndsTest, AProcessThatDialsAgainReplacesItsConnection) {
  const auto b = Make("b");
  const Talk talk = [](std::shared_ptr<PeerConnection> it) -> asio::awaitable<void> {
    it->Send(EncodePeerMessage(GreetingFrom("a", 77)).value(), Lane::kUrgent);
    for (bool is_open = true; is_open;) {
      const Result<PeerMessage> message = co_await it->Receive();
      is_open = message.ok();
    }
  };
  Pretend("a", talk);
  ASSERT_TRUE(RunUntil([&] { return b->ups.size() == 1; }));
  Pretend("a", talk);
  ASSERT_TRUE(RunUntil([&] { return b->ups.size() == 2; }));
  EXPECT_EQ(b->downs, std::vector<std::string>{"a: replaced by a new connection"});
  EXPECT_TRUE(b->IsUp("a"));
}

TEST_F(PeersEndsTest, StopMayBeCalledByACallbackAndIsTheLast) {
  const auto b = Make("b");
  std::unique_ptr<Peers> a;
  int calls = 0;
  PeersSettings settings;
  settings.own = GreetingFrom("a", 9);
  settings.nodes = {{"a", {"127.0.0.1", 0}}, {"b", {"127.0.0.1", ports_["b"]}}};
  settings.secret = kSecret;
  settings.times = kPatient;
  const auto stop = [&](const std::string&, const auto&) {
    ++calls;
    a.reset();
  };
  a = std::make_unique<Peers>(io_.get_executor(), settings,
                              PeersCallbacks{.on_message = stop, .on_up = stop, .on_down = stop});
  ASSERT_TRUE(a->Listen().ok());
  ASSERT_TRUE(RunUntil([&] { return !b->downs.empty(); }));
  EXPECT_EQ(calls, 1);
}

TEST_F(PeersEndsTest, WhatACallbackThrowsIsToldAndTheNodeIsDialedAgain) {
  const auto b = Make("b");
  const auto relay = MakeRelay("b");
  const auto a = Make("a");
  ASSERT_TRUE(RunUntil([&] { return a->IsUp("b") && b->IsUp("a"); }));
  a->throws_at_down = 1;
  relay->Cut();
  ASSERT_TRUE(RunUntil([&] { return a->ups.size() == 2 && b->ups.size() == 2; }));
  EXPECT_EQ(a->warnings, std::vector<std::string>{"internal error: planted"});
}

}  // namespace
}  // namespace pheromone::cluster
