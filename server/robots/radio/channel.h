// One end of a line on which the server answers robots: what was heard, what waits to be sent, and
// when it may begin. On a half-duplex channel it keeps the rules of medium access
// (protocol/README.md, "Sharing a radio channel"); on any other line everything may leave at once.
//
//   Channel channel(options, on_dropped);
//   channel.Hear(bytes, now, since, &messages);       // bytes were read
//   channel.Answer(answer, asked_at, now);            // asked_at: when its request was read
//   channel.Send(command);                            // nobody asked for it
//   if (channel.NextStart(now) <= now && channel.IsClear(carrier, now)) {
//     // key the transmitter, where there is a line for it
//     const Transmission out = channel.Begin(now);  // empty: too late by now
//     ...                                             // write them
//     channel.OnSent(end);                            // if it is known when the last bit left
//   }
//
// Rules of a half-duplex channel:
//  * an answer begins when the modem of the robot that asked has turned round; one that could not
//    reach the robot within its response window is dropped, and the robot asks again;
//  * robots that take part in rounds are answered by the next ROUND (rounds.h);
//  * a COMMAND follows an answer to the same robot, or precedes a ROUND; otherwise it waits until
//    the channel is free, and for the window of the ACK of the one before;
//  * at most one ERROR leaves in a window, so that damaged requests do not fill the channel;
//  * frames are signed, if they are, as they leave: their counters go up in that order. A signed
//    answer to HELLO is coded, if its robot has said HELLO before, or the last ROUND was;
//  * a carrier holds the server back, but not for longer than kLongestCarrier.
//
// At most kMaxQueue bytes wait; beyond that the oldest messages are dropped. No I/O, no clock: time
// goes in, NextStart tells when to look again. Not thread-safe.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "protocol/decoder.h"
#include "server/robots/radio/channel_options.h"
#include "server/robots/radio/rounds.h"
#include "server/robots/radio/timing.h"

namespace pheromone::radio {

struct ChannelCounters {
  uint64_t late_answers = 0;      ///< dropped: the response window had passed
  uint64_t dropped_answers = 0;   ///< dropped: the queue was full
  uint64_t withheld_errors = 0;   ///< dropped: a second ERROR within a window
  uint64_t ignored_carriers = 0;  ///< on for longer than any transmission lasts
  RoundCounters rounds;

  bool operator==(const ChannelCounters&) const = default;
};

/// Complete frames, sent without a pause.
struct Transmission {
  /// A message that the engine gave, in a frame of its own or in a ROUND.
  struct Part {
    protocol::Message message;
    size_t end = 0;  ///< of that frame in `bytes`; of the first one if it is sent twice
  };

  std::vector<uint8_t> bytes;
  std::vector<size_t> frame_ends;  ///< in `bytes`, ascending
  std::vector<Part> parts;
};

class Channel {
 public:
  static constexpr size_t kMaxQueue = size_t{64} * 1024;
  static constexpr Duration kLongestCarrier = std::chrono::seconds(2);

  /// Called with each message that will not be sent.
  using OnDropped = std::function<void(const protocol::Message& message)>;

  Channel(const ChannelOptions& options, OnDropped on_dropped);

  /// Goes on where another server has sent until now (Rounds::Resume). Before anything else.
  void Resume(const std::vector<RoundMember>& members, Time now);

  /// Decodes bytes read at `now`, and appends the messages in them. What had arrived at `since` was
  /// read before: a busy machine may read something of before a ROUND after it.
  void Hear(std::span<const uint8_t> bytes, Time now, Time since,
            std::vector<protocol::Message>* messages);
  /// What the server is not to see, of the last call of Hear: not signed as it has to be, or a
  /// first HELLO, which is answered.
  const std::vector<protocol::Message>& refused() const { return refused_; }

  /// An answer to a request that was read at `asked_at`.
  void Answer(const protocol::Message& message, Time asked_at, Time now);
  /// A message that nobody asked for.
  void Send(const protocol::Message& message);

  /// Drops all that waits.
  void DropAll();

  /// When a transmission may begin; `now` or earlier: at once. kNever if nothing waits. Drops the
  /// answers that are too late.
  Time NextStart(Time now);
  /// When to see whether something that arrived is not read yet: between what may have come before
  /// a ROUND and its turns. May be past, or kNever.
  Time LookAt() const { return rounds_.active() ? free_at_ : kNever; }
  /// Whether a transmission may begin with the modem's carrier as it is at `now`. To be asked
  /// before each one, every few milliseconds while the answer is no.
  bool IsClear(bool carrier, Time now);

  /// Begins the transmission that is due: complete frames. Empty if nothing is due any more. A
  /// transmitter with a lead has been keyed at `now`, and the frames follow `lead` later.
  Transmission Begin(Time now);
  /// The last bit of that left the UART at `end`; by itself, the channel computes this.
  void OnSent(Time end);
  /// When the last bit of the last transmission has left, as far as known.
  Time sent_at() const { return free_at_; }

  const protocol::FrameDecoder& decoder() const { return decoder_; }
  /// The time that the decoder is given, ms; it wraps.
  static uint32_t DecoderTime(Time at);
  ChannelCounters counters() const;

 private:
  struct Frame {
    protocol::Message message;
    std::vector<uint8_t> bytes;
    std::optional<Time> asked_at;
  };
  enum class What : uint8_t { kNothing, kAnswer, kRound, kOther };
  struct Start {
    Time at = kNever;
    What what = What::kNothing;
  };

  bool Open(protocol::Message* message, Time now, Time since);
  void Enqueue(const protocol::Message& message, std::optional<Time> asked_at);
  void NoteAck(const protocol::Message& heard);
  void DropFront();
  Frame Take(const std::deque<Frame>::iterator& at);
  bool IsLate(const Frame& frame, Time start) const;
  Start Next(Time now);
  Time FreeAt() const;
  Time AnswerAt(const Frame& frame) const;
  Time RoundAt() const;
  bool IsToBeCoded(const protocol::Message& sealed) const;
  std::optional<std::vector<uint8_t>> Sealed(const protocol::Message& message) const;
  bool Append(const Frame& frame, Transmission* out);
  void AppendRider(uint8_t id, Transmission* out);
  void AppendRound(Time now, Transmission* out);

  const ChannelOptions options_;
  const OnDropped on_dropped_;
  protocol::FrameDecoder decoder_;
  Rounds rounds_;
  std::vector<protocol::Message> refused_;
  std::deque<Frame> queue_;  // half duplex: answers, then the rest
  size_t queued_bytes_ = 0;
  Time heard_at_;
  Time free_at_;                  // own bytes have left by then
  Time ack_until_ = Time::min();  // a robot may acknowledge a COMMAND
  std::optional<Time> last_error_;
  Time carrier_since_ = kNever;
  Time carrier_until_ = kNever;
  bool awaits_ack_ = false;  // once what is being sent has left
  bool sent_round_ = false;  // what is being sent ends with a ROUND
  ChannelCounters counters_;
};

}  // namespace pheromone::radio
