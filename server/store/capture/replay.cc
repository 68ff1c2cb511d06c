#include "server/store/capture/replay.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "protocol/coded_frame.h"
#include "protocol/signing.h"
#include "server/base/bytes.h"
#include "server/base/format.h"
#include "server/store/capture/recorder.h"

namespace pheromone::capture {
namespace {

constexpr char kNoStart[] = "a record before the initial state is complete";
constexpr uint64_t kMaxState = uint64_t{1} << 40;

std::string Hex(std::string_view bytes) {
  std::string text;
  for (const char c : bytes) {
    std::array<char, 4> digits{};
    std::snprintf(digits.data(), digits.size(), "%02X", static_cast<unsigned char>(c));
    text += (text.empty() ? "" : " ") + std::string(digits.data());
  }
  return text;
}

std::string FrameOf(const protocol::Message& message) {
  std::array<uint8_t, protocol::kMaxFrame> wire{};
  const size_t size = protocol::EncodeFrame(message, wire.data(), wire.size());
  return {wire.begin(), wire.begin() + static_cast<std::ptrdiff_t>(size)};
}

std::string CodedFrameOf(const protocol::Message& message) {
  std::array<uint8_t, protocol::kMaxCoded> wire{};
  const size_t size = protocol::EncodeCoded(message, wire.data());
  return {wire.begin(), wire.begin() + static_cast<std::ptrdiff_t>(size)};
}

// Removes the message's frame from the beginning of `bytes`, if it is there in one of its forms.
void RemoveFrame(const protocol::Message& message, std::string_view* bytes) {
  const bool may_be_coded =
      message.opcode == protocol::kRound || message.opcode == protocol::kHelloAnswer;
  std::string frame = FrameOf(message);
  if (may_be_coded && !bytes->starts_with(frame)) {
    frame = CodedFrameOf(message);
  }
  bytes->remove_prefix(bytes->starts_with(frame) ? frame.size() : 0);
}

bool IsIntensities(const protocol::Message& message) {
  const auto is = [](const protocol::Message& plain) {
    protocol::SenseAnswer sense;
    protocol::TraceAnswer trace;
    return Decode(plain, &sense) || Decode(plain, &trace);
  };
  return is(message) || is(protocol::WithoutSignature(message));
}

std::string HexOf(const protocol::Message& message) {
  return Hex(FrameOf(message));
}

std::string Seconds(uint64_t from_ns, uint64_t to_ns) {
  const bool before = to_ns < from_ns;
  const uint64_t ns = before ? from_ns - to_ns : to_ns - from_ns;
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), "%s%llu.%09llu s", before ? "-" : "",
                static_cast<unsigned long long>(ns / 1'000'000'000),
                static_cast<unsigned long long>(ns % 1'000'000'000));
  return text.data();
}

}  // namespace

Status Replay::Take(const Found& found) {
  const bool has_start = found.number > 1;
  std::string wrong;
  if (has_start != !std::holds_alternative<Start>(found.record)) {
    wrong = has_start ? "a second start" : "no start";
  } else if (ended_) {
    wrong = "a record after the end";
  } else if (!engine_ && has_start && !std::holds_alternative<State>(found.record)) {
    wrong = kNoStart;
  } else {
    wrong = std::visit([this](const auto& it) { return On(it); }, found.record);
  }
  if (wrong.empty()) {
    return Ok();
  }
  return Error{
      "record " + std::to_string(found.number) + ", after packet " +
      std::to_string(found.packet - (std::holds_alternative<Packet>(found.record) ? 1 : 0)) + ", " +
      Seconds(start_.utc_ns, time_ns_) + " after the start: " + wrong};
}

Status Replay::Finish() const {
  return ended_ ? Ok()
                : Error{
                      "the recording has no end record: no difference so far, but the final state "
                      "is unknown"};
}

std::string Replay::LinkName(engine::LinkIndex link) const {
  return link < start_.links.size() ? "link " + start_.links[link].name
                                    : "link " + std::to_string(link);
}

// --- The start.

std::string Replay::On(const Start& start) {
  start_ = start;
  time_ns_ = start.utc_ns;
  for (const Sent& sent : start.under_way) {
    in_flight_.Add(sent);
  }
  return start.state_bytes > kMaxState
             ? "a state of " + std::to_string(start.state_bytes) + " bytes"
             : "";
}

std::string Replay::On(const State& portion) {
  if (engine_ || portion.bytes.size() > start_.state_bytes - state_.size()) {
    return "more state data than announced";
  }
  state_ += portion.bytes;
  if (state_.size() < start_.state_bytes) {
    return "";
  }
  ByteReader reader(state_);
  Result<engine::Engine> restored = engine::Engine::Restore(&reader);
  reader.ExpectEnd();
  if (!restored.ok() || !reader.ok()) {
    return "the initial state: " + (restored.ok() ? reader.error() : restored.error());
  }
  engine_ = std::move(restored).value();
  state_ = {};
  field_time_ms_ = engine_->field_time_ms();
  return "";
}

// --- What was read.

protocol::FrameDecoder& Replay::DecoderOf(engine::LinkIndex link, uint32_t connection) {
  return decoders_
      .try_emplace({link, connection}, protocol::FrameDecoder(start_.links[link].gap_timeout_ms))
      .first->second;
}

std::string Replay::On(const PartialFrame& partial) {
  if (partial.link >= start_.links.size() ||
      decoders_.contains({partial.link, partial.connection})) {
    return "a partial frame of a known connection or of an unknown link";
  }
  std::string wrong;
  DecoderOf(partial.link, partial.connection)
      .PushBlock(reinterpret_cast<const uint8_t*>(partial.bytes.data()), partial.bytes.size(),
                 partial.read_ms,
                 [&wrong](const auto&) { wrong = "a complete frame in place of a partial one"; });
  return wrong;
}

std::string Replay::On(const Packet& packet) {
  if (packet.link >= start_.links.size()) {
    return "a packet of an unknown link";
  }
  time_ns_ = packet.utc_ns;
  ++report_.packets;
  if (packet.direction == Direction::kToRobots) {
    return TakeWritten(packet);
  }
  std::deque<protocol::Message>& decoded = decoded_[packet.link];
  const bool datagrams = start_.links[packet.link].datagrams;
  if (!datagrams && !decoded.empty()) {
    return LinkName(packet.link) + ": expected the message decoded from the previous bytes, " +
           HexOf(decoded.front()) + ", to be handed to the engine; found other bytes";
  }
  protocol::FrameDecoder own(protocol::kNoGapTimeout);
  (datagrams ? own : DecoderOf(packet.link, packet.connection))
      .PushBlock(reinterpret_cast<const uint8_t*>(packet.bytes.data()), packet.bytes.size(),
                 packet.read_ms,
                 [&decoded](const protocol::Message& message) { decoded.push_back(message); });
  return "";
}

std::string Replay::On(const Rejected& turned) {
  std::deque<protocol::Message>& decoded = decoded_[turned.link];
  const auto at = std::find_if(decoded.begin(), decoded.end(),
                               [&](const auto& it) { return Same(it, turned.message); });
  if (at == decoded.end()) {
    return LinkName(turned.link) + ": rejected a message that was not decoded from its bytes, " +
           HexOf(turned.message);
  }
  decoded.erase(at);
  if (turned.answer != protocol::Reason::kNone) {
    in_flight_.Add({turned.link, engine::ErrorMessage(turned.message, turned.answer)});
  }
  return "";
}

// --- What the engine does.

std::string Replay::On(const Batch& batch) {
  if (batch.link >= start_.links.size()) {
    return "a batch of an unknown link";
  }
  if (batch.number != ++batch_) {
    return "expected batch " + std::to_string(batch_) + ", found " + std::to_string(batch.number);
  }
  if (batch.stamp.field_time_ms < field_time_ms_) {
    return "field time decreases";
  }
  field_time_ms_ = batch.stamp.field_time_ms;
  for (const Handled& handled : batch.messages) {
    std::string wrong = TakeOne(batch, handled);
    if (!wrong.empty()) {
      return LinkName(batch.link) + ", batch " + std::to_string(batch.number) + ": " + wrong;
    }
  }
  return "";
}

std::string Replay::TakeOne(const Batch& batch, const Handled& handled) {
  std::deque<protocol::Message>& decoded = decoded_[batch.link];
  if (decoded.empty() || !(Same(decoded.front(), handled.message) ||
                           Same(protocol::WithoutSignature(decoded.front()), handled.message))) {
    return "expected the message " + HexOf(handled.message) + ", found " +
           (decoded.empty() ? "none in the bytes" : HexOf(decoded.front()));
  }
  decoded.pop_front();
  ++report_.messages;
  const size_t from = out_.size();
  const engine::Handling handling = engine_->Classify(batch.link, handled.message);
  const bool changes = handling == engine::Handling::kChange;
  const bool refused = handled.refused != protocol::Reason::kNone;
  const bool answers = handling == engine::Handling::kAnswer;
  if (refused ? handled.sequence != 0 || !(changes || answers)
              : changes != (handled.sequence != 0)) {
    return "expected the message " + HexOf(handled.message) + " to " +
           (changes ? "change nothing; it changes the state" : "change the state; it does not");
  }
  if (refused && answers) {
    // A repeated change, whose first execution was not yet durable.
    engine_->Answer(batch.stamp, batch.link, handled.message, &out_);
    if (out_.size() == from || out_.back().durable_at == 0) {
      return "expected the message " + HexOf(handled.message) +
             " to repeat a change, as the log refused it; it does not";
    }
    out_.resize(from);
  }
  if (refused) {
    out_.push_back({batch.link, 0, engine::ErrorMessage(handled.message, handled.refused)});
  } else if (changes) {
    if (handled.sequence != engine_->sequence() + 1) {
      return "expected change " + std::to_string(engine_->sequence() + 1) + ", found " +
             std::to_string(handled.sequence);
    }
    engine_->Apply(handled.sequence, batch.stamp,
                   engine::RequestReceived{batch.link, handled.message}, &out_);
  } else if (answers) {
    engine_->Answer(batch.stamp, batch.link, handled.message, &out_);
  }
  Give(from);
  return "";
}

std::string Replay::On(const EventApplied& applied) {
  if (std::holds_alternative<engine::RequestReceived>(applied.event)) {
    return "a robot's request outside a batch";
  }
  if (applied.sequence != engine_->sequence() + 1) {
    return "expected change " + std::to_string(engine_->sequence() + 1) + ", found " +
           std::to_string(applied.sequence);
  }
  if (applied.stamp.field_time_ms < field_time_ms_) {
    return "field time decreases";
  }
  field_time_ms_ = applied.stamp.field_time_ms;
  const Status acceptable = engine_->Check(applied.event);
  if (!acceptable.ok()) {
    return "change " + std::to_string(applied.sequence) + " is impossible: " + acceptable.error();
  }
  ++report_.events;
  const size_t from = out_.size();
  engine_->Apply(applied.sequence, applied.stamp, applied.event, &out_);
  Give(from);
  return "";
}

void Replay::Give(size_t from) {
  for (size_t i = from; i < out_.size(); ++i) {
    const Sent sent{out_[i].link, out_[i].message};
    in_flight_.Add(sent);
    if (on_answer_) {
      on_answer_(field_time_ms_, sent);
    }
  }
  out_.clear();
}

// --- What was written.

std::string Replay::TakeWritten(const Packet& packet) {
  std::vector<protocol::Message> written;
  std::string_view rest = packet.bytes;
  protocol::FrameDecoder frames(protocol::kNoGapTimeout);
  frames.PushBlock(reinterpret_cast<const uint8_t*>(packet.bytes.data()), packet.bytes.size(), 0,
                   [&](const protocol::Message& message) {
                     written.push_back(message);
                     RemoveFrame(message, &rest);
                   });
  if (!rest.empty()) {
    return LinkName(packet.link) + ": expected whole frames, found " + Hex(packet.bytes);
  }
  protocol::Round round;
  const bool turns_are_known = written.empty() || !DecodeRound(written.back(), &round) ||
                               rounds_.Knows(packet.link, packet.connection);
  for (const protocol::Message& message : written) {
    const std::string wrong = DecodeRound(message, &round)
                                  ? TakeRound(packet, round)
                                  : TakeMessage(packet, message, turns_are_known);
    if (!wrong.empty()) {
      return LinkName(packet.link) + ", connection " + std::to_string(packet.connection) + ": " +
             wrong;
    }
  }
  report_.answer_bytes += packet.bytes.size();
  return "";
}

// An answer before the first ROUND of a connection in this file may have been given in the one
// before that.
std::string Replay::TakeMessage(const Packet& packet, const protocol::Message& message,
                                bool turns_are_known) {
  const Sent sent{packet.link, message};
  if (in_flight_.Take(sent)) {
    ++report_.answers;
    return "";
  }
  if (in_flight_.WasLast(sent) || (!turns_are_known && IsIntensities(message))) {
    ++report_.said_again;
    return "";
  }
  return "expected " + Expected(packet.link, message.id) + ", found " + HexOf(message);
}

// The engine knows no rounds: what a ROUND answers, it has given as messages.
std::string Replay::TakeRound(const Packet& packet, const protocol::Round& round) {
  const uint64_t before = rounds_.taken();
  const std::vector<WrittenRounds::Answer> missing =
      rounds_.Take(packet.link, packet.connection, round, &in_flight_);
  report_.answers += rounds_.taken() - before;
  if (missing.empty()) {
    return "";
  }
  const auto& [id, values] = missing.front();
  const std::string text =
      values.left == protocol::kNoIntensities
          ? "the reason " + std::to_string(values.right)
          : "P_L " + std::to_string(values.left) + ", P_R " + std::to_string(values.right);
  const std::string where = "ROUND " + std::to_string(round.number);
  return id == 0 ? where + " has an answer to a turn that nobody had, " + text
                 : "expected " + Expected(packet.link, id) + ", found in " + where +
                       " the answer to robot " + std::to_string(id) + ", " + text;
}

std::string Replay::Expected(engine::LinkIndex link, uint8_t id) const {
  const protocol::Message* first = in_flight_.First(link, id);
  return first != nullptr ? HexOf(*first) : "nothing for robot " + std::to_string(id);
}

std::string Replay::On(const Dropped& dropped) {
  ++report_.dropped;
  return in_flight_.Take(dropped.sent)
             ? ""
             : LinkName(dropped.sent.link) + ": expected a message that was not sent, " +
                   HexOf(dropped.sent.message) + "; the engine did not produce it";
}

std::string Replay::On(const FromBefore& before) {
  // Also applies to a second file that was begun this early.
  if (time_ns_ - start_.recording > 2 * Recorder::kStillFromBeforeNs) {
    return "a message from before the recording arrived too late";
  }
  ++report_.from_before;
  in_flight_.Add(before.sent);
  return "";
}

// Only a message that does not affect the state is sent this way: a command that robots obey
// whenever it arrives.
std::string Replay::On(const Unlogged& unlogged) {
  protocol::Command command;
  if (unlogged.sent.message.id != protocol::kBroadcastId ||
      !protocol::Decode(unlogged.sent.message, &command) ||
      command.code != protocol::CommandCode::kHalt) {
    return "expected a halt to all robots, the only message sent without the log; found " +
           HexOf(unlogged.sent.message);
  }
  in_flight_.Add(unlogged.sent);
  return "";
}

// --- The end.

std::string Replay::On(const Gap& gap) {
  time_ns_ = gap.utc_ns;
  return "not replayable from here: " + std::to_string(gap.records) +
         " records did not fit into the recorder's queue";
}

std::string Replay::On(const End& end) {
  time_ns_ = end.utc_ns;
  for (const auto& [link, decoded] : decoded_) {
    if (!decoded.empty()) {
      return LinkName(link) + ": expected a message to be handed to the engine, " +
             HexOf(decoded.front());
    }
  }
  const std::vector<Sent> left = in_flight_.All();
  const auto same = [](const Sent& a, const Sent& b) {
    return a.link == b.link && Same(a.message, b.message);
  };
  const auto [here, there] =
      std::mismatch(left.begin(), left.end(), end.under_way.begin(), end.under_way.end(), same);
  if (here != left.end() || there != end.under_way.end()) {
    const Sent& sent = here != left.end() ? *here : *there;
    return LinkName(sent.link) + ": among the messages in flight, expected " +
           (there != end.under_way.end() ? HexOf(there->message) : "no more") + ", found " +
           (here != left.end() ? HexOf(here->message) : "no more");
  }
  if (end.sequence != engine_->sequence()) {
    return "expected change " + std::to_string(end.sequence) + " to be the last, found " +
           std::to_string(engine_->sequence());
  }
  if (end.state_hash != engine_->StateHash()) {
    return "expected the state hash " + HexText(end.state_hash) + ", found " +
           HexText(engine_->StateHash());
  }
  report_.under_way = in_flight_.size();
  report_.field_time_ms = field_time_ms_;
  report_.state_hash = end.state_hash;
  ended_ = true;
  return "";
}

}  // namespace pheromone::capture
