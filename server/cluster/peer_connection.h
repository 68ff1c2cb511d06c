// One connection between two nodes (peers.h): its handshake, its messages, and what waits to be
// sent.
//
// On one executor. The socket, the queues and the deadlines are here; who is on the other side, and
// whether that is good, is for Peers.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/system/error_code.hpp>

#include "server/base/result.h"
#include "server/cluster/peer_tls.h"
#include "server/cluster/peer_wire.h"
#include "server/cluster/peers.h"

namespace pheromone::cluster {

/// For coroutines: an operation's error is a value.
inline auto ErrorTo(boost::system::error_code* error) {
  return boost::asio::redirect_error(boost::asio::use_awaitable, *error);
}

/// What is sent first.
enum class Lane : uint8_t {
  kHeartbeat,  ///< the latest one alone
  kUrgent,     ///< halts, greetings
  kNormal,
  kPortions,
};
Lane LaneOf(const PeerMessage& message);

class PeerConnection : public std::enable_shared_from_this<PeerConnection> {
 public:
  using Clock = std::chrono::steady_clock;
  using Socket = boost::asio::ip::tcp::socket;

  /// `dials`: the node that is asked for; empty: the socket was accepted.
  PeerConnection(Socket socket, std::shared_ptr<const PeerTls> tls, std::string dials);

  /// To connect it.
  Socket& socket() { return stream_.next_layer(); }
  /// Both ends have the same secret.
  boost::asio::awaitable<Status> ShakeHands();
  /// The next message. Errors: why the connection ended.
  boost::asio::awaitable<Result<PeerMessage>> Receive();

  /// Not before the handshake. False: it is closed, or full.
  bool Send(std::string frame, Lane lane);
  /// Waits until all was sent.
  boost::asio::awaitable<void> Flush();
  /// Whatever waits for it ends. The first reason counts.
  void Close(const std::string& why);

  /// True once, for who tells of its end.
  bool EndOnce() { return !std::exchange(has_ended_, true); }

  /// From now on it may be silent and stuck only for so long; before, it may take `open`.
  void SetUp();
  /// Closes it if it takes too long.
  void CheckTimes(Clock::time_point now, const PeerTimes& times);

  /// The node on the other side, once the handshake has proved it; before, the one that is dialed.
  const std::string& node() const { return is_secure_ ? node_ : side_.dials; }
  bool dials() const { return !side_.dials.empty(); }
  bool is_up() const { return is_up_ && !is_closed_; }
  bool is_closed() const { return is_closed_; }
  const std::string& why() const { return why_; }
  const std::string& address() const { return address_; }  ///< of an accepted one
  Clock::time_point heard() const { return heard_; }
  size_t queued_bytes() const { return queued_bytes_; }

 private:
  void WriteNext();
  void Gather(std::deque<std::string>* lane, size_t bytes, size_t most_frames);
  std::string HandshakeError(const boost::system::error_code& error) const;

  const std::shared_ptr<const PeerTls> tls_;
  PeerTls::Side side_;  // before the stream, which refers to it
  std::string address_;
  boost::asio::ssl::stream<Socket> stream_;
  boost::asio::steady_timer flushed_;
  std::string node_;
  std::string stage_ = "connection";  // what is waited for
  bool is_secure_ = false;
  bool is_up_ = false;
  bool is_closed_ = false;
  bool has_ended_ = false;
  std::string why_;
  Clock::time_point began_ = Clock::now();
  Clock::time_point heard_ = began_;

  std::array<char, size_t{16} << 10> input_{};
  PeerFrames frames_;

  std::optional<std::string> beat_;
  std::deque<std::string> urgent_;
  std::deque<std::string> normal_;
  std::deque<std::string> portions_;
  size_t queued_bytes_ = 0;  // of these, and of what is being sent
  std::string output_;       // is being sent
  bool is_writing_ = false;
  Clock::time_point write_began_;
};

}  // namespace pheromone::cluster
