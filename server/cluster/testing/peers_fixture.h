// Peers over real sockets of this machine, for tests. Where a limit of time is not the subject, it
// is longer than any test takes.
//
// One thread.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/system/error_code.hpp>

#include "server/cluster/peer_connection.h"
#include "server/cluster/peer_tls.h"
#include "server/cluster/peers.h"
#include "server/cluster/testing/peer_relay.h"

namespace pheromone::cluster {

inline const std::string kSecret(32, 's');
constexpr PeerTimes kPatient{.open = std::chrono::seconds(600),
                             .silence = std::chrono::seconds(600),
                             .stuck = std::chrono::seconds(600),
                             .first_pause = std::chrono::milliseconds(10),
                             .longest_pause = std::chrono::milliseconds(50),
                             .quiet = std::chrono::seconds(600)};

inline Greeting GreetingFrom(const std::string& node, uint64_t instance) {
  return {.versions = {.program = "0.1.0"},
          .cluster = "lab",
          .node = node,
          .id = "",
          .links_hash = 1,
          .instance = instance};
}

// 100 000 bytes.
inline OperatorResult LongMessage(uint64_t number) {
  return {.number = number, .ok = false, .text = std::string(100'000, 'x')};
}

// A node with all that it has heard.
struct TestedPeer {
  std::vector<std::pair<std::string, PeerMessage>> messages;
  std::vector<std::string> ups;
  std::vector<std::string> downs;  // NODE: WHY
  std::vector<std::string> warnings;
  size_t throws_at_down = 0;  // the first is 1
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

class PeersFixture : public ::testing::Test {
 protected:
  using Change = std::function<void(PeersSettings*)>;

  // Nodes that are dialed are made before those that dial. `change` is what differs.
  std::unique_ptr<TestedPeer> Make(const std::string& node, const Change& change = nullptr) {
    auto daemon = std::make_unique<TestedPeer>();
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
    TestedPeer* const it = daemon.get();
    daemon->peers = std::make_unique<Peers>(
        io_.get_executor(), settings,
        PeersCallbacks{
            .on_message =
                [it](const std::string& from, PeerMessage message) {
                  it->messages.emplace_back(from, std::move(message));
                },
            .on_up = [it](const std::string& other, const Greeting&) { it->ups.push_back(other); },
            .on_down =
                [it](const std::string& other, const std::string& why) {
                  it->downs.push_back(other + ": " + why);
                  if (it->downs.size() == it->throws_at_down) {
                    throw std::runtime_error("planted");
                  }
                },
            .on_warning = [it](const std::string& text) { it->warnings.push_back(text); }});
    const Status listens = daemon->peers->Listen();
    EXPECT_TRUE(listens.ok()) << listens.ErrorOr("");
    ports_[node] = daemon->peers->port();
    return daemon;
  }

  std::shared_ptr<PeerRelay> MakeRelay(const std::string& to) {
    const auto relay = std::make_shared<PeerRelay>(&io_, ports_[to]);
    relay->Start();
    ports_[to] = relay->port();
    return relay;
  }

  // Until it holds; false if that takes longer than anything should.
  template <typename Condition>
  bool RunUntil(Condition holds) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(120);
    while (!holds()) {
      if (std::chrono::steady_clock::now() > end) {
        return false;
      }
      io_.run_one_for(std::chrono::milliseconds(100));
    }
    return true;
  }

  // Something that is not a node: dials b as the node `as`, and does `talk` after the handshake.
  using Talk = std::function<boost::asio::awaitable<void>(std::shared_ptr<PeerConnection>)>;
  void Pretend(const std::string& as, Talk talk) {
    const auto tls = std::make_shared<const PeerTls>(kSecret, "lab",
                                                     std::vector<std::string>{"a", "b", "c"}, as);
    const auto it = std::make_shared<PeerConnection>(boost::asio::ip::tcp::socket(io_), tls, "b");
    boost::asio::co_spawn(
        io_,
        [it, talk, to = LocalPort(ports_["b"])]() -> boost::asio::awaitable<void> {
          boost::system::error_code error;
          co_await it->socket().async_connect(
              to, boost::asio::redirect_error(boost::asio::use_awaitable, error));
          const Status secure = co_await it->ShakeHands();
          EXPECT_TRUE(secure.ok());
          co_await talk(it);
        },
        boost::asio::detached);
  }

  // Heartbeats to all, as a daemon sends them, while it is there.
  std::shared_ptr<void> BeatOften(TestedPeer* daemon) {
    const auto timer = std::make_shared<boost::asio::steady_timer>(io_);
    boost::asio::co_spawn(
        io_,
        [timer = std::weak_ptr(timer), daemon]() -> boost::asio::awaitable<void> {
          boost::system::error_code ignored;
          for (auto it = timer.lock(); it != nullptr;) {
            daemon->peers->SendAll(Heartbeat{});
            it->expires_after(std::chrono::milliseconds(5));
            auto wait =
                it->async_wait(boost::asio::redirect_error(boost::asio::use_awaitable, ignored));
            co_await std::move(wait);
            it.reset();
            it = timer.lock();
          }
        },
        boost::asio::detached);
    return timer;
  }

  boost::asio::io_context io_;
  std::map<std::string, uint16_t> ports_{
      {"a", uint16_t{1}}, {"b", uint16_t{1}}, {"c", uint16_t{1}}};
  uint64_t instances_ = 0;
};

}  // namespace pheromone::cluster
