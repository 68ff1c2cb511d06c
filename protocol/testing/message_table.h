// The table of messages (protocol/README.md, "Messages") written out a second time, and which
// messages the code under test takes something for. Host only.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocol/messages.h"
#include "protocol/tag_messages.h"
#include "protocol/testing/vectors.h"

namespace pheromone::testing {

/// A row of the table; an empty name where no such opcode exists.
struct TableRow {
  std::string name;  ///< as in fields.txt
  int least = 0;
  int most = 0;
};

/// By opcode.
inline std::array<TableRow, 256> MessageTable() {
  std::array<TableRow, 256> table;
  for (unsigned type = 1; type <= 15; ++type) {
    table[0x00 + type] = {"SENSE", 6, 6};
    table[0x80 + type] = {"SENSE_ANSWER", 4, 4};
    table[0x10 + type] = {"SENSE_WIDE", 10, 10};
    table[0x90 + type] = {"SENSE_WIDE_ANSWER", 4, 4};
    table[0x20 + type] = {"DEPOSIT", 6, 6};
    table[0xA0 + type] = {"DEPOSIT_ANSWER", 1, 1};
    table[0x30 + type] = {"TRACE", 7, 7};
    table[0xB0 + type] = {"TRACE_ANSWER", 5, 5};
    table[0x60 + type] = {"TRACE_WIDE", 11, 11};
    table[0xE0 + type] = {"TRACE_WIDE_ANSWER", 5, 5};
  }
  table[0x41] = {"SCAN", 10, 10};
  table[0xC1] = {"SCAN_ANSWER", 1, 57};
  table[0x42] = {"READ", 11, 11};
  table[0xC2] = {"READ_ANSWER", 44, 44};
  table[0x43] = {"WRITE", 45, 45};
  table[0xC3] = {"WRITE_ANSWER", 8, 8};
  table[0x44] = {"ERASE", 15, 15};
  table[0xC4] = {"ERASE_ANSWER", 8, 8};
  table[0x45] = {"SYMBOL", 6, 62};
  table[0xC5] = {"SYMBOL_ANSWER", 6, 6};
  table[0x46] = {"RESOLVE", 10, 10};
  table[0xC6] = {"RESOLVE_ANSWER", 14, 64};
  table[0x51] = {"COMMAND_ACK", 4, 4};
  table[0xD1] = {"COMMAND", 2, 7};
  table[0x52] = {"EVENT", 4, 4};
  table[0xD2] = {"EVENT_ACK", 1, 1};
  table[0x71] = {"HELLO", 4, 4};
  table[0xF1] = {"HELLO_ANSWER", 15, 15};
  table[0x72] = {"PING", 0, 16};
  table[0xF2] = {"PING_ANSWER", 0, 16};
  table[0xF3] = {"ROUND", 6, 61};
  table[0xFE] = {"ERROR", 3, 3};
  return table;
}

/// Bytes of arguments by a COMMAND's code, or -1 for an unknown code.
inline int CommandArguments(unsigned code) {
  constexpr std::array<int, 10> kLengths = {-1, 0, 0, 2, 4, 1, 0, 0, 5, 1};
  return code < kLengths.size() ? kLengths[code] : -1;
}

/// A ROUND's DATA, read from its front.
struct NaiveRound {
  std::vector<int> header;  ///< number, turn_ms, turn_bytes, slot_ms, open_slots
  std::vector<std::pair<int, int>> answers;
  std::vector<int> turns;
};

/// ID, OPCODE and DATA as a ROUND, or nothing if they are none.
inline std::optional<NaiveRound> ReadNaiveRound(const std::vector<uint8_t>& body) {
  std::deque<int> rest(body.begin(), body.end());
  const auto take = [&rest] {
    const int first = rest.front();
    rest.pop_front();
    return first;
  };
  const auto take_signed = [&take] {
    const int low = take();
    const int value = low + 256 * take();
    return value < 32768 ? value : value - 65536;
  };
  if (rest.size() < 8 || take() != 255 || take() != 0xF3) {
    return std::nullopt;
  }
  NaiveRound round;
  round.header = {take(), take(), take(), take(), take()};
  const int counts = take();
  for (int left = counts % 16; left > 0; --left) {
    if (rest.size() < 4) {
      return std::nullopt;
    }
    const int at_left = take_signed();
    round.answers.emplace_back(at_left, take_signed());
  }
  round.turns.assign(rest.begin(), rest.end());
  for (const int id : round.turns) {
    if (id < 1 || id > 254) {
      return std::nullopt;
    }
  }
  const size_t turns = round.turns.size();
  if (turns != static_cast<size_t>(counts / 16) || turns > 11 || round.answers.size() > 11) {
    return std::nullopt;
  }
  return round;
}

/// The only name under which a message may be accepted, by the table.
inline std::vector<std::string> ExpectedNames(const protocol::Message& message) {
  static const auto table = MessageTable();
  const TableRow& row = table[message.opcode];
  if (row.name.empty() || message.length < row.least || message.length > row.most) {
    return {};
  }
  if (row.name == "COMMAND" && message.length != 2 + CommandArguments(message.data[1])) {
    return {};
  }
  if (row.name == "SCAN_ANSWER" && message.length % 8 != 1) {
    return {};
  }
  if (row.name == "ROUND" && !ReadNaiveRound(ToBody(message))) {
    return {};
  }
  return {row.name};
}

/// The names of the messages as which Decode accepts `message`: one, if all is well, or none.
inline std::vector<std::string> AcceptedAs(const protocol::Message& message) {
  std::vector<std::string> names;
  const auto try_plain = [&](auto decoded, const char* name) {
    if (Decode(message, &decoded)) {
      names.emplace_back(name);
    }
  };
  const auto try_wide = [&](auto decoded, const char* narrow, const char* wide) {
    if (Decode(message, &decoded)) {
      names.emplace_back(decoded.wide ? wide : narrow);
    }
  };
  try_wide(protocol::SenseRequest{}, "SENSE", "SENSE_WIDE");
  try_wide(protocol::SenseAnswer{}, "SENSE_ANSWER", "SENSE_WIDE_ANSWER");
  try_plain(protocol::DepositRequest{}, "DEPOSIT");
  try_plain(protocol::DepositAnswer{}, "DEPOSIT_ANSWER");
  try_wide(protocol::TraceRequest{}, "TRACE", "TRACE_WIDE");
  try_wide(protocol::TraceAnswer{}, "TRACE_ANSWER", "TRACE_WIDE_ANSWER");
  try_plain(protocol::ScanRequest{}, "SCAN");
  try_plain(protocol::ScanAnswer{}, "SCAN_ANSWER");
  try_plain(protocol::TagReadRequest{}, "READ");
  try_plain(protocol::TagReadAnswer{}, "READ_ANSWER");
  try_plain(protocol::TagWriteRequest{}, "WRITE");
  try_plain(protocol::TagEraseRequest{}, "ERASE");
  try_plain(protocol::SymbolRequest{}, "SYMBOL");
  try_plain(protocol::SymbolAnswer{}, "SYMBOL_ANSWER");
  try_plain(protocol::ResolveRequest{}, "RESOLVE");
  try_plain(protocol::ResolveAnswer{}, "RESOLVE_ANSWER");
  try_plain(protocol::Command{}, "COMMAND");
  try_plain(protocol::CommandAck{}, "COMMAND_ACK");
  try_plain(protocol::EventReport{}, "EVENT");
  try_plain(protocol::EventAck{}, "EVENT_ACK");
  try_plain(protocol::HelloRequest{}, "HELLO");
  try_plain(protocol::HelloAnswer{}, "HELLO_ANSWER");
  try_plain(protocol::ErrorAnswer{}, "ERROR");
  try_plain(protocol::Round{}, "ROUND");
  protocol::TagWritten written;
  if (Decode(message, &written)) {
    names.emplace_back(written.erased ? "ERASE_ANSWER" : "WRITE_ANSWER");
  }
  protocol::Ping ping;
  if (Decode(message, &ping)) {
    names.emplace_back(ping.answer ? "PING_ANSWER" : "PING");
  }
  return names;
}

}  // namespace pheromone::testing
