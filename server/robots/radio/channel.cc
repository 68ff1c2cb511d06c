#include "server/robots/radio/channel.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include "protocol/coded_frame.h"
#include "protocol/fields.h"
#include "protocol/messages.h"
#include "protocol/signing.h"

namespace pheromone::radio {
namespace {

constexpr Time kLongAgo = -std::chrono::hours(1);

std::vector<uint8_t> FrameOf(const protocol::Message& message) {
  std::vector<uint8_t> frame(protocol::kMaxFrame);
  frame.resize(protocol::EncodeFrame(message, frame.data(), frame.size()));
  return frame;
}

std::vector<uint8_t> CodedFrameOf(const protocol::Message& message) {
  std::vector<uint8_t> frame(protocol::kMaxCoded);
  frame.resize(protocol::EncodeCoded(message, frame.data()));
  return frame;
}

void AppendBytes(const std::vector<uint8_t>& frame, Transmission* out) {
  out->bytes.insert(out->bytes.end(), frame.begin(), frame.end());
  out->frame_ends.push_back(out->bytes.size());
}

// What was not a whole frame.
uint32_t Damaged(const protocol::DecoderCounters& counters) {
  return counters.crc_errors + counters.bad_escapes + counters.oversize + counters.runts +
         counters.restarts + counters.timeouts + counters.ignored_bytes;
}

bool IsCommand(const protocol::Message& message) {
  return message.opcode == protocol::kCommand;
}

// A COMMAND to one robot is acknowledged, one to all is not.
bool IsAcknowledged(const protocol::Message& message) {
  return IsCommand(message) && message.id != protocol::kBroadcastId;
}

}  // namespace

Channel::Channel(const ChannelOptions& options, OnDropped on_dropped)
    : options_(options),
      on_dropped_(std::move(on_dropped)),
      decoder_(options.gap_timeout_ms),
      rounds_(options),
      heard_at_(kLongAgo),
      free_at_(kLongAgo) {}

uint32_t Channel::DecoderTime(Time at) {
  return static_cast<uint32_t>(std::chrono::floor<std::chrono::milliseconds>(at).count());
}

void Channel::Resume(const std::vector<RoundMember>& members, Time now) {
  heard_at_ = now;  // who sends at present is waited for
  if (options_.half_duplex) {
    rounds_.Resume(members, now);
  }
}

void Channel::Hear(std::span<const uint8_t> bytes, Time now, Time since,
                   std::vector<protocol::Message>* messages) {
  heard_at_ = now;
  refused_.clear();
  const uint32_t damaged = Damaged(decoder_.counters());
  decoder_.PushBlock(bytes.data(), bytes.size(), DecoderTime(now), [&](protocol::Message message) {
    if (options_.signing != nullptr && !Open(&message, now, since)) {
      return;
    }
    messages->push_back(message);
    if (options_.half_duplex) {
      rounds_.OnHeard(message, now, since);
      NoteAck(message);
    }
  });
  if (options_.half_duplex) {
    rounds_.OnBytes(now, Damaged(decoder_.counters()) != damaged);
  }
}

// Answers a first HELLO by itself. True: a message for the server.
bool Channel::Open(protocol::Message* message, Time now, Time since) {
  protocol::Message received = *message;
  switch (options_.signing->Open(message, now)) {
    case signing::Opened::kMessage:
      return true;
    case signing::Opened::kGreeting:
      refused_.push_back(received);
      if (options_.half_duplex) {  // it may be in a turn, and is then answered with the ROUND
        received.length = static_cast<uint8_t>(received.length - protocol::kSignature);
        rounds_.OnHeard(received, now, since);
      }
      Answer(*message, now, now);
      return false;
    case signing::Opened::kIgnore:
      break;
  }
  refused_.push_back(received);
  return false;
}

void Channel::Answer(const protocol::Message& message, Time asked_at, Time now) {
  if (!options_.half_duplex) {
    Enqueue(message, asked_at);
    return;
  }
  if (rounds_.TakeAnswer(message, asked_at)) {
    return;
  }
  // ERRORs must not crowd out other answers.
  if (message.opcode == protocol::kError) {
    if (last_error_ && now - *last_error_ < options_.response_window) {
      ++counters_.withheld_errors;
      on_dropped_(message);
      return;
    }
    last_error_ = now;
  }
  Enqueue(message, asked_at);
}

void Channel::Send(const protocol::Message& message) {
  // It replaces the COMMAND before it that has not left yet, as it does in the engine.
  if (options_.half_duplex && IsCommand(message)) {
    for (Frame& frame : queue_) {
      if (!frame.asked_at && IsCommand(frame.message) && frame.message.id == message.id) {
        on_dropped_(frame.message);
        queued_bytes_ -= frame.bytes.size();
        frame = {message, FrameOf(message), std::nullopt};
        queued_bytes_ += frame.bytes.size();
        return;
      }
    }
  }
  Enqueue(message, std::nullopt);
}

void Channel::Enqueue(const protocol::Message& message, std::optional<Time> asked_at) {
  Frame frame{message, FrameOf(message), asked_at};
  queued_bytes_ += frame.bytes.size();
  // What nobody asked for must not delay an answer for which a robot's window is open.
  const auto place =
      options_.half_duplex && frame.asked_at
          ? std::find_if(queue_.begin(), queue_.end(), [](const Frame& it) { return !it.asked_at; })
          : queue_.end();
  queue_.insert(place, std::move(frame));
  while (queued_bytes_ > kMaxQueue) {
    ++counters_.dropped_answers;
    DropFront();
  }
}

Channel::Frame Channel::Take(const std::deque<Frame>::iterator& at) {
  Frame frame = std::move(*at);
  queued_bytes_ -= frame.bytes.size();
  queue_.erase(at);
  return frame;
}

void Channel::DropFront() {
  on_dropped_(Take(queue_.begin()).message);
}

void Channel::DropAll() {
  while (!queue_.empty()) {
    DropFront();
  }
  for (const protocol::Message& answer : rounds_.DropAnswers()) {
    on_dropped_(answer);
  }
}

bool Channel::IsLate(const Frame& frame, Time start) const {
  return options_.half_duplex && frame.asked_at &&
         start > *frame.asked_at + options_.timing.LatestAnswer(options_.response_window);
}

// It is not awaited any more. The engine repeats a COMMAND of which it has no ACK yet, and a full
// round takes longer than it waits.
void Channel::NoteAck(const protocol::Message& heard) {
  protocol::CommandAck ack;
  if (!Decode(heard, &ack)) {
    return;
  }
  ack_until_ = Time::min();
  const auto repeated = std::find_if(queue_.begin(), queue_.end(), [&ack](const Frame& it) {
    protocol::Command command;
    return !it.asked_at && Decode(it.message, &command) && command.id == ack.id &&
           command.seq == ack.seq;
  });
  if (repeated != queue_.end()) {
    on_dropped_(Take(repeated).message);
  }
}

// The channel is free for what nobody waits for.
Time Channel::FreeAt() const {
  const Duration idle = options_.timing.Idle();
  const Duration gap = std::chrono::milliseconds(options_.gap_timeout_ms);
  const Duration silence = decoder_.frame_open() ? std::max(gap, idle) : idle;
  return std::max({heard_at_ + silence, free_at_ + idle, ack_until_, rounds_.reserved_until()});
}

Time Channel::AnswerAt(const Frame& frame) const {
  return std::max(
      {*frame.asked_at + options_.timing.EarliestAnswer(), free_at_, rounds_.reserved_until()});
}

Time Channel::RoundAt() const {
  const Time due = rounds_.NextRound();
  if (due == kNever || !rounds_.follows()) {
    return due == kNever ? due : std::max(due, FreeAt());
  }
  // Nobody else may send: only a frame that is late is waited for, and an ACK.
  const Duration open = decoder_.frame_open() ? std::chrono::milliseconds(options_.gap_timeout_ms)
                                              : options_.timing.byte;
  return std::max({due, free_at_, heard_at_ + open, ack_until_});
}

Channel::Start Channel::Next(Time now) {
  if (!options_.half_duplex) {
    return queue_.empty() ? Start{} : Start{now, What::kAnswer};
  }
  while (!queue_.empty() && IsLate(queue_.front(), std::max(now, AnswerAt(queue_.front())))) {
    ++counters_.late_answers;
    DropFront();
  }
  if (!queue_.empty() && queue_.front().asked_at) {
    return {AnswerAt(queue_.front()), What::kAnswer};
  }
  Start next;
  if (rounds_.active()) {
    next = {RoundAt(), What::kRound};
  }
  if (!queue_.empty() && !rounds_.follows()) {
    const Time at = FreeAt();
    if (at < next.at) {
      next = {at, What::kOther};
    }
  }
  return next;
}

Time Channel::NextStart(Time now) {
  return Next(now).at;
}

bool Channel::IsClear(bool carrier, Time now) {
  constexpr Duration kLookedAway = std::chrono::milliseconds(100);
  if (!carrier) {
    carrier_since_ = kNever;
    return true;
  }
  if (carrier_since_ == kNever || now - carrier_until_ > kLookedAway) {
    carrier_since_ = now;
  }
  carrier_until_ = now;
  if (now - carrier_since_ < kLongestCarrier) {
    return false;
  }
  ++counters_.ignored_carriers;
  return true;
}

// Whether it is an answer to HELLO that may be lost otherwise. In good air a coded one only takes
// longer.
bool Channel::IsToBeCoded(const protocol::Message& sealed) const {
  constexpr uint8_t kUnsigned = protocol::SizeOf<protocol::HelloAnswer>().least;
  return options_.half_duplex && sealed.opcode == protocol::kHelloAnswer &&
         sealed.length > kUnsigned && (options_.signing->greeted_before() || rounds_.coded());
}

// The message's frame as it leaves; nothing if its robot could not accept it.
std::optional<std::vector<uint8_t>> Channel::Sealed(const protocol::Message& message) const {
  protocol::Message sealed = message;
  const bool is_ready = options_.to_all_is_signed && message.id == protocol::kBroadcastId;
  if (!is_ready && options_.signing != nullptr && !options_.signing->Sign(&sealed)) {
    on_dropped_(message);
    return std::nullopt;
  }
  return IsToBeCoded(sealed) ? CodedFrameOf(sealed) : FrameOf(sealed);
}

bool Channel::Append(const Frame& frame, Transmission* out) {
  const auto sealed = options_.signing != nullptr ? Sealed(frame.message) : frame.bytes;
  if (!sealed) {
    return false;
  }
  AppendBytes(*sealed, out);
  out->parts.push_back({frame.message, out->bytes.size()});
  return true;
}

// The server has the channel, and this robot listens.
void Channel::AppendRider(uint8_t id, Transmission* out) {
  const auto rider = std::find_if(queue_.begin(), queue_.end(), [id](const Frame& it) {
    return !it.asked_at && IsCommand(it.message) && it.message.id == id;
  });
  if (rider != queue_.end()) {
    awaits_ack_ = Append(Take(rider), out);
  }
}

// COMMANDs precede the ROUND; the robots that take part in rounds get a turn for the ACK.
void Channel::AppendRound(Time now, Transmission* out) {
  constexpr int kMostCommands = 2;
  std::vector<uint8_t> acks;
  for (int i = 0; i < kMostCommands; ++i) {
    const auto command = std::find_if(queue_.begin(), queue_.end(), [this](const Frame& it) {
      return !it.asked_at && (!IsAcknowledged(it.message) || rounds_.serves(it.message.id));
    });
    if (command == queue_.end()) {
      break;
    }
    const Frame frame = Take(command);
    if (Append(frame, out) && IsAcknowledged(frame.message)) {
      acks.push_back(frame.message.id);
    }
  }
  const Rounds::Composed composed = rounds_.Compose(now, acks);
  for (const protocol::Message& answer : composed.again) {
    if (const auto sealed = Sealed(answer)) {
      AppendBytes(*sealed, out);
    }
  }
  for (const protocol::Message& answer : composed.answers) {
    const size_t begin = out->bytes.size();
    const Frame frame{answer, FrameOf(answer), std::nullopt};
    // What cannot be coded is sent twice.
    if (Append(frame, out) && rounds_.coded() && out->bytes[begin + 3] != protocol::kCodedHello) {
      AppendBytes({out->bytes.begin() + static_cast<std::ptrdiff_t>(begin), out->bytes.end()}, out);
    }
  }
  protocol::Message round = composed.round;
  if (options_.signing != nullptr) {
    options_.signing->Sign(&round);
  }
  AppendBytes(rounds_.coded() ? CodedFrameOf(round) : FrameOf(round), out);
  for (const protocol::Message& answer : composed.in_round) {
    out->parts.push_back({answer, out->bytes.size()});
  }
  sent_round_ = true;
}

Transmission Channel::Begin(Time now) {
  Transmission out;
  const Start next = Next(now);
  if (next.what == What::kNothing || next.at > now) {
    return out;
  }
  const Duration lead = options_.timing.keyed ? options_.timing.lead : Duration(0);
  const auto end = [&] {
    return now + lead + static_cast<int64_t>(out.bytes.size()) * options_.timing.byte;
  };
  awaits_ack_ = false;
  sent_round_ = false;
  if (!options_.half_duplex) {
    for (const Frame& frame : queue_) {
      Append(frame, &out);
    }
    queue_.clear();
    queued_bytes_ = 0;
  } else if (next.what == What::kRound) {
    AppendRound(now, &out);
  } else {
    const Frame frame = Take(queue_.begin());
    awaits_ack_ = Append(frame, &out) && IsAcknowledged(frame.message);
    if (frame.asked_at) {
      AppendRider(frame.message.id, &out);
      const bool more = !queue_.empty() && queue_.front().asked_at;
      rounds_.OnAnswered(end());
      // Otherwise those who contend would leave no silence for it.
      if (!awaits_ack_ && !more && rounds_.NextRound() <= end() + options_.timing.Transit()) {
        AppendRound(end(), &out);
      }
    }
  }
  OnSent(end());
  return out;
}

void Channel::OnSent(Time end) {
  free_at_ = end;
  if (awaits_ack_) {
    ack_until_ = end + options_.timing.LatestAck(options_.response_window);
  }
  if (sent_round_) {
    rounds_.OnSent(end);
  } else {
    rounds_.OnAnswered(end);
  }
}

ChannelCounters Channel::counters() const {
  ChannelCounters all = counters_;
  all.rounds = rounds_.counters();
  return all;
}

}  // namespace pheromone::radio
