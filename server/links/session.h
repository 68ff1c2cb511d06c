// The session of one open connection: decodes bytes from a descriptor into batches of messages and
// writes messages as complete frames. On a half-duplex line it observes the rules of medium access
// (protocol/README.md, "Medium access").
//
//   Session session(strand, options, on_batch, &record);
//   const std::string why = co_await session.Run(std::move(descriptor));
//
// All functions are called on the strand, and so is on_batch. A session queues at most kMaxQueue
// bytes; beyond that, the oldest messages of the queue are dropped.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>

#include "protocol/decoder.h"
#include "server/links/link.h"
#include "server/links/port_calls.h"
#include "server/links/tap.h"

namespace pheromone::links {

using Clock = std::chrono::steady_clock;

struct ConversationOptions {
  uint16_t gap_timeout_ms = protocol::kNoGapTimeout;

  /// Whether robots share the line, one station sending at a time.
  bool medium_access = false;
  Clock::duration byte_time{};        ///< B
  Clock::duration turnaround{};       ///< T_t
  Clock::duration response_window{};  ///< W

  /// The port whose carrier is sensed and whose transceiver is keyed, `lead` before and until
  /// `tail` after each block, if it has such lines; null: neither. Outlives the session. The
  /// transceiver is not unkeyed at the end of the session, but when the port is closed.
  PortCalls* port = nullptr;
  Clock::duration lead{};
  Clock::duration tail{};

  /// G_s: how long the robot that asked needs to get from sending to listening.
  Clock::duration server_gap() const { return turnaround + byte_time; }
  /// I_c: a line silent for this long is free.
  Clock::duration idle_time() const { return server_gap() + 2 * byte_time; }
};

class Session {
 public:
  static constexpr size_t kMaxQueue = size_t{64} * 1024;

  /// Called with the messages of one read; the messages appended to `answers` are sent on this
  /// line.
  using OnBatch = std::function<void(Session* from, std::span<const protocol::Message> batch,
                                     std::vector<engine::Outgoing>* answers)>;

  Session(const boost::asio::any_io_executor& strand, const ConversationOptions& options,
          OnBatch on_batch, LinkRecord* record, const TappedLine& tapped = {});
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  ~Session();

  /// Reads and writes until the other side hangs up, an error occurs or Close is called, and all
  /// calls of the port have returned. Returns the reason as text. Called once. Exceptions of
  /// on_batch, the tap or the port propagate to the caller.
  boost::asio::awaitable<std::string> Run(Descriptor descriptor);

  /// Sends a command or a deferred answer.
  void Send(const engine::Outgoing& outgoing);

  /// Ends Run, even if it has not begun.
  void Close();
  bool closed() const { return closed_; }

  /// When the last byte was received, or the session began.
  Clock::time_point last_read() const { return last_read_; }
  /// Unique among the sessions of the link, never reused.
  uint32_t connection() const { return tapped_.line.connection; }
  /// The requesters of the messages of a batch while it is handled.
  engine::Asker asker() const;

 private:
  struct Frame {
    std::vector<uint8_t> bytes;
    std::optional<Clock::time_point> asked_at;
  };

  boost::asio::awaitable<std::string> ToTheEnd(
      boost::asio::awaitable<std::string> (Session::*loop)());
  boost::asio::awaitable<std::string> Read();
  boost::asio::awaitable<std::string> Write();
  bool IsReady(Clock::time_point now);
  void TakeBytes(std::span<const uint8_t> bytes);
  void Enqueue(const protocol::Message& message, std::optional<Clock::time_point> asked_at);
  Clock::time_point EarliestStart(const Frame& frame) const;
  bool DropLate(Clock::time_point start);
  std::vector<uint8_t> NextBlock(size_t* frames);
  void LeaveOut(std::span<const uint8_t> frames) const;

  const ConversationOptions options_;
  const OnBatch on_batch_;
  LinkRecord* const record_;
  TappedLine tapped_;
  boost::asio::posix::stream_descriptor stream_;
  boost::asio::steady_timer wake_;   // cancelled when there is something new to write
  boost::asio::steady_timer pause_;  // cancelled at the end only
  protocol::FrameDecoder decoder_;
  std::deque<Frame> queue_;  // on a shared line: answers, then the rest
  size_t queued_bytes_ = 0;
  Clock::time_point last_read_;
  Clock::time_point line_free_at_;  // own bytes have left by then
  std::optional<Clock::time_point> last_error_;
  std::vector<protocol::Message> batch_;
  std::vector<engine::Outgoing> answers_;
  bool closed_ = false;
  bool ended_ = false;            // one of reading and writing has
  std::exception_ptr exception_;  // with which it did
};

}  // namespace pheromone::links
