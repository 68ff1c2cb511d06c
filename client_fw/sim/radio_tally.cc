#include "client_fw/sim/radio_tally.h"

#include "protocol/messages.h"
#include "protocol/signing.h"

namespace pheromone::sim {
namespace {

uint32_t Milliseconds(int64_t time_ns) {
  return static_cast<uint32_t>(time_ns / 1'000'000);
}

}  // namespace

protocol::Message RadioTally::Bare(const protocol::Message& message) const {
  return is_signed_ ? protocol::WithoutSignature(message) : message;
}

void RadioTally::OnSent(uint8_t byte, int64_t time_ns) {
  if (!sent_.Push(byte, Milliseconds(time_ns)) || sent_.message().id != id_) {
    return;
  }
  protocol::SenseRequest sense;
  protocol::TraceRequest trace;
  protocol::CommandAck ack;
  const protocol::Message message = Bare(sent_.message());
  if (Decode(message, &sense) || Decode(message, &trace)) {
    ++counters_.requests;
    asked_in_turn_ = turn_ >= 0;
  } else if (message.opcode == protocol::kHello) {  // the first one has a length of its own
    ++counters_.hellos;
  } else if (Decode(message, &ack)) {
    ++counters_.acks;
  }
}

void RadioTally::OnHeard(uint8_t byte, int64_t time_ns) {
  if (!heard_.Push(byte, Milliseconds(time_ns))) {
    return;
  }
  const protocol::Message message = Bare(heard_.message());
  protocol::Round round;
  if (Decode(message, &round)) {
    OnRound(round);
    return;
  }
  if (message.id != id_) {
    ++counters_.heard;
    return;
  }
  protocol::SenseAnswer sense;
  protocol::TraceAnswer trace;
  protocol::HelloAnswer hello;
  protocol::EventAck event;
  protocol::ErrorAnswer error;
  if (Decode(message, &sense)) {
    OnAnswer(sense.left, sense.right);
  } else if (Decode(message, &trace)) {
    OnAnswer(trace.left, trace.right);
  } else if (Decode(message, &hello)) {
    ++counters_.hello_answers;
  } else if (Decode(message, &event)) {
    ++counters_.events;
  } else if (Decode(message, &error)) {
    ++counters_.errors;
  }
}

void RadioTally::OnRound(const protocol::Round& round) {
  ++counters_.rounds;
  if (asked_in_turn_ && turn_ < round.answer_count) {
    const protocol::RoundAnswer& answer = round.answers[turn_];
    if (answer.left != protocol::kNoIntensities) {
      OnAnswer(answer.left, answer.right);
    }
  }
  asked_in_turn_ = false;
  turn_ = -1;
  for (int i = 0; i < round.turn_count; ++i) {
    turn_ = round.turns[i] == id_ ? i : turn_;
  }
}

void RadioTally::OnAnswer(int16_t left, int16_t right) {
  ++counters_.answers;
  p_left_ = left;
  p_right_ = right;
}

}  // namespace pheromone::sim
