// Nodes that are connected, and what they send.
#include "server/cluster/peers.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/strand.hpp>

#include "server/cluster/testing/peers_fixture.h"

namespace pheromone::cluster {
namespace {

namespace asio = boost::asio;

class PeersTest : public PeersFixture {};

TEST_F(PeersTest, ThreeNodesAreConnectedWithEachOther) {
  const auto c = Make("c");
  const auto b = Make("b");
  const auto a = Make("a");
  ASSERT_TRUE(RunUntil([&] {
    return a->IsUp("b") && a->IsUp("c") && b->IsUp("a") && b->IsUp("c") && c->IsUp("a") &&
           c->IsUp("b");
  }));
  EXPECT_EQ(b->ups.size(), 2u);
  EXPECT_EQ(b->peers->SendAll(Heartbeat{.term = 5}), 2u);
  EXPECT_TRUE(a->peers->Send("c", StateRequest{.number = 6}));
  EXPECT_FALSE(a->peers->Send("d", Heartbeat{}));
  EXPECT_FALSE(a->peers->Send("a", Heartbeat{}));
  ASSERT_TRUE(RunUntil([&] { return a->messages.size() == 1 && c->messages.size() == 2; }));
  EXPECT_EQ(a->messages.front().first, "b");
  EXPECT_EQ(std::get<Heartbeat>(a->messages.front().second).term, 5u);
  EXPECT_EQ(a->StateOf("b").program, "0.1.0");
  EXPECT_EQ(a->StateOf("b").times_up, 1u);
  EXPECT_TRUE(a->StateOf("b").heard);
}

TEST_F(PeersTest, MessagesArriveInOrderBothWays) {
  const auto b = Make("b");
  const auto a = Make("a");
  ASSERT_TRUE(RunUntil([&] { return a->IsUp("b") && b->IsUp("a"); }));
  constexpr uint64_t kMany = 5'000;
  for (uint64_t i = 0; i < kMany; ++i) {
    ASSERT_TRUE(a->peers->Send("b", StateRequest{.number = i}));
    ASSERT_TRUE(b->peers->Send("a", StateRequest{.number = i}));
  }
  ASSERT_TRUE(RunUntil([&] { return a->messages.size() == kMany && b->messages.size() == kMany; }));
  for (uint64_t i = 0; i < kMany; ++i) {
    ASSERT_EQ(std::get<StateRequest>(a->messages[i].second).number, i);
    ASSERT_EQ(std::get<StateRequest>(b->messages[i].second).number, i);
  }
  EXPECT_EQ(a->StateOf("b").queued_bytes, 0u);
}

TEST_F(PeersTest, HeartbeatsAndHaltsOvertakeAndPortionsComeLast) {
  const auto b = Make("b");
  const auto a = Make("a");
  ASSERT_TRUE(RunUntil([&] { return a->IsUp("b") && b->IsUp("a"); }));
  EXPECT_TRUE(a->peers->Send("b", StateRequest{.number = 1}));  // is being sent now
  for (uint64_t i = 0; i < Peers::kMaxPortions; ++i) {
    EXPECT_TRUE(a->peers->Send(
        "b", StatePortion{.number = i, .bytes = std::string(kMaxPortionBytes, 'p')}));
  }
  EXPECT_FALSE(a->peers->Send("b", StatePortion{}));
  EXPECT_TRUE(a->peers->Send("b", LongMessage(2)));
  EXPECT_TRUE(a->peers->Send("b", LongMessage(3)));
  EXPECT_TRUE(a->peers->Send("b", Heartbeat{.term = 1}));
  EXPECT_TRUE(a->peers->Send("b", HaltAll{}));
  EXPECT_TRUE(a->peers->Send("b", Heartbeat{.term = 2}));  // instead of the other one
  ASSERT_TRUE(RunUntil([&] { return b->messages.size() == 5 + Peers::kMaxPortions; }));
  std::vector<size_t> types;
  for (const auto& [from, message] : b->messages) {
    types.push_back(message.index());
  }
  EXPECT_EQ(types, (std::vector<size_t>{9, 1, 7, 6, 6, 10, 10, 10, 10}));
  EXPECT_EQ(std::get<Heartbeat>(b->messages[1].second).term, 2u);
  EXPECT_TRUE(a->peers->Send("b", StatePortion{}));
}

TEST_F(PeersTest, AMessageThatIsTooLongIsNotSent) {
  const auto b = Make("b");
  const auto a = Make("a");
  ASSERT_TRUE(RunUntil([&] { return a->IsUp("b"); }));
  EXPECT_FALSE(a->peers->Send("b", StatePortion{.bytes = std::string(kMaxPeerBytes, 'x')}));
  EXPECT_TRUE(a->IsUp("b"));
}

TEST_F(PeersTest, AnAddressThatIsNotOursIsAnError) {
  PeersSettings settings;
  settings.own = GreetingFrom("a", 9);
  settings.nodes = {{"a", {"192.0.2.1", 0}}};  // RFC 5737
  settings.secret = kSecret;
  Peers peers(io_.get_executor(), settings, {});
  EXPECT_NE(peers.Listen().ErrorOr("").find("cannot listen on 192.0.2.1 port 0: "),
            std::string::npos);
}

// On a strand of two threads.
TEST(PeersOnThreads, AreOnOneExecutor) {
  asio::io_context io;
  const auto strand = asio::make_strand(io);
  uint16_t port = 0;
  constexpr uint64_t kMany = 2'000;
  uint64_t heard = 0;
  std::unique_ptr<Peers> a;
  std::unique_ptr<Peers> b;
  const auto settings = [&port](const std::string& node) {
    PeersSettings its;
    its.own = GreetingFrom(node, node == "a" ? 1 : 2);
    its.nodes = {{"a", {"127.0.0.1", 0}}, {"b", {"127.0.0.1", port}}};
    its.secret = kSecret;
    its.times = kPatient;
    return its;
  };
  asio::post(strand, [&] {
    b = std::make_unique<Peers>(strand, settings("b"),
                                PeersCallbacks{.on_message =
                                                   [&](const std::string&, const PeerMessage&) {
                                                     if (++heard == kMany) {
                                                       a.reset();
                                                       b->Stop();
                                                     }
                                                   },
                                               .on_up = {},
                                               .on_down = {}});
    ASSERT_TRUE(b->Listen().ok());
    port = b->port();
    a = std::make_unique<Peers>(strand, settings("a"),
                                PeersCallbacks{.on_message = {},
                                               .on_up =
                                                   [&](const std::string&, const Greeting&) {
                                                     for (uint64_t i = 0; i < kMany; ++i) {
                                                       a->Send("b", StateRequest{.number = i});
                                                     }
                                                   },
                                               .on_down = {}});
    ASSERT_TRUE(a->Listen().ok());
  });
  std::thread other([&io] { io.run(); });
  io.run();  // until both have stopped
  other.join();
  EXPECT_EQ(heard, kMany);
}

}  // namespace
}  // namespace pheromone::cluster
