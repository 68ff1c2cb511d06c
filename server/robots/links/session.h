// The session of one open connection: reads and writes a descriptor, and keys the transmitter where
// there is a line for it. What is sent when is decided by radio::Channel.
//
//   Session session(strand, options, on_batch, &record);
//   const std::string why = co_await session.Run(std::move(descriptor));
//
// All functions are called on the strand, and so is on_batch.
#pragma once

#include <cstdint>
#include <exception>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/basic_waitable_timer.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>

#include "server/robots/links/clock.h"
#include "server/robots/links/link.h"
#include "server/robots/links/port_calls.h"
#include "server/robots/links/tap.h"
#include "server/robots/radio/channel.h"

namespace pheromone::links {

struct ConversationOptions {
  radio::ChannelOptions channel;

  /// The port whose carrier is sensed and whose transceiver is keyed, if it has such lines; null:
  /// neither. Outlives the session. The transceiver is not unkeyed at the end of the session, but
  /// when the port is closed.
  PortCalls* port = nullptr;
  /// Asked before each write, and held while a driver keys the transmitter; null: there is no need
  /// to. Outlives the session. Who closes the port releases it.
  SendPermit* permit = nullptr;
  /// Called with each message that is not sent whole: without a permit, or because a write failed.
  std::function<void(const protocol::Message& message)> on_refused;
};

class Session {
 public:
  /// Called with the messages of one read; the messages appended to `answers` are sent on this
  /// line.
  using OnBatch = std::function<void(Session* from, std::span<const protocol::Message> batch,
                                     std::vector<engine::Outgoing>* answers)>;

  Session(const boost::asio::any_io_executor& strand, const ConversationOptions& options,
          OnBatch on_batch, LinkRecord* record, const TappedLine& tapped = {});
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  ~Session();

  /// Reads and writes until the other side hangs up, an error occurs, what Finish waits for has
  /// happened or Close is called, and all calls of the port have returned. Returns the reason as
  /// text. Called once. Exceptions of on_batch, the tap or the port propagate to the caller.
  boost::asio::awaitable<std::string> Run(Descriptor descriptor);

  /// Sends a command or a deferred answer.
  void Send(const engine::Outgoing& outgoing);

  /// From now on this server sends, as its permit says, and another one no more: refuses what
  /// waits, and goes on with the rounds of these robots.
  void TakeOver(const std::vector<radio::RoundMember>& members);

  /// Sends nothing new, and ends Run when what has begun to be sent has left to its last bit.
  void Finish();
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
  using Timer = boost::asio::basic_waitable_timer<Clock>;

  boost::asio::awaitable<std::string> ToTheEnd(
      boost::asio::awaitable<std::string> (Session::*loop)());
  boost::asio::awaitable<std::string> Read();
  boost::asio::awaitable<std::string> Write();
  boost::asio::awaitable<bool> KeyUp();
  boost::asio::awaitable<void> KeyDown();
  boost::asio::awaitable<std::string> Transmit(radio::Transmission out);
  boost::asio::awaitable<void> PauseUntil(Clock::time_point end);
  boost::asio::awaitable<boost::system::error_code> WritePermitted(std::span<const uint8_t> bytes,
                                                                   size_t* size);
  bool IsPermitted(size_t bytes) const;
  bool Claim(size_t bytes);
  radio::Duration OnTheAir(size_t bytes) const;
  void MakeChannel();
  void Drop(const protocol::Message& message);
  void RefuseAll();
  void TakeBytes(std::span<const uint8_t> bytes);
  void Queue(const protocol::Message& message, std::optional<radio::Time> asked_at);
  void Wake();
  void CountWhatHappened();

  const ConversationOptions options_;
  const OnBatch on_batch_;
  LinkRecord* const record_;
  TappedLine tapped_;
  boost::asio::posix::stream_descriptor stream_;
  Timer wake_;                             // cancelled when what is sent next may have changed
  Timer pause_;                            // cancelled at the end only
  std::optional<radio::Channel> channel_;  // made anew by TakeOver
  radio::ChannelCounters counted_;         // what the record has of them
  Clock::time_point last_read_;
  Clock::time_point all_read_;  // what arrived before has been read
  std::vector<protocol::Message> batch_;
  std::vector<engine::Outgoing> answers_;
  bool is_refusing_ = false;  // what the channel drops is refused
  bool finishing_ = false;
  bool closed_ = false;
  bool ended_ = false;            // one of reading and writing has
  bool is_cut_ = false;           // the last frame was not sent to its end
  std::exception_ptr exception_;  // with which it did
};

}  // namespace pheromone::links
