// All messages and the fields of each, for both sides: the image sends the fields' values in this
// order, and the host uses the same list for their names in fields.txt.
//
// `wide`, `answer` and `length` are not fields of the files: they select the message's name and a
// PING's size. A COMMAND's arguments and a PING's payload are bytes, listed one by one and always
// all of them; so are a ROUND's answers and turns, whose counts are fields here. C++14 without its
// library.
#pragma once

#include <stdint.h>

#include "protocol/messages.h"

namespace pheromone {
namespace conformance {

/// Each calls `sink->Add(name, int32_t value)` for every field.
template <typename Sink>
void ListBytes(const char* name, const uint8_t* bytes, uint8_t size, Sink* sink) {
  for (uint8_t i = 0; i < size; ++i) {
    sink->Add(name, bytes[i]);
  }
}

template <typename Sink>
void ListFields(const protocol::WirePose& m, Sink* sink) {
  sink->Add("x", m.x);
  sink->Add("y", m.y);
  sink->Add("heading", m.heading);
}

template <typename Sink>
void ListFields(const protocol::SenseRequest& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("type", m.type);
  sink->Add("wide", m.wide);
  ListFields(m.pose, sink);
}

template <typename Sink>
void ListFields(const protocol::SenseAnswer& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("type", m.type);
  sink->Add("wide", m.wide);
  sink->Add("left", m.left);
  sink->Add("right", m.right);
}

template <typename Sink>
void ListFields(const protocol::DepositRequest& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("type", m.type);
  sink->Add("seq", m.seq);
  sink->Add("x", m.x);
  sink->Add("y", m.y);
  sink->Add("quanta", m.quanta);
}

template <typename Sink>
void ListFields(const protocol::DepositAnswer& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("type", m.type);
  sink->Add("seq", m.seq);
}

template <typename Sink>
void ListFields(const protocol::TraceRequest& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("type", m.type);
  sink->Add("wide", m.wide);
  sink->Add("seq", m.seq);
  ListFields(m.pose, sink);
}

template <typename Sink>
void ListFields(const protocol::TraceAnswer& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("type", m.type);
  sink->Add("wide", m.wide);
  sink->Add("seq", m.seq);
  sink->Add("left", m.left);
  sink->Add("right", m.right);
}

template <typename Sink>
void ListFields(const protocol::Command& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("seq", m.seq);
  sink->Add("code", static_cast<uint8_t>(m.code));
  ListBytes("arguments", m.arguments, protocol::kMaxCommandArguments, sink);
}

template <typename Sink>
void ListFields(const protocol::CommandAck& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("seq", m.seq);
  sink->Add("code", static_cast<uint8_t>(m.code));
  sink->Add("result", m.result);
}

template <typename Sink>
void ListFields(const protocol::EventReport& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("seq", m.seq);
  sink->Add("code", static_cast<uint8_t>(m.code));
  sink->Add("argument", m.argument);
}

template <typename Sink>
void ListFields(const protocol::EventAck& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("seq", m.seq);
}

template <typename Sink>
void ListFields(const protocol::HelloRequest& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("nonce", m.nonce);
  sink->Add("firmware_version", m.firmware_version);
  sink->Add("round_period", m.round_period);
}

template <typename Sink>
void ListFields(const protocol::HelloAnswer& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("nonce", m.nonce);
  sink->Add("protocol_version", m.protocol_version);
  sink->Add("epoch", m.epoch);
  sink->Add("pose_unit_10um", m.pose_unit_10um);
  sink->Add("antenna_distance_mm", m.antenna_distance_mm);
  sink->Add("type_mask", m.type_mask);
  sink->Add("slot_ms", m.slot_ms);
  sink->Add("response_window_ms", m.response_window_ms);
  sink->Add("last_opcode", m.last_opcode);
  sink->Add("last_seq", m.last_seq);
}

template <typename Sink>
void ListFields(const protocol::Ping& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("answer", m.answer);
  sink->Add("length", m.length);
  ListBytes("payload", m.payload, protocol::kMaxPing, sink);
}

template <typename Sink>
void ListFields(const protocol::ErrorAnswer& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("refused_opcode", m.refused_opcode);
  sink->Add("reason", static_cast<uint8_t>(m.reason));
  sink->Add("seq", m.seq);
}

template <typename Sink>
void ListFields(const protocol::Round& m, Sink* sink) {
  sink->Add("number", m.number);
  sink->Add("turn_ms", m.turn_ms);
  sink->Add("turn_bytes", m.turn_bytes);
  sink->Add("slot_ms", m.slot_ms);
  sink->Add("open_slots", m.open_slots);
  sink->Add("answer_count", m.answer_count);
  for (uint8_t i = 0; i < protocol::kMaxTurns; ++i) {
    sink->Add("left", m.answers[i].left);
    sink->Add("right", m.answers[i].right);
  }
  sink->Add("turn_count", m.turn_count);
  ListBytes("turns", m.turns, protocol::kMaxTurns, sink);
}

/// Calls `visitor->Visit(name, empty message)` for each message. The narrow name stands for both
/// widths, and PING for its answer too.
template <typename Visitor>
void ForEachKind(Visitor* visitor) {
  visitor->Visit("SENSE", protocol::SenseRequest());
  visitor->Visit("SENSE_ANSWER", protocol::SenseAnswer());
  visitor->Visit("DEPOSIT", protocol::DepositRequest());
  visitor->Visit("DEPOSIT_ANSWER", protocol::DepositAnswer());
  visitor->Visit("TRACE", protocol::TraceRequest());
  visitor->Visit("TRACE_ANSWER", protocol::TraceAnswer());
  visitor->Visit("COMMAND", protocol::Command());
  visitor->Visit("COMMAND_ACK", protocol::CommandAck());
  visitor->Visit("EVENT", protocol::EventReport());
  visitor->Visit("EVENT_ACK", protocol::EventAck());
  visitor->Visit("HELLO", protocol::HelloRequest());
  visitor->Visit("HELLO_ANSWER", protocol::HelloAnswer());
  visitor->Visit("PING", protocol::Ping());
  visitor->Visit("ROUND", protocol::Round());
  visitor->Visit("ERROR", protocol::ErrorAnswer());
}

}  // namespace conformance
}  // namespace pheromone
