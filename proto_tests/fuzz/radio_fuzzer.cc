// The server's end of a radio channel, whatever it hears, and whenever it is given something to
// send: each answer is sent once, as a frame or in a ROUND, or is reported as dropped; the server
// neither interrupts itself nor the turns it has granted; what is due is sent, and what waits is
// bounded.
//
// The first bytes of the input are the channel; then each operation is a byte, and an argument.

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <iterator>
#include <map>
#include <optional>
#include <vector>

#include "proto_tests/fuzz/require.h"
#include "protocol/messages.h"
#include "server/robots/radio/channel.h"

namespace {

using pheromone::fuzz::Require;
using namespace std::chrono_literals;
using namespace pheromone::radio;  // NOLINT(google-build-using-namespace)
namespace protocol = pheromone::protocol;

class Input {
 public:
  Input(const uint8_t* data, size_t size) : at_(data), end_(data + size) {}

  bool empty() const { return at_ == end_; }
  uint8_t Take() { return empty() ? uint8_t{0} : *at_++; }

 private:
  const uint8_t* at_;
  const uint8_t* end_;
};

ChannelOptions TakeOptions(Input* in) {
  constexpr int64_t kBauds[] = {9'600, 75, 1'200, 38'400, 115'200};
  ChannelOptions options;
  const uint8_t flags = in->Take();
  options.half_duplex = (flags & 7u) != 0;
  options.gap_timeout_ms = (flags & 8u) != 0 ? protocol::kNoGapTimeout : uint16_t{20};
  options.timing.keyed = (flags & 16u) != 0;
  options.timing.byte = ByteTime(kBauds[in->Take() % std::size(kBauds)]);
  options.timing.turnaround = in->Take() % 64 * 1ms;
  options.timing.lead = options.timing.keyed ? in->Take() % 64 * 1ms : 0ms;
  options.timing.adapter = in->Take() % 32 * 1ms;
  options.timing.processing = in->Take() % 32 * 1ms;
  options.response_window =
      std::chrono::ceil<std::chrono::milliseconds>(options.timing.ResponseWindow());
  options.slot = 1ms + std::chrono::floor<std::chrono::milliseconds>(options.timing.turnaround);
  return options;
}

template <typename T>
protocol::Message MessageOf(const T& from) {
  protocol::Message message;
  static_cast<void>(protocol::Encode(from, &message));
  return message;
}

std::vector<uint8_t> FrameOf(const protocol::Message& message) {
  std::vector<uint8_t> frame(protocol::kMaxFrame);
  frame.resize(protocol::EncodeFrame(message, frame.data(), frame.size()));
  return frame;
}

bool Same(const protocol::Message& a, const protocol::Message& b) {
  return a.id == b.id && a.opcode == b.opcode && a.length == b.length &&
         std::equal(a.data, a.data + a.length, b.data);
}

struct Request {
  protocol::Message message;
  Time at{};
};

struct Waiting {
  protocol::Message message;
  std::optional<Time> asked_at;
};

class Driver {
 public:
  explicit Driver(const ChannelOptions& options)
      : options_(options),
        channel_(options, [this](const protocol::Message& message) { TakeExact(message); }) {}

  void Run(Input* in) {
    while (!in->empty()) {
      const uint8_t operation = in->Take();
      const uint8_t argument = in->Take();
      Do(operation % 12, argument, in);
      Send(operation >= 0xC0);
    }
    channel_.DropAll();
    Require(waiting_.empty());
  }

 private:
  static uint8_t IdOf(uint8_t argument) { return static_cast<uint8_t>(1 + argument % 24); }

  void Do(int operation, uint8_t argument, Input* in) {
    const uint8_t id = IdOf(argument);
    switch (operation) {
      case 0:
        return Advance(argument * 250us);
      case 1:
        return Advance(argument * 50ms);
      case 2:
        return AdvanceToStart();
      case 3:
        return Hear(MessageOf(protocol::HelloRequest{id, 1, 1, in->Take()}));
      case 4:
        return Hear(MessageOf(protocol::SenseRequest{id, 1, argument >= 0x80, {}}));
      case 5:
        return Hear(MessageOf(protocol::EventReport{id, argument, {}, 0}));
      case 6:
        return Hear(MessageOf(protocol::CommandAck{id, argument, {}, 0}));
      case 7:
        return HearBytes({argument, in->Take(), in->Take()});
      case 8:
        return Answer(argument);
      case 9:
        return Command(argument);
      case 10:
        return TakeTurns(argument);
      default:
        return Clock(argument);
    }
  }

  void Advance(Duration by) { now_ += by; }

  void AdvanceToStart() {
    const Time start = channel_.NextStart(now_);
    if (start != kNever) {
      now_ = std::max(now_, start);
    }
  }

  // The driver says when the last bit has left, which may be later than computed.
  void Clock(uint8_t argument) {
    if (sent_at_ > now_) {
      sent_at_ += argument * 100us;
      reserved_until_ += argument * 100us;
      channel_.OnSent(sent_at_);
    }
  }

  void Hear(const protocol::Message& message) { HearBytes(FrameOf(message)); }

  void HearBytes(const std::vector<uint8_t>& bytes) {
    std::vector<protocol::Message> messages;
    channel_.Hear(bytes, now_, now_, &messages);
    for (const protocol::Message& message : messages) {
      ++heard_[message.id];
      if (now_ >= sent_at_) {
        told_.erase(message.id);  // it has received the ROUND
      }
      requests_.push_back({message, now_});
    }
    while (requests_.size() > kMaxRequests) {
      requests_.pop_front();
    }
  }

  // Those whose turns it is send something, but for some.
  void TakeTurns(uint8_t silent) {
    for (const uint8_t id : turns_) {
      if (silent % 8 != id % 8) {
        now_ += 20 * options_.timing.byte;
        Hear(MessageOf(protocol::SenseRequest{id, 1, false, {}}));
      }
    }
  }

  void Answer(uint8_t argument) {
    if (requests_.empty()) {
      return;
    }
    const auto at = requests_.begin() + argument % static_cast<int>(requests_.size());
    const Request request = *at;
    requests_.erase(at);
    protocol::Message answer;
    const uint8_t id = request.message.id;
    if (request.message.opcode == protocol::kHello) {
      answer = MessageOf(protocol::HelloAnswer{id, ++unique_, 1, 1, 1, 1, 1, 1, 1, 1, 1});
    } else if (request.message.opcode == protocol::kEvent) {
      answer = MessageOf(protocol::EventAck{id, static_cast<uint8_t>(++unique_)});
    } else if (argument >= 0xE0) {
      ++unique_;
      answer = MessageOf(protocol::ErrorAnswer{id, static_cast<uint8_t>(unique_ / 256),
                                               protocol::Reason::kOffTheMap,
                                               static_cast<uint8_t>(unique_)});
    } else {
      answer = MessageOf(
          protocol::SenseAnswer{id, 1, false, static_cast<int16_t>(++unique_ % 32'767), 1});
    }
    // Each is another one, or it would not be known which of them leaves.
    if (std::any_of(waiting_.begin(), waiting_.end(),
                    [&answer](const Waiting& it) { return Same(it.message, answer); })) {
      return;
    }
    Wait({answer, request.at});
    channel_.Answer(answer, request.at, now_);
  }

  void Wait(const Waiting& waiting) {
    waiting_.push_back(waiting);
    waiting_bytes_ += FrameOf(waiting.message).size();
  }

  void Command(uint8_t argument) {
    const uint8_t id = argument >= 0xF0 ? protocol::kBroadcastId : IdOf(argument);
    const auto halt = MessageOf(protocol::Command{id, argument, protocol::CommandCode::kHalt, {}});
    Wait({halt, std::nullopt});
    channel_.Send(halt);
  }

  // Like a link: what is due is sent, if the modem reports no carrier.
  void Send(bool carrier) {
    for (int i = 0; channel_.NextStart(now_) <= now_; ++i) {
      Require(i < kMaxSteps);
      if (!channel_.IsClear(carrier, now_)) {
        return;
      }
      const size_t waiting = waiting_.size();
      const Transmission out = channel_.Begin(now_);
      if (out.bytes.empty()) {
        Require(waiting_.size() < waiting || channel_.NextStart(now_) > now_);
      } else {
        TakeSent(out);
      }
    }
    Require(waiting_bytes_ <=
            Channel::kMaxQueue + size_t{protocol::kMaxTurns} * protocol::kMaxFrame);
  }

  void TakeSent(const Transmission& out) {
    std::vector<protocol::Message> messages;
    protocol::FrameDecoder decoder(protocol::kNoGapTimeout);
    decoder.PushBlock(out.bytes.data(), out.bytes.size(), 0,
                      [&](const protocol::Message& message) { messages.push_back(message); });
    Require(messages.size() == out.frame_ends.size() && !messages.empty());
    protocol::Round round;
    const bool has_round = Decode(messages.back(), &round);
    if (options_.half_duplex) {
      Require(now_ >= sent_at_);
      Require(now_ >= reserved_until_ || (has_round && TurnsAreOver()));
      sent_at_ = channel_.sent_at();
      const Duration lead = options_.timing.keyed ? options_.timing.lead : Duration(0);
      Require(sent_at_ ==
              now_ + lead + static_cast<int64_t>(out.bytes.size()) * options_.timing.byte);
    } else {
      Require(!has_round);
    }
    for (size_t i = 0; i + (has_round ? 1 : 0) < messages.size(); ++i) {
      if (has_round && i != 0 && Same(messages[i], messages[i - 1])) {
        continue;  // before a coded ROUND, an answer goes out twice
      }
      if (has_round && TakeSaidAgain(messages[i])) {
        continue;
      }
      const auto asked_at = TakeExact(messages[i]);
      if (asked_at && options_.half_duplex && !has_round) {
        Require(now_ >= *asked_at + options_.timing.EarliestAnswer());
        Require(now_ <= *asked_at + options_.timing.LatestAnswer(options_.response_window));
      }
    }
    if (has_round) {
      TakeRound(round);
    }
  }

  void TakeRound(const protocol::Round& round) {
    const int step = turns_.empty() && (number_ + 2) % protocol::kEventRounds == 0 ? 2 : 1;
    Require(round.number == static_cast<uint8_t>(number_ + step));
    Require(round.answer_count == turns_.size());
    constexpr auto kNotYet = static_cast<int16_t>(protocol::Reason::kBusy);  // nothing here is busy
    for (size_t i = 0; i < turns_.size(); ++i) {
      const protocol::RoundAnswer& answer = round.answers[i];
      if (answer.left == protocol::kNoIntensities && answer.right == kNotYet) {
        Require(heard_[turns_[i]] > 0);
      } else if (answer.left != protocol::kNoIntensities || answer.right != 0) {
        TakeAnswer(turns_[i], answer);
      }
    }
    number_ = round.number;
    told_.clear();
    for (size_t i = 0; i < turns_.size(); ++i) {
      if (round.answers[i].left != protocol::kNoIntensities) {
        told_.emplace(turns_[i], round.answers[i]);
      }
    }
    turns_.assign(round.turns, round.turns + round.turn_count);
    heard_.clear();
    turn_ = round.turn_ms * 1ms;
    Require(turns_.empty() ||
            turn_ >= options_.timing.turnaround + round.turn_bytes * options_.timing.byte);
    reserved_until_ = sent_at_ + options_.timing.Transit();
    if (!turns_.empty()) {
      reserved_until_ += protocol::kBeforeTurnsMs * 1ms + round.turn_count * turn_;
    }
  }

  // Intensities of the last ROUND, once, to a robot that had a turn in it and was not heard.
  bool TakeSaidAgain(const protocol::Message& message) {
    protocol::SenseAnswer sense;
    if (!Decode(message, &sense) || std::count(turns_.begin(), turns_.end(), message.id) == 0) {
      return false;
    }
    const auto told = std::find_if(told_.begin(), told_.end(), [&](const auto& it) {
      return it.first == message.id && it.second.left == sense.left &&
             it.second.right == sense.right;
    });
    if (told == told_.end()) {
      return false;
    }
    told_.erase(told);
    return true;
  }

  // Whether each robot has been heard as often as it was given a turn, or the time of it is over.
  bool TurnsAreOver() {
    std::map<uint8_t, int> left = heard_;
    Time end = reserved_until_ - static_cast<int64_t>(turns_.size()) * turn_;
    return std::all_of(turns_.begin(), turns_.end(), [&](uint8_t id) {
      end += turn_;
      return --left[id] >= 0 || now_ >= end;
    });
  }

  std::optional<Time> TakeExact(const protocol::Message& message) {
    return Take([&message](const protocol::Message& it) { return Same(it, message); });
  }

  void TakeAnswer(uint8_t id, const protocol::RoundAnswer& answer) {
    Take([&](const protocol::Message& it) {
      protocol::SenseAnswer sense;
      protocol::ErrorAnswer error;
      return it.id == id &&
             ((Decode(it, &sense) && sense.left == answer.left && sense.right == answer.right) ||
              (Decode(it, &error) && answer.left == protocol::kNoIntensities &&
               static_cast<int16_t>(error.reason) == answer.right));
    });
  }

  // Something that waits leaves, once.
  template <typename Is>
  std::optional<Time> Take(Is is) {
    const auto at = std::find_if(waiting_.begin(), waiting_.end(),
                                 [&is](const Waiting& it) { return is(it.message); });
    Require(at != waiting_.end());
    waiting_bytes_ -= FrameOf(at->message).size();
    const std::optional<Time> asked_at = at->asked_at;
    waiting_.erase(at);
    return asked_at;
  }

  static constexpr size_t kMaxRequests = 32;
  static constexpr int kMaxSteps = 1'000;

  const ChannelOptions options_;
  Time now_ = 1h;
  std::deque<Request> requests_;
  std::deque<Waiting> waiting_;
  size_t waiting_bytes_ = 0;
  std::vector<uint8_t> turns_;                          // of the last ROUND
  std::multimap<uint8_t, protocol::RoundAnswer> told_;  // the intensities in it
  std::map<uint8_t, int> heard_;                        // since then, by ID
  Time sent_at_{};
  Duration turn_{};
  Time reserved_until_{};
  uint16_t unique_ = 0;
  uint8_t number_ = 0;
  Channel channel_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  Input in(data, size);
  Driver driver(TakeOptions(&in));
  driver.Run(&in);
  return 0;
}
