// A half-duplex channel in virtual time: the server's end, and robots that take their turns.
// Nothing collides and nothing is lost, unless a test wants it; each robot sends what the test
// gives it.
//
//   Air air(Options(9600, 2ms));
//   air.Join(1, 100ms);                          // HELLO, now; wants a turn every 100 ms
//   air.AdvanceTo(air.now() + 1s);
//   for (const Sent& sent : air.sent()) ...      // what the server has sent, and when
//
// The server answers at once, with intensities that tell robot and request (IntensitiesOf).
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "protocol/messages.h"
#include "server/robots/radio/channel.h"

namespace pheromone::radio::testing {

using namespace std::chrono_literals;  // NOLINT(google-build-using-namespace): of these tests

constexpr Time kStart = 1h;
constexpr uint16_t kGapTimeoutMs = 20;

/// Of a channel whose server announces the least window, in whole milliseconds as it must be.
inline ChannelOptions Options(int64_t baud, Duration turnaround, Duration processing = 2ms) {
  ChannelOptions options;
  options.gap_timeout_ms = kGapTimeoutMs;
  options.half_duplex = true;
  options.timing.byte = ByteTime(baud);
  options.timing.turnaround = turnaround;
  options.timing.processing = processing;
  options.response_window =
      std::chrono::ceil<std::chrono::milliseconds>(options.timing.ResponseWindow());
  options.slot = std::max<std::chrono::milliseconds>(
      1ms, std::chrono::ceil<std::chrono::milliseconds>(turnaround));
  return options;
}

template <typename T>
protocol::Message MessageOf(const T& from) {
  protocol::Message message;
  static_cast<void>(protocol::Encode(from, &message));
  return message;
}

inline std::vector<uint8_t> FrameOf(const protocol::Message& message) {
  std::vector<uint8_t> frame(protocol::kMaxFrame);
  frame.resize(protocol::EncodeFrame(message, frame.data(), frame.size()));
  return frame;
}

inline protocol::Message Sense(uint8_t id, int16_t x = 0) {
  return MessageOf(protocol::SenseRequest{id, 1, false, {x, 0, 0}});
}

inline protocol::Message Hello(uint8_t id, std::chrono::milliseconds period = 0ms) {
  return MessageOf(protocol::HelloRequest{id, 1, 1, static_cast<uint8_t>(period / kPeriodUnit)});
}

inline protocol::Message Halt(uint8_t id, uint8_t seq = 1) {
  return MessageOf(protocol::Command{id, seq, protocol::CommandCode::kHalt, {}});
}

inline protocol::RoundAnswer IntensitiesOf(uint8_t id, int16_t x) {
  return {static_cast<int16_t>(100 * id), x};
}

/// What the server says to a request; a type other than 1 does not exist.
inline std::optional<protocol::Message> AnswerTo(const protocol::Message& request) {
  protocol::SenseRequest sense;
  protocol::EventReport event;
  protocol::HelloRequest hello;
  if (Decode(request, &sense)) {
    const auto [left, right] = IntensitiesOf(sense.id, static_cast<int16_t>(sense.pose.x));
    return sense.type == 1 ? MessageOf(protocol::SenseAnswer{sense.id, 1, sense.wide, left, right})
                           : MessageOf(protocol::ErrorAnswer{
                                 sense.id, request.opcode, protocol::Reason::kUnknownPheromone, 0});
  }
  if (Decode(request, &event)) {
    return MessageOf(protocol::EventAck{event.id, event.seq});
  }
  if (Decode(request, &hello)) {
    protocol::HelloAnswer answer;
    answer.id = hello.id;
    answer.nonce = hello.nonce;
    return MessageOf(answer);
  }
  return std::nullopt;
}

/// A transmission of the server.
struct Sent {
  Time begin;
  Time end;  ///< its last bit leaves the server's UART
  std::vector<protocol::Message> messages;

  std::optional<protocol::Round> round() const {
    protocol::Round round;
    return !messages.empty() && Decode(messages.back(), &round) ? std::optional(round)
                                                                : std::nullopt;
  }
};

class Air {
 public:
  explicit Air(const ChannelOptions& options)
      : options_(options),
        channel_(options, [this](const auto& message) { dropped_.push_back(message); }) {}

  Time now() const { return now_; }
  Channel& channel() { return channel_; }
  const std::vector<Sent>& sent() const { return sent_; }
  const std::vector<protocol::Message>& dropped() const { return dropped_; }

  /// What robot `id` sends in its turns; nothing: it is silent.
  std::map<uint8_t, std::function<std::optional<protocol::Message>()>> in_turn;
  /// Whether what robot `id` sends in this turn is damaged.
  std::function<bool(uint8_t id)> damages = [](uint8_t) { return false; };
  /// Whether the last turn begins as late, and takes as long, as a turn may.
  bool last_is_late = false;
  /// How much later what is sent in the last turn before an opening is heard: the machine pauses.
  Duration pause{};
  /// Sent by clients that contend, one in each opening.
  std::deque<protocol::Message> contenders;
  /// Whether there are always two of them, which nobody understands.
  bool contenders_collide = false;
  /// Since when the server has not looked what arrived; nothing: it reads each byte at once.
  std::optional<Time> not_read_since;
  /// For how long the server thinks about an answer.
  Duration processing{};

  /// The server hears that a robot wants turns, and the robot will send a SENSE in each.
  void Join(uint8_t id, std::chrono::milliseconds period) {
    in_turn.try_emplace(id, [id] { return Sense(id); });
    HearAt(now_, Hello(id, period));
    AdvanceTo(now_ + options_.response_window + 30ms);
  }

  /// The last byte of a frame arrives at `end`, the others before it.
  void HearAt(Time end, const protocol::Message& message, bool damaged = false) {
    std::vector<uint8_t> frame = FrameOf(message);
    frame[4] ^= damaged ? 0x40 : 0;
    auto left = static_cast<int64_t>(frame.size());
    for (const uint8_t byte : frame) {
      arrivals_.emplace(std::max(now_, end - --left * options_.timing.byte), byte);
    }
  }

  void AdvanceTo(Time until) {
    int idle = 0;
    while (true) {
      const Time start = channel_.NextStart(now_);
      const Time arrival = arrivals_.empty() ? kNever : arrivals_.begin()->first;
      const Time answer = answers_.empty() ? kNever : answers_.begin()->first;
      const Time next = std::max(now_, std::min({start, arrival, answer}));
      if (next > until) {
        break;
      }
      ASSERT_LT(idle, 3) << "due, but nothing is sent";
      idle = start <= next && next == now_ ? idle + 1 : 0;
      now_ = next;
      if (arrival <= now_) {
        Hear(arrivals_.extract(arrivals_.begin()).mapped());
      } else if (answer <= now_) {
        const auto [asked_at, message] = answers_.extract(answers_.begin()).mapped();
        channel_.Answer(message, asked_at, now_);
      } else {
        Begin();
      }
    }
    now_ = until;
  }

  /// The ROUNDs since `since`.
  std::vector<protocol::Round> Rounds(Time since = Time::min()) const {
    std::vector<protocol::Round> rounds;
    for (const Sent& sent : sent_) {
      if (sent.begin >= since && sent.round()) {
        rounds.push_back(*sent.round());
      }
    }
    return rounds;
  }

  /// When robot `id` was granted turns, since then.
  std::vector<Time> TurnsOf(uint8_t id, Time since = Time::min()) const {
    std::vector<Time> turns;
    for (const Sent& sent : sent_) {
      const auto round = sent.round();
      for (int i = 0; round && sent.begin >= since && i < round->turn_count; ++i) {
        if (round->turns[i] == id) {
          turns.push_back(sent.begin);
        }
      }
    }
    return turns;
  }

  /// When the first bit of turn `i` of a ROUND leaves the robot's UART.
  Time TurnBegins(const Sent& sent, int i) const {
    return sent.end + options_.timing.Transit() +
           std::chrono::milliseconds(protocol::kBeforeTurnsMs + i * sent.round()->turn_ms);
  }

 private:
  Duration Lasts(const protocol::Message& message) const {
    return static_cast<int64_t>(FrameOf(message).size()) * options_.timing.byte;
  }

  void Hear(uint8_t byte) {
    std::vector<protocol::Message> messages;
    channel_.Hear({&byte, 1}, now_, not_read_since.value_or(now_), &messages);
    for (const protocol::Message& message : messages) {
      if (const auto answer = AnswerTo(message)) {
        answers_.emplace(now_ + processing, std::pair{now_, *answer});
      }
    }
  }

  void Begin() {
    Sent sent{now_, {}, {}};
    const Transmission out = channel_.Begin(now_);
    protocol::FrameDecoder decoder(protocol::kNoGapTimeout);
    decoder.PushBlock(out.bytes.data(), out.bytes.size(), 0,
                      [&sent](const auto& message) { sent.messages.push_back(message); });
    ASSERT_EQ(sent.messages.size(), out.frame_ends.size());
    for (const Transmission::Part& part : out.parts) {  // its own frame, or the ROUND
      const auto own =
          std::find_if(sent.messages.begin(), sent.messages.end(),
                       [&part](const auto& it) { return FrameOf(it) == FrameOf(part.message); });
      const auto frame = own != sent.messages.end() ? own : std::prev(sent.messages.end());
      EXPECT_TRUE(frame == own || frame->opcode == protocol::kRound);
      EXPECT_EQ(part.end, out.frame_ends[static_cast<size_t>(frame - sent.messages.begin())]);
    }
    if (out.bytes.empty()) {
      return;
    }
    sent.end = channel_.sent_at();
    sent_.push_back(sent);
    if (const auto round = sent.round()) {
      TakeTurns(sent, *round);
    }
  }

  void TakeTurns(const Sent& sent, const protocol::Round& round) {
    for (int i = 0; i < round.turn_count; ++i) {
      const auto robot = in_turn.find(round.turns[i]);
      const auto message = robot != in_turn.end() ? robot->second() : std::nullopt;
      if (message) {
        EXPECT_LE(FrameOf(*message).size(), round.turn_bytes);
        const bool late = last_is_late && i + 1 == round.turn_count;
        const Duration lasts = late ? std::chrono::milliseconds(protocol::kLatestTurnMs) +
                                          round.turn_bytes * options_.timing.byte
                                    : Lasts(*message);
        const bool before_opening = i + 1 == round.turn_count && round.open_slots != 0;
        const Duration later = before_opening ? pause : Duration(0);
        HearAt(TurnBegins(sent, i) + options_.timing.turnaround + lasts + later, *message,
               damages(round.turns[i]));
      }
    }
    if (round.open_slots > 1 && !contenders.empty()) {
      HearAt(TurnBegins(sent, round.turn_count) + options_.slot + options_.timing.turnaround +
                 Lasts(contenders.front()),
             contenders.front(), contenders_collide);
      contenders.pop_front();
    }
  }

  const ChannelOptions options_;
  std::vector<protocol::Message> dropped_;
  Channel channel_;
  Time now_ = kStart;
  std::multimap<Time, uint8_t> arrivals_;
  std::multimap<Time, std::pair<Time, protocol::Message>> answers_;
  std::vector<Sent> sent_;
};

}  // namespace pheromone::radio::testing
