#include "proto_tests/attacked_channel/attacker.h"

#include <algorithm>
#include <utility>

#include "protocol/coded_frame.h"
#include "protocol/frame.h"

namespace pheromone::attack {
namespace {

constexpr int64_t kMs = 1'000'000;
constexpr int64_t kSilenceNs = 4 * kMs;
constexpr int kReplayedOfASession = 20;
// Section 18: what is behind DATA.
constexpr uint8_t kAddedToOne = 5;
constexpr uint8_t kAddedToAll = 6;

std::vector<uint8_t> FrameOf(const protocol::Message& message) {
  std::vector<uint8_t> bytes(protocol::kMaxFrame);
  bytes.resize(protocol::EncodeFrame(message, bytes.data(), bytes.size()));
  return bytes;
}

bool ReadRound(protocol::Message message, protocol::Round* round) {
  if (Decode(message, round)) {
    return true;
  }
  if (message.length < kAddedToAll) {
    return false;
  }
  message.length = static_cast<uint8_t>(message.length - kAddedToAll);
  return Decode(message, round);
}

}  // namespace

Attacker::Attacker(uint64_t seed, sim::RadioMedium* medium)
    : medium_(medium),
      ear_(medium->AddStation(this)),
      number_(medium->AddStation(&transmitter_, 0)),
      random_(seed) {
  medium->Hide(ear_, number_);
}

void Attacker::OnByte(uint8_t byte, int64_t time_ns) {
  burst_.push_back(byte);
  last_byte_ns_ = time_ns;
  if (decoder_.Push(byte, static_cast<uint32_t>(time_ns / kMs))) {
    has_frame_ = true;
    OnFrame(decoder_.message());
  }
}

void Attacker::Step() {
  const int64_t now_ns = medium_->now_ns();
  if (now_ns - last_byte_ns_ > kSilenceNs && !burst_.empty()) {
    if (has_frame_) {
      bursts_.push_back(burst_);
    }
    burst_.clear();
    has_frame_ = false;
  }
  while (!planned_.empty() && planned_.front().at_ns <= now_ns) {
    Send(planned_.front().bytes);
    planned_.pop_front();
  }
  const bool silent = now_ns - last_byte_ns_ > kSilenceNs && !medium_->Busy(ear_);
  if (way_ == Way::kJams && Chance(silent ? 0.05 : 0.015)) {
    Send(Anything());
  } else if (way_ == Way::kSneaks && silent && Chance(0.006)) {
    Send(Anything());
  }
}

void Attacker::Send(const Bytes& bytes) {
  if (!medium_->Sending(number_)) {
    medium_->Transmit(number_, bytes);
  }
}

void Attacker::Plan(int64_t after_ns, Bytes bytes) {
  const int64_t at_ns = medium_->now_ns() + after_ns;
  const auto later = std::find_if(planned_.begin(), planned_.end(),
                                  [at_ns](const Planned& it) { return it.at_ns > at_ns; });
  planned_.insert(later, {at_ns, std::move(bytes)});
}

void Attacker::OnFrame(const Message& message) {
  messages_.push_back(message);
  const bool of_server = protocol::IsFromServer(message.opcode);
  last_[{message.id, of_server}] = message;
  if (message.opcode == protocol::kCommand) {
    commands_.push_back(message);
  }
  const double zeal = way_ == Way::kListens ? 0 : way_ == Way::kSneaks ? 0.06 : 0.5;
  protocol::Round round;
  if (ReadRound(message, &round)) {
    round_ = round;
    if (Chance(zeal)) {
      OnRound(round);
    }
  } else if (!of_server && Chance(zeal)) {
    OnRequest(message);
  }
}

// Before the server has answered.
void Attacker::OnRequest(const Message& request) {
  Plan(0, Draw(3) == 0 ? Recorded(8) : Answer(request.id));
}

void Attacker::OnRound(const protocol::Round& round) {
  const int64_t turn_ns = round.turn_ms * kMs;
  const int64_t turns_ns = kMs + round.turn_count * turn_ns;
  switch (Draw(4)) {
    case 0:  // in a turn, often before the robot whose it is
      if (round.turn_count != 0) {
        const uint32_t turn = Draw(round.turn_count);
        Plan(kMs + turn * turn_ns - kMs * Draw(4), Request(round.turns[turn]));
      }
      break;
    case 1:  // in the opening
      Plan(turns_ns + kMs * Draw(1 + round.slot_ms * 8u), Anything());
      break;
    default:  // before the server
      Plan(turns_ns, ForgedRound(static_cast<uint8_t>(round.number + 1), round));
  }
}

std::vector<uint8_t> Attacker::Anything() {
  if (bursts_.empty()) {
    return Request(AnyId());
  }
  switch (Draw(11)) {
    case 0:
      return Recorded(8);
    case 1:
      return Recorded(bursts_.size());
    case 2:
      return NextOfSession();
    case 3:
      return RecordedCommand();
    case 4:
    case 5:
      return Changed();
    case 6:
    case 7:
      return Request(AnyId());
    case 8:
      return Command();
    case 9:
      return Answer(AnyId());
    default:
      return ForgedRound(static_cast<uint8_t>(round_.number + Draw(3)), round_);
  }
}

// As it was on the air, one of the newest.
std::vector<uint8_t> Attacker::Recorded(size_t newest) {
  if (bursts_.empty()) {
    return Request(AnyId());
  }
  ++sent_["recorded"];
  const auto among = static_cast<uint32_t>(std::min(newest, bursts_.size()));
  return bursts_[bursts_.size() - 1 - Draw(among)];
}

// From somewhere on in the order in which it was heard, now and then from a HELLO on.
std::vector<uint8_t> Attacker::NextOfSession() {
  if (session_left_ == 0 || session_ >= bursts_.size()) {
    session_left_ = kReplayedOfASession;
    session_ = Draw(static_cast<uint32_t>(bursts_.size()));
    while (session_ + 1 < bursts_.size() &&
           (bursts_[session_].size() < 4 || bursts_[session_][3] != protocol::kHello)) {
      ++session_;
    }
  }
  --session_left_;
  ++sent_["session"];
  return bursts_[session_++];
}

std::vector<uint8_t> Attacker::RecordedCommand() {
  if (commands_.empty()) {
    return Command();
  }
  ++sent_["recorded command"];
  return FrameOf(commands_[Draw(static_cast<uint32_t>(commands_.size()))]);
}

// Something that was heard, with a right CRC.
std::vector<uint8_t> Attacker::Changed() {
  Message message = messages_[Draw(static_cast<uint32_t>(messages_.size()))];
  switch (Draw(5)) {
    case 0:
      message.id = AnyId();
      break;
    case 1:
      message.opcode = messages_[Draw(static_cast<uint32_t>(messages_.size()))].opcode;
      break;
    case 2:
      if (message.length != 0) {
        uint8_t* const byte = &message.data[Draw(message.length)];
        *byte = static_cast<uint8_t>(*byte ^ 1u << Draw(8));
      }
      break;
    case 3:
      message.length = static_cast<uint8_t>(
          std::max(0, message.length - (Draw(2) == 0 ? kAddedToOne : kAddedToAll)));
      break;
    default: {  // the head of one, the signature of another
      const Message& other = messages_[Draw(static_cast<uint32_t>(messages_.size()))];
      for (int i = 1; i <= std::min<int>({message.length, other.length, kAddedToOne}); ++i) {
        message.data[message.length - i] = other.data[other.length - i];
      }
    }
  }
  ++sent_["changed"];
  return FrameOf(message);
}

std::vector<uint8_t> Attacker::Request(uint8_t id) {
  const auto seq = static_cast<uint8_t>(Draw(256));
  const auto x = static_cast<int16_t>(Draw(4000) - 2000);
  const auto y = static_cast<int16_t>(Draw(4000) - 500);
  Message message;
  switch (Draw(6)) {
    case 0:
      if (Draw(2) == 0) {
        id = static_cast<uint8_t>(1 + Draw(254));
      }
      Encode(protocol::HelloRequest{id, static_cast<uint16_t>(Draw(1u << 16)), 1, 10}, &message);
      break;
    case 1:
      Encode(protocol::EventReport{id, seq, protocol::EventCode::kLoadPicked, kForgedArgument},
             &message);
      break;
    case 2:
      Encode(protocol::TraceRequest{id, 1, false, seq, {x, y, 0}}, &message);
      break;
    case 3:
      Encode(
          protocol::CommandAck{id, static_cast<uint8_t>(Draw(8)), protocol::CommandCode::kHalt, 0},
          &message);
      break;
    default:
      Encode(protocol::DepositRequest{id, 1, seq, x, y, static_cast<uint8_t>(1 + Draw(255))},
             &message);
  }
  return Dressed("request", message);
}

std::vector<uint8_t> Attacker::Command() {
  using Code = protocol::CommandCode;
  protocol::Command command;
  command.id = Draw(6) == 0 ? protocol::kBroadcastId : AnyId();
  command.seq = static_cast<uint8_t>(Draw(256));
  constexpr std::array kCodes = {Code::kResume, Code::kResume, Code::kHalt,
                                 Code::kSpeed,  Code::kGoTo,   Code::kSetParameter};
  command.code = kCodes[Draw(kCodes.size())];
  for (uint8_t& argument : command.arguments) {
    argument = static_cast<uint8_t>(Draw(256));
  }
  Message message;
  Encode(command, &message);
  return Dressed("command", message);
}

std::vector<uint8_t> Attacker::Answer(uint8_t id) {
  const auto found = last_.find({id, false});
  const auto seq = static_cast<uint8_t>(
      found == last_.end() || found->second.length == 0 ? Draw(256) : found->second.data[0]);
  Message message;
  switch (Draw(5)) {
    case 0:
      Encode(protocol::TraceAnswer{id, 1, false, seq, kForgedIntensity, kForgedIntensity},
             &message);
      break;
    case 1:
      Encode(protocol::SenseAnswer{id, static_cast<uint8_t>(1 + Draw(2)), false, kForgedIntensity,
                                   kForgedIntensity},
             &message);
      break;
    case 2:
      Encode(protocol::EventAck{id, seq}, &message);
      break;
    case 3:
      Encode(protocol::ErrorAnswer{id,
                                   static_cast<uint8_t>(found == last_.end()
                                                            ? uint8_t{protocol::kHello}
                                                            : found->second.opcode),
                                   static_cast<protocol::Reason>(1 + Draw(12)), seq},
             &message);
      break;
    default:  // to HELLO, in either form
      message.id = id;
      message.opcode = protocol::kHelloAnswer;
      message.length = Draw(2) == 0 ? 34 : 20;
      std::generate(message.data, message.data + message.length,
                    [this] { return static_cast<uint8_t>(Draw(256)); });
      if (found != last_.end() && found->second.opcode == protocol::kHello) {
        std::copy_n(found->second.data, 2, message.data);  // its nonce
      }
  }
  return Dressed("answer", message);
}

// Of the round after `like`: the answers that it awaits, all of them forged.
std::vector<uint8_t> Attacker::ForgedRound(uint8_t number, const protocol::Round& like) {
  protocol::Round round = like;
  round.number = number;
  round.answer_count = like.turn_count;
  for (protocol::RoundAnswer& answer : round.answers) {
    answer = {kForgedIntensity, kForgedIntensity};
  }
  Message message;
  Encode(round, &message);
  if (Draw(3) != 0) {
    return Dressed("round", message);
  }
  ++sent_["coded round"];
  Bytes bytes(protocol::kMaxCoded);
  bytes.resize(protocol::EncodeCoded(message, bytes.data()));
  return bytes;
}

// Without a signature, with one that is guessed, or with the last one of that station and the next
// counter.
std::vector<uint8_t> Attacker::Dressed(const char* what, Message message) {
  ++sent_[what];
  const uint8_t added = message.id == protocol::kBroadcastId ? kAddedToAll : kAddedToOne;
  const uint32_t way = Draw(3);
  if (way == 0 || message.length + added > protocol::kMaxData) {
    return FrameOf(message);
  }
  uint8_t* const signature = message.data + message.length;
  std::generate(signature, signature + added, [this] { return static_cast<uint8_t>(Draw(256)); });
  message.length = static_cast<uint8_t>(message.length + added);
  const auto last = last_.find({message.id, protocol::IsFromServer(message.opcode)});
  if (way == 2 && last != last_.end() && last->second.length >= added) {
    std::copy_n(last->second.data + last->second.length - added, added, signature);
    ++*signature;
  }
  return FrameOf(message);
}

// Mostly one that was heard.
uint8_t Attacker::AnyId() {
  if (!messages_.empty() && Draw(5) != 0) {
    const uint8_t id = messages_[Draw(static_cast<uint32_t>(messages_.size()))].id;
    if (id != protocol::kBroadcastId) {
      return id;
    }
  }
  return static_cast<uint8_t>(1 + Draw(Draw(2) == 0 ? 5 : 254));
}

}  // namespace pheromone::attack
