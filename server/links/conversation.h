// One line, open: bytes from a descriptor become batches of messages, messages become whole frames
// on it. Knows when a half-duplex line may be used (protocol/README.md, "Medium access").
//
//   Conversation conversation(strand, options, on_batch, &record);
//   const std::string why = co_await conversation.Run(std::move(descriptor));
//
// All functions are called on the strand, which on_batch is called on too. A conversation holds at
// most kMaxQueue bytes that the other side has not taken; then the first in the queue are dropped.
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

  /// Whose carrier is waited for, and whose transceiver is switched, `lead` before and `tail` after
  /// each block, if it has lines for that; null: neither. Outlives the conversation. It is not
  /// switched back at the end, but where it is closed.
  PortCalls* port = nullptr;
  Clock::duration lead{};
  Clock::duration tail{};

  /// G_s: how long the robot that asked needs to get from sending to listening.
  Clock::duration server_gap() const { return turnaround + byte_time; }
  /// I_c: a line silent for this long is nobody's.
  Clock::duration idle_time() const { return server_gap() + 2 * byte_time; }
};

class Conversation {
 public:
  static constexpr size_t kMaxQueue = size_t{64} * 1024;

  /// Called with the messages of one read; what it appends to `answers` is sent on this line.
  using OnBatch = std::function<void(Conversation* from, std::span<const protocol::Message> batch,
                                     std::vector<engine::Outgoing>* answers)>;

  Conversation(const boost::asio::any_io_executor& strand, const ConversationOptions& options,
               OnBatch on_batch, LinkRecord* record, const TappedLine& tapped = {});
  Conversation(const Conversation&) = delete;
  Conversation& operator=(const Conversation&) = delete;
  ~Conversation();

  /// Reads and writes until the other side hangs up, something fails, or Close is called, and the
  /// port has done what it was asked for. Returns the reason, in words. Once. What on_batch, the
  /// tap or the port throw comes out of it.
  boost::asio::awaitable<std::string> Run(Descriptor descriptor);

  /// Sends a command, or an answer that had to wait.
  void Send(const engine::Outgoing& outgoing);

  /// Ends Run, also one that has not begun.
  void Close();
  bool closed() const { return closed_; }

  /// When the last byte came in, or the conversation began.
  Clock::time_point last_read() const { return last_read_; }
  /// Never given to another conversation of the link.
  uint32_t connection() const { return tapped_.line.connection; }
  /// Who asked for the messages of a batch, while it is handled.
  engine::Asker asker() const;

 private:
  struct Frame {
    std::vector<uint8_t> bytes;
    std::optional<Clock::time_point> asked_at;
  };

  boost::asio::awaitable<std::string> ToTheEnd(
      boost::asio::awaitable<std::string> (Conversation::*loop)());
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
