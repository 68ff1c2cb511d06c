// Who is refused by peers, and what is said of them.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <list>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/system/error_code.hpp>

#include "server/cluster/peer_connection.h"
#include "server/cluster/peers.h"
#include "server/cluster/testing/peers_fixture.h"

namespace pheromone::cluster {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;
using namespace std::chrono_literals;

class PeersStrangersTest : public PeersFixture {};

TEST_F(PeersStrangersTest, WhoHasAnotherSecretIsRefused) {
  const auto b = Make("b");
  const auto a = Make("a", [](PeersSettings* it) { it->secret[31] = 'S'; });
  ASSERT_TRUE(RunUntil([&] {
    return b->peers->strangers().count >= 2 &&
           a->IsRefused("b", "expected a node of this cluster that has the same secret");
  }));
  EXPECT_TRUE(b->HasRefused("expected a node of this cluster that has the same secret"));
  EXPECT_EQ(b->StateOf("a").why_down, "");  // it may be anybody
  EXPECT_TRUE(a->ups.empty() && b->ups.empty() && a->downs.empty() && b->downs.empty());
}

TEST_F(PeersStrangersTest, AnotherClusterIsRefusedByItsName) {
  const auto b = Make("b");
  const auto a = Make("a", [](PeersSettings* it) { it->own.cluster = "hall"; });
  ASSERT_TRUE(RunUntil([&] {
    return b->HasRefused("found a node that dials as \"hall/a/b\", expected \"lab/NODE/b\"");
  }));
  EXPECT_TRUE(a->ups.empty() && b->ups.empty());
}

TEST_F(PeersStrangersTest, OtherVersionsAndOtherLinksAreToldOnBothSides) {
  const auto b = Make("b");
  const auto a = Make("a", [](PeersSettings* it) { it->own.versions.events = 99; });
  const auto older = [](const std::string& whose) {
    return "upgrade " + whose + ": followers first, the leader last";
  };
  ASSERT_TRUE(RunUntil(
      [&] { return a->IsRefused("b", older("node b")) && b->IsRefused("a", older("this node")); }));
  a->peers->Stop();
  const auto again = Make("a", [](PeersSettings* it) { it->own.links_hash = 2; });
  ASSERT_TRUE(RunUntil([&] {
    return again->IsRefused("b", "has other links") && b->IsRefused("a", "has other links");
  }));
  EXPECT_TRUE(a->ups.empty() && b->ups.empty() && again->ups.empty());
}

TEST_F(PeersStrangersTest, AStrangerWithoutTlsIsClosed) {
  const auto b = Make("b");
  tcp::socket stranger(io_);
  stranger.connect(LocalPort(ports_["b"]));
  asio::write(stranger, asio::buffer(std::string_view("GET / HTTP/1.1\r\nHost: b\r\n\r\n")));
  ASSERT_TRUE(RunUntil([&] { return b->peers->strangers().count == 1; }));
  EXPECT_TRUE(b->HasRefused("no TLS handshake: "));
  EXPECT_TRUE(b->HasRefused("127.0.0.1:"));
}

TEST_F(PeersStrangersTest, StrangersAreToldInTheLogButNotEachOfThem) {
  const auto b = Make("b");
  const auto c = Make("c", [](PeersSettings* it) { it->times.quiet = 100ms; });
  const auto come = [this](const std::string& to) {
    tcp::socket stranger(io_);
    stranger.connect(LocalPort(ports_[to]));
    asio::write(stranger, asio::buffer(std::string_view("GET / HTTP/1.1\r\n\r\n")));
  };
  for (const uint64_t count : {1u, 2u, 3u}) {
    come("b");
    ASSERT_TRUE(RunUntil([&] { return b->peers->strangers().count == count; }));
  }
  ASSERT_EQ(b->warnings.size(), 1u);
  EXPECT_EQ(b->warnings[0].find("a connection that is of no node was closed: 127.0.0.1:"), 0u);
  EXPECT_NE(b->warnings[0].find(": no TLS handshake: "), std::string::npos);
  ASSERT_TRUE(RunUntil([&] {
    come("c");
    return !c->warnings.empty() && c->warnings.back().ends_with(" more since the last warning");
  }));
}

TEST_F(PeersStrangersTest, StrangersThatSayNothingAreLimitedAndInNobodysWay) {
  const auto b = Make("b");
  std::list<tcp::socket> strangers;
  constexpr size_t kBeyond = 3;
  for (size_t i = 0; i < Peers::kMaxStrangers + kBeyond; ++i) {
    strangers.emplace_back(io_).connect(LocalPort(ports_["b"]));
  }
  ASSERT_TRUE(RunUntil([&] { return b->peers->strangers().count == kBeyond; }));
  EXPECT_TRUE(b->HasRefused("closed to make room for others"));
  const auto a = Make("a");
  ASSERT_TRUE(RunUntil([&] { return a->IsUp("b") && b->IsUp("a"); }));
  EXPECT_TRUE(a->downs.empty());
}

TEST_F(PeersStrangersTest, AHandshakeThatDoesNotEndIsClosed) {
  const auto b = Make("b", [](PeersSettings* it) { it->times.open = 200ms; });
  tcp::socket stranger(io_);
  stranger.connect(LocalPort(ports_["b"]));
  bool is_closed = false;
  asio::co_spawn(
      io_,
      [&]() -> asio::awaitable<void> {  // a byte at a time, of a record that would be long
        const std::string record = "\x16\x03\x01\x3F\xFF\x01" + std::string(16'000, '\x01');
        error_code error;
        asio::steady_timer timer(io_);
        for (size_t i = 0; i < record.size() && !error; ++i) {
          co_await asio::async_write(stranger, asio::buffer(&record[i], 1),
                                     asio::redirect_error(asio::use_awaitable, error));
          timer.expires_after(5ms);
          co_await timer.async_wait(asio::use_awaitable);
        }
        is_closed = error.failed();
      },
      asio::detached);
  ASSERT_TRUE(RunUntil([&] { return is_closed; }));
  EXPECT_EQ(b->peers->strangers().count, 1u);
  EXPECT_TRUE(b->HasRefused("no TLS handshake within 200 ms"));
}

TEST_F(PeersStrangersTest, ASecondMachineWithANodesNameIsRefused) {
  const auto b = Make("b");
  const auto a = Make("a");
  ASSERT_TRUE(RunUntil([&] { return a->IsUp("b") && b->IsUp("a"); }));
  const auto second = Make("a");
  ASSERT_TRUE(RunUntil([&] { return b->peers->strangers().count >= 2; }));
  EXPECT_TRUE(b->HasRefused("node a is up, and another machine, 127.0.0.1:"));
  EXPECT_TRUE(a->IsUp("b") && a->downs.empty() && b->downs.empty());
  EXPECT_TRUE(second->ups.empty());
}

TEST_F(PeersStrangersTest, WhatNoPeerSaysEndsTheConnection) {
  const auto b = Make("b");
  const auto say = [this](const std::vector<std::string>& frames) {
    const auto has_ended = std::make_shared<bool>(false);
    Pretend("a", [frames, has_ended](std::shared_ptr<PeerConnection> it) -> asio::awaitable<void> {
      for (const std::string& frame : frames) {
        it->Send(frame, Lane::kUrgent);
      }
      for (bool is_open = true; is_open;) {
        const Result<PeerMessage> message = co_await it->Receive();
        is_open = message.ok();
      }
      *has_ended = true;
    });
    return RunUntil([&] { return *has_ended; });
  };
  const auto encoded = [](const PeerMessage& message) {
    return EncodePeerMessage(message).value();
  };
  const std::string greeting = encoded(GreetingFrom("a", 5));
  ASSERT_TRUE(say({encoded(GreetingFrom("c", 5))}));
  EXPECT_EQ(b->StateOf("a").why_down, "node a says that it is node c");
  ASSERT_TRUE(say({encoded(Heartbeat{})}));
  EXPECT_EQ(b->StateOf("a").why_down, "found a message of type 1, expected a greeting");
  EXPECT_TRUE(b->ups.empty());
  ASSERT_TRUE(say({greeting, greeting}));
  ASSERT_TRUE(RunUntil([&] { return b->downs.size() == 1; }));
  EXPECT_EQ(b->downs.back(), "a: found a second greeting");
  ASSERT_TRUE(say({greeting, std::string("\x01\0\0\0\xC8", 5)}));
  ASSERT_TRUE(RunUntil([&] { return b->downs.size() == 2; }));
  EXPECT_EQ(b->downs.back(), "a: found a message of type 200, expected 0 to 10");
  ASSERT_TRUE(say({greeting, std::string("\xFF\xFF\xFF\xFF", 4)}));
  ASSERT_TRUE(RunUntil([&] { return b->downs.size() == 3; }));
  EXPECT_EQ(b->downs.back(), "a: found a message of 4294967295 bytes, expected 1 to 131072");
}

}  // namespace
}  // namespace pheromone::cluster
