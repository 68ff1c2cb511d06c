// The connections of a daemon to the others of its cluster: each is dialed, kept up and dialed
// again.
//
//   Peers peers(strand, {.own = greeting, .nodes = nodes, .secret = secret},
//               {.on_message = [](const std::string& node, PeerMessage message) { ... },
//                .on_up = [](const std::string& node, const Greeting& greeting) { ... },
//                .on_down = [](const std::string& node, const std::string& why) { ... }});
//   Status listens = peers.Listen();
//   peers.SendAll(Heartbeat{...});
//
// Of two nodes, the one whose name comes first dials, and the other one listens; so there is one
// connection between them. It is encrypted and authenticated both ways (peer_tls.h), and begins
// with a greeting each way (peer_wire.h); then the node is up. A connection ends when nothing was
// heard for a while (heartbeats are expected), when the other side does not read, or when it says
// what no peer says; it is dialed again with jittered back-off. What was not sent then is lost.
//
// Heartbeats and halts are sent before everything else, portions of states after everything else,
// and all the rest in the order in which it was given. A heartbeat that was not yet sent is
// replaced by the next one. Nothing larger than kMaxPeerBytes is in their way.
//
// All functions are called, and all callbacks call, on one executor: a strand, or one of an
// io_context with one thread. A callback may call all functions. Neither calls back within a call.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <boost/asio/any_io_executor.hpp>

#include "server/base/result.h"
#include "server/cluster/peer_wire.h"
#include "server/net/endpoint.h"

namespace pheromone::cluster {

/// Defaults for machines of one room.
struct PeerTimes {
  std::chrono::milliseconds open{1'000};      ///< to connect, shake hands and greet, at most
  std::chrono::milliseconds silence{1'000};   ///< nothing is heard: the connection is dead
  std::chrono::milliseconds stuck{2'000};     ///< nothing can be sent: the other side does not read
  std::chrono::milliseconds first_pause{50};  ///< before it is dialed again; doubles
  std::chrono::milliseconds longest_pause{500};
  std::chrono::milliseconds quiet{60'000};  ///< between two warnings, at least
};

struct PeersSettings {
  Greeting own;                           ///< has the names of the cluster and the node
  std::map<std::string, Endpoint> nodes;  ///< all, with the own one; numeric addresses
  std::string secret;                     ///< bytes
  uint32_t seed = 1;                      ///< of the jitter: another one on each machine
  PeerTimes times{};
};

struct PeersCallbacks {
  std::function<void(const std::string& node, PeerMessage message)> on_message;
  std::function<void(const std::string& node, const Greeting& greeting)> on_up;
  std::function<void(const std::string& node, const std::string& why)> on_down;  ///< it was up
  /// For the log: a stranger, or an internal error in spite of which it goes on.
  std::function<void(const std::string& text)> on_warning{};
};

/// For status.
struct PeerState {
  std::string node;
  bool is_up = false;
  std::chrono::steady_clock::time_point since{};                 ///< up or down
  std::optional<std::chrono::steady_clock::time_point> heard{};  ///< while it is up
  std::string why_down{};     ///< the last time; empty: it was not yet tried
  std::string program{};      ///< its version, when it was up last
  uint64_t queued_bytes = 0;  ///< that wait to be sent
  uint64_t times_up = 0;
};

/// Connections that did not become those of a node: wrong secret, no TLS, too slow.
struct StrangerState {
  uint64_t count = 0;
  std::string last{};  ///< the address, and why it was refused; empty: there was none
};

class Peers {
 public:
  static constexpr size_t kMaxQueuedBytes = size_t{8} << 20;  ///< of a node; beyond, it is dropped
  static constexpr size_t kMaxPortions = 4;                   ///< queued for a node
  static constexpr size_t kMaxStrangers = 16;                 ///< at once; beyond, the oldest ends

  Peers(boost::asio::any_io_executor executor, PeersSettings settings, PeersCallbacks callbacks);
  ~Peers();  ///< as Stop

  /// Listens for those who dial this node, and dials the others. Errors: the address is not this
  /// machine's, or is used.
  Status Listen();
  /// Where it listens, for a configured port 0.
  uint16_t port() const;

  /// False: the node is not up, the message is too long, or there are kMaxPortions already; then it
  /// is not sent. True: it will be, unless the connection ends.
  bool Send(const std::string& node, const PeerMessage& message);
  /// To all that are up; returns how many.
  size_t SendAll(const PeerMessage& message);
  bool IsUp(const std::string& node) const;

  /// The cluster's ID, when it becomes known: for greetings from now on.
  void SetId(const std::string& id);

  std::vector<PeerState> states() const;  ///< of the other nodes, by name
  StrangerState strangers() const;

  /// Closes everything; no callback is called any more.
  void Stop();

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace pheromone::cluster
