// All messages and the fields of each, for both sides: the image sends the fields' values in this
// order, and the host uses the same list for their names in fields.txt.
//
// `wide`, `answer` and `length` are not fields of the files: they select the message's name and a
// PING's size. A COMMAND's arguments and a PING's payload are bytes, listed one by one and always
// all of them; so are a ROUND's answers and turns, a SCAN's rows and texts, whose counts are fields
// here. A number of 32 bits is signed here, whatever it means. C++14 without its library.
#pragma once

#include <stdint.h>

#include "protocol/messages.h"
#include "protocol/tag_messages.h"

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

template <typename Sink>
void ListFields(const protocol::ScanRequest& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("x", m.x);
  sink->Add("y", m.y);
  sink->Add("after", m.after);
}

template <typename Sink>
void ListFields(const protocol::ScanAnswer& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("more", m.more);
  sink->Add("row_count", m.count);
  for (uint8_t i = 0; i < protocol::kMaxTagsInRange; ++i) {
    sink->Add("tag", m.rows[i].tag);
    sink->Add("dx", m.rows[i].dx);
    sink->Add("dy", m.rows[i].dy);
    sink->Add("generation", m.rows[i].generation);
  }
}

template <typename Sink>
void ListFields(const protocol::TagReadRequest& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("x", m.x);
  sink->Add("y", m.y);
  sink->Add("tag", m.tag);
  sink->Add("slot", m.slot);
}

/// Subject, predicate and object.
template <typename Sink>
void ListStatement(const int32_t* words, Sink* sink) {
  sink->Add("subject_namespace", words[0]);
  sink->Add("subject", words[1]);
  sink->Add("predicate_namespace", words[2]);
  sink->Add("predicate", words[3]);
  sink->Add("object_namespace", words[4]);
  sink->Add("object", words[5]);
}

template <typename Sink>
void ListFields(const protocol::TagReadAnswer& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("tag", m.tag);
  sink->Add("slot", m.slot);
  sink->Add("next", m.next);
  sink->Add("slots", m.slots);
  sink->Add("tag_generation", m.tag_generation);
  sink->Add("slot_generation", m.slot_generation);
  sink->Add("lease_s", m.lease_s);
  sink->Add("flags", m.flags);
  sink->Add("author", m.words[protocol::kWordAuthor]);
  sink->Add("time", m.words[protocol::kWordTime]);
  ListStatement(m.words + protocol::kWordSubjectNamespace, sink);
}

template <typename Sink>
void ListFields(const protocol::TagWriteRequest& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("seq", m.seq);
  sink->Add("x", m.x);
  sink->Add("y", m.y);
  sink->Add("tag", m.tag);
  sink->Add("slot", m.slot);
  sink->Add("flags", m.flags);
  sink->Add("expected", m.expected);
  sink->Add("lease_s", m.lease_s);
  sink->Add("time", static_cast<int32_t>(m.time));
  ListStatement(m.words, sink);
}

template <typename Sink>
void ListFields(const protocol::TagEraseRequest& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("seq", m.seq);
  sink->Add("x", m.x);
  sink->Add("y", m.y);
  sink->Add("tag", m.tag);
  sink->Add("slot", m.slot);
  sink->Add("flags", m.flags);
  sink->Add("expected", m.expected);
}

template <typename Sink>
void ListFields(const protocol::TagWritten& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("erased", m.erased);
  sink->Add("seq", m.seq);
  sink->Add("tag", m.tag);
  sink->Add("slot", m.slot);
  sink->Add("slot_generation", m.slot_generation);
  sink->Add("tag_generation", m.tag_generation);
}

template <typename Sink>
void ListFields(const protocol::SymbolRequest& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("seq", m.seq);
  sink->Add("kind", static_cast<uint8_t>(m.kind));
  sink->Add("number", m.number);
  sink->Add("text_count", m.length);
  ListBytes("text", m.text, protocol::kMaxSymbolText, sink);
}

template <typename Sink>
void ListFields(const protocol::SymbolAnswer& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("seq", m.seq);
  sink->Add("kind", static_cast<uint8_t>(m.kind));
  sink->Add("number", m.number);
}

template <typename Sink>
void ListFields(const protocol::ResolveRequest& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("kind", static_cast<uint8_t>(m.kind));
  sink->Add("robot", m.robot);
  sink->Add("number", m.number);
  sink->Add("offset", m.offset);
}

template <typename Sink>
void ListFields(const protocol::ResolveAnswer& m, Sink* sink) {
  sink->Add("id", m.id);
  sink->Add("kind", static_cast<uint8_t>(m.kind));
  sink->Add("robot", m.robot);
  sink->Add("number", m.number);
  sink->Add("rows", static_cast<int32_t>(m.rows));
  sink->Add("text_length", m.length);
  sink->Add("text_count", m.count);
  ListBytes("text", m.text, protocol::kMaxResolvedText, sink);
}

/// Calls `visitor->Visit(name, empty message)` for each message. The narrow name stands for both
/// widths, PING for its answer too, and WRITE_ANSWER for that of ERASE.
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
  visitor->Visit("SCAN", protocol::ScanRequest());
  visitor->Visit("SCAN_ANSWER", protocol::ScanAnswer());
  visitor->Visit("READ", protocol::TagReadRequest());
  visitor->Visit("READ_ANSWER", protocol::TagReadAnswer());
  visitor->Visit("WRITE", protocol::TagWriteRequest());
  visitor->Visit("ERASE", protocol::TagEraseRequest());
  visitor->Visit("WRITE_ANSWER", protocol::TagWritten());
  visitor->Visit("SYMBOL", protocol::SymbolRequest());
  visitor->Visit("SYMBOL_ANSWER", protocol::SymbolAnswer());
  visitor->Visit("RESOLVE", protocol::ResolveRequest());
  visitor->Visit("RESOLVE_ANSWER", protocol::ResolveAnswer());
}

}  // namespace conformance
}  // namespace pheromone
