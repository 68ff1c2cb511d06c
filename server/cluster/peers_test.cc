// Peers over real sockets of this machine. Where a limit of time is not the subject, it is longer
// than any test takes.

#include "server/cluster/peers.h"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/socket_base.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/strand.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/system/error_code.hpp>

#include "server/cluster/peer_connection.h"
#include "server/cluster/peer_tls.h"

namespace pheromone::cluster {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;
using std::chrono::milliseconds;
using namespace std::chrono_literals;

const std::string kSecret(32, 's');
constexpr PeerTimes kPatient{
    .open = 600s, .silence = 600s, .stuck = 600s, .first_pause = 10ms, .longest_pause = 50ms};

tcp::endpoint LocalPort(uint16_t port) {
  return {asio::ip::make_address("127.0.0.1"), port};
}

Greeting GreetingFrom(const std::string& node, uint64_t instance) {
  return {.versions = {.program = "0.1.0"},
          .cluster = "lab",
          .node = node,
          .id = "",
          .links_hash = 1,
          .instance = instance};
}

// Between a node and the one that it dials; it can keep what it has read.
class Relay : public std::enable_shared_from_this<Relay> {
 public:
  Relay(asio::io_context* io, uint16_t to)
      : io_(io), acceptor_(*io, LocalPort(0)), to_(LocalPort(to)) {}

  void Start() {
    asio::co_spawn(
        *io_, [self = shared_from_this()] { return self->AcceptAll(); }, asio::detached);
  }
  uint16_t port() const { return acceptor_.local_endpoint().port(); }
  // Nothing more goes through, in one or both directions.
  void Hold(bool forth, bool back) {
    holds_forth_ = forth;
    holds_back_ = back;
  }
  void Cut() {
    for (const auto& socket : sockets_) {
      socket->close();
    }
    sockets_.clear();
  }

 private:
  using Socket = std::shared_ptr<tcp::socket>;

  asio::awaitable<void> AcceptAll() {
    const auto self = shared_from_this();
    error_code error;
    while (!error) {
      const auto near = std::make_shared<tcp::socket>(
          co_await acceptor_.async_accept(asio::redirect_error(asio::use_awaitable, error)));
      const auto far = std::make_shared<tcp::socket>(*io_);
      if (!error) {
        co_await far->async_connect(to_, asio::redirect_error(asio::use_awaitable, error));
        sockets_.push_back(near);
        sockets_.push_back(far);
        Pump(near, far, &holds_forth_);
        Pump(far, near, &holds_back_);
        error.clear();
      }
    }
  }

  void Pump(const Socket& from, const Socket& to, const bool* holds) {
    asio::co_spawn(
        *io_,
        [self = shared_from_this(), from, to, holds] { return self->PumpAll(from, to, holds); },
        asio::detached);
  }

  asio::awaitable<void> PumpAll(Socket from, Socket to, const bool* holds) {
    const auto self = shared_from_this();
    std::array<char, 4096> bytes{};
    error_code error;
    asio::steady_timer timer(*io_);
    while (!error) {
      const size_t size = co_await from->async_read_some(
          asio::buffer(bytes), asio::redirect_error(asio::use_awaitable, error));
      while (*holds) {
        timer.expires_after(1ms);
        co_await timer.async_wait(asio::use_awaitable);
      }
      if (!error) {
        co_await asio::async_write(*to, asio::buffer(bytes.data(), size),
                                   asio::redirect_error(asio::use_awaitable, error));
      }
    }
    from->close();
    to->close();
  }

  asio::io_context* const io_;
  tcp::acceptor acceptor_;
  const tcp::endpoint to_;
  std::list<Socket> sockets_;
  bool holds_forth_ = false;
  bool holds_back_ = false;
};

// A node with all that it has heard.
struct Daemon {
  std::vector<std::pair<std::string, PeerMessage>> messages;
  std::vector<std::string> ups;
  std::vector<std::string> downs;  // NODE: WHY
  std::unique_ptr<Peers> peers;

  bool IsUp(const std::string& node) const { return peers->IsUp(node); }
  PeerState StateOf(const std::string& node) const {
    for (PeerState& state : peers->states()) {
      if (state.node == node) {
        return std::move(state);
      }
    }
    return {};
  }
  bool IsRefused(const std::string& node, std::string_view why) const {
    return StateOf(node).why_down.find(why) != std::string::npos;
  }
  bool WasDown(std::string_view why) const {
    return !downs.empty() && downs.front().find(why) != std::string::npos;
  }
  bool HasRefused(std::string_view why) const {
    return peers->strangers().last.find(why) != std::string::npos;
  }
};

class PeersTest : public ::testing::Test {
 protected:
  using Change = std::function<void(PeersSettings*)>;

  // Nodes that are dialed are made before those that dial. `change` is what differs.
  std::unique_ptr<Daemon> Make(const std::string& node, const Change& change = nullptr) {
    auto daemon = std::make_unique<Daemon>();
    PeersSettings settings;
    settings.own = GreetingFrom(node, ++instances_);
    for (const std::string name : {"a", "b", "c"}) {
      settings.nodes[name] = {"127.0.0.1", name == node ? uint16_t{0} : ports_[name]};
    }
    settings.secret = kSecret;
    settings.times = kPatient;
    if (change) {
      change(&settings);
    }
    Daemon* const it = daemon.get();
    daemon->peers = std::make_unique<Peers>(
        io_.get_executor(), settings,
        PeersCallbacks{
            .on_message =
                [it](const std::string& from, PeerMessage message) {
                  it->messages.emplace_back(from, std::move(message));
                },
            .on_up = [it](const std::string& other, const Greeting&) { it->ups.push_back(other); },
            .on_down = [it](const std::string& other,
                            const std::string& why) { it->downs.push_back(other + ": " + why); }});
    const Status listens = daemon->peers->Listen();
    EXPECT_TRUE(listens.ok()) << listens.ErrorOr("");
    ports_[node] = daemon->peers->port();
    return daemon;
  }

  std::shared_ptr<Relay> MakeRelay(const std::string& to) {
    const auto relay = std::make_shared<Relay>(&io_, ports_[to]);
    relay->Start();
    ports_[to] = relay->port();
    return relay;
  }

  // Until it holds; false if that takes longer than anything should.
  template <typename Condition>
  bool RunUntil(Condition holds) {
    const auto end = std::chrono::steady_clock::now() + 120s;
    while (!holds()) {
      if (std::chrono::steady_clock::now() > end) {
        return false;
      }
      io_.run_one_for(100ms);
    }
    return true;
  }

  // Something that is not a node: dials b as `identity` says, and does `talk` after the handshake.
  using Talk = std::function<asio::awaitable<void>(std::shared_ptr<PeerConnection>)>;
  void Pretend(const std::string& as, Talk talk) {
    const auto tls = std::make_shared<const PeerTls>(kSecret, "lab",
                                                     std::vector<std::string>{"a", "b", "c"}, as);
    const auto it = std::make_shared<PeerConnection>(tcp::socket(io_), tls, "b");
    asio::co_spawn(
        io_,
        [it, talk, to = LocalPort(ports_["b"])]() -> asio::awaitable<void> {
          error_code error;
          co_await it->socket().async_connect(to, asio::redirect_error(asio::use_awaitable, error));
          const Status secure = co_await it->ShakeHands();
          EXPECT_TRUE(secure.ok());
          co_await talk(it);
        },
        asio::detached);
  }

  // Beats to all, as a daemon sends them, while it is there.
  std::shared_ptr<void> BeatOften(Daemon* daemon) {
    const auto timer = std::make_shared<asio::steady_timer>(io_);
    asio::co_spawn(
        io_,
        [timer = std::weak_ptr(timer), daemon]() -> asio::awaitable<void> {
          error_code ignored;
          for (auto it = timer.lock(); it != nullptr;) {
            daemon->peers->SendAll(Beat{});
            it->expires_after(5ms);
            auto wait = it->async_wait(asio::redirect_error(asio::use_awaitable, ignored));
            co_await std::move(wait);
            it.reset();
            it = timer.lock();
          }
        },
        asio::detached);
    return timer;
  }

  asio::io_context io_;
  std::map<std::string, uint16_t> ports_{
      {"a", uint16_t{1}}, {"b", uint16_t{1}}, {"c", uint16_t{1}}};
  uint64_t instances_ = 0;
};

TEST_F(PeersTest, ThreeNodesAreConnectedWithEachOther) {
  const auto c = Make("c");
  const auto b = Make("b");
  const auto a = Make("a");
  ASSERT_TRUE(RunUntil([&] {
    return a->IsUp("b") && a->IsUp("c") && b->IsUp("a") && b->IsUp("c") && c->IsUp("a") &&
           c->IsUp("b");
  }));
  EXPECT_EQ(b->ups.size(), 2u);
  EXPECT_EQ(b->peers->SendAll(Beat{.term = 5}), 2u);
  EXPECT_TRUE(a->peers->Send("c", StateRequest{.number = 6}));
  EXPECT_FALSE(a->peers->Send("d", Beat{}));
  EXPECT_FALSE(a->peers->Send("a", Beat{}));
  ASSERT_TRUE(RunUntil([&] { return a->messages.size() == 1 && c->messages.size() == 2; }));
  EXPECT_EQ(a->messages.front().first, "b");
  EXPECT_EQ(std::get<Beat>(a->messages.front().second).term, 5u);
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

// 100 000 bytes.
OperatorResult LongMessage(uint64_t number) {
  return {.number = number, .ok = false, .text = std::string(100'000, 'x')};
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
  EXPECT_TRUE(a->peers->Send("b", Beat{.term = 1}));
  EXPECT_TRUE(a->peers->Send("b", HaltAll{.number = 4}));
  EXPECT_TRUE(a->peers->Send("b", Beat{.term = 2}));  // instead of the other one
  ASSERT_TRUE(RunUntil([&] { return b->messages.size() == 5 + Peers::kMaxPortions; }));
  std::vector<size_t> types;
  for (const auto& [from, message] : b->messages) {
    types.push_back(message.index());
  }
  EXPECT_EQ(types, (std::vector<size_t>{10, 1, 7, 6, 6, 11, 11, 11, 11}));
  EXPECT_EQ(std::get<Beat>(b->messages[1].second).term, 2u);
  EXPECT_TRUE(a->peers->Send("b", StatePortion{}));
}

TEST_F(PeersTest, AMessageThatIsTooLongIsNotSent) {
  const auto b = Make("b");
  const auto a = Make("a");
  ASSERT_TRUE(RunUntil([&] { return a->IsUp("b"); }));
  EXPECT_FALSE(a->peers->Send("b", StatePortion{.bytes = std::string(kMaxPeerBytes, 'x')}));
  EXPECT_TRUE(a->IsUp("b"));
}

TEST_F(PeersTest, WhoHasAnotherSecretIsRefused) {
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

TEST_F(PeersTest, AnotherClusterIsRefusedByItsName) {
  const auto b = Make("b");
  const auto a = Make("a", [](PeersSettings* it) { it->own.cluster = "hall"; });
  ASSERT_TRUE(RunUntil([&] {
    return b->HasRefused("found a node that dials as \"hall/a/b\", expected \"lab/NODE/b\"");
  }));
  EXPECT_TRUE(a->ups.empty() && b->ups.empty());
}

TEST_F(PeersTest, OtherVersionsAndOtherLinksAreToldOnBothSides) {
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

TEST_F(PeersTest, AStrangerWithoutTlsIsClosed) {
  const auto b = Make("b");
  tcp::socket stranger(io_);
  stranger.connect(LocalPort(ports_["b"]));
  asio::write(stranger, asio::buffer(std::string_view("GET / HTTP/1.1\r\nHost: b\r\n\r\n")));
  ASSERT_TRUE(RunUntil([&] { return b->peers->strangers().count == 1; }));
  EXPECT_TRUE(b->HasRefused("no TLS handshake: "));
  EXPECT_TRUE(b->HasRefused("127.0.0.1:"));
}

TEST_F(PeersTest, StrangersThatSayNothingAreLimitedAndInNobodysWay) {
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

TEST_F(PeersTest, AHandshakeThatDoesNotEndIsClosed) {
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

TEST_F(PeersTest, ANodeThatDoesNotReadIsDroppedBeforeItsQueueIsLarge) {
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

TEST_F(PeersTest, ANodeThatDoesNotReadForAWhileIsDropped) {
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

TEST_F(PeersTest, ADeadConnectionIsNoticedAndDialedAgain) {
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

TEST_F(PeersTest, AClosedConnectionIsDialedAgain) {
  const auto b = Make("b");
  const auto relay = MakeRelay("b");
  const auto a = Make("a");
  ASSERT_TRUE(RunUntil([&] { return a->IsUp("b") && b->IsUp("a"); }));
  relay->Cut();
  ASSERT_TRUE(RunUntil([&] { return a->ups.size() == 2 && b->ups.size() == 2; }));
  EXPECT_EQ(a->downs.size(), 1u);
  EXPECT_EQ(b->downs.size(), 1u);
}

TEST_F(PeersTest, ANodeThatStartsLaterIsFound) {
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

TEST_F(PeersTest, ASecondMachineWithANodesNameIsRefused) {
  const auto b = Make("b");
  const auto a = Make("a");
  ASSERT_TRUE(RunUntil([&] { return a->IsUp("b") && b->IsUp("a"); }));
  const auto second = Make("a");
  ASSERT_TRUE(RunUntil([&] { return b->peers->strangers().count >= 2; }));
  EXPECT_TRUE(b->HasRefused("node a is up, and another machine, 127.0.0.1:"));
  EXPECT_TRUE(a->IsUp("b") && a->downs.empty() && b->downs.empty());
  EXPECT_TRUE(second->ups.empty());
}

TEST_F(PeersTest, AProcessThatDialsAgainReplacesItsConnection) {
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

TEST_F(PeersTest, WhatNoPeerSaysEndsTheConnection) {
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
  ASSERT_TRUE(say({encoded(Beat{})}));
  EXPECT_EQ(b->StateOf("a").why_down, "found a message of type 1, expected a greeting");
  EXPECT_TRUE(b->ups.empty());
  ASSERT_TRUE(say({greeting, greeting}));
  ASSERT_TRUE(RunUntil([&] { return b->downs.size() == 1; }));
  EXPECT_EQ(b->downs.back(), "a: found a second greeting");
  ASSERT_TRUE(say({greeting, std::string("\x01\0\0\0\xC8", 5)}));
  ASSERT_TRUE(RunUntil([&] { return b->downs.size() == 2; }));
  EXPECT_EQ(b->downs.back(), "a: found a message of type 200, expected 0 to 11");
  ASSERT_TRUE(say({greeting, std::string("\xFF\xFF\xFF\xFF", 4)}));
  ASSERT_TRUE(RunUntil([&] { return b->downs.size() == 3; }));
  EXPECT_EQ(b->downs.back(), "a: found a message of 4294967295 bytes, expected 1 to 131072");
}

TEST_F(PeersTest, StopMayBeCalledByACallbackAndIsTheLast) {
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
