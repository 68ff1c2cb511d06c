// What a link counts. A counter is a member here, or of what the structs are made of, and one row
// of kLinkCounters, from which follow what operators see (REST, metrics, pheromonectl, dashboard)
// and what is logged at the end.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string_view>

#include "protocol/decoder.h"
#include "server/robots/links/line_errors.h"
#include "server/robots/radio/channel.h"
#include "server/robots/signing/signing.h"

namespace pheromone::links {

/// Of ChannelCounters, `late_answers` and `dropped_answers` are counted on every kind of link.
struct LinkCounters : radio::ChannelCounters {
  protocol::DecoderCounters received = {};  ///< decoding results of the received bytes
  LineErrors line;                          ///< of serial ports whose driver counts errors
  signing::SigningCounters signing;         ///< of signed links
  uint64_t bytes_in = 0;
  uint64_t bytes_out = 0;
  uint64_t frames_out = 0;
  uint64_t opened = 0;
  uint64_t undeliverable = 0;
  uint64_t dropped_connections = 0;
  uint64_t not_allowed = 0;
  uint64_t too_many = 0;
  uint64_t datagrams_in = 0;
  uint64_t oversize_datagrams = 0;  ///< of datagrams_in
  uint64_t dropped_datagrams = 0;
  /// When the last bytes were received; empty if none since the start.
  std::optional<std::chrono::steady_clock::time_point> heard{};
};

enum class CounterKind {
  kTraffic,
  kSign,  ///< of trouble, perhaps: a modem makes stray bytes, and a parked robot misses its turns
  kLoss,  ///< a frame, a message or a connection was damaged, lost or refused
};

struct LinkCounter {
  std::string_view name;  ///< snake_case
  std::string_view help;
  CounterKind kind;
  uint64_t (*count)(const LinkCounters&);
};

inline constexpr LinkCounter kLinkCounters[] = {
    {"received_frames", "Complete frames received.", CounterKind::kTraffic,
     [](const LinkCounters& it) { return uint64_t{it.received.frames}; }},
    {"received_bytes", "Bytes received.", CounterKind::kTraffic,
     [](const LinkCounters& it) { return it.bytes_in; }},
    {"sent_frames", "Frames sent.", CounterKind::kTraffic,
     [](const LinkCounters& it) { return it.frames_out; }},
    {"sent_bytes", "Bytes sent.", CounterKind::kTraffic,
     [](const LinkCounters& it) { return it.bytes_out; }},
    {"crc_errors", "Frames with a wrong CRC.", CounterKind::kLoss,
     [](const LinkCounters& it) { return uint64_t{it.received.crc_errors}; }},
    {"bad_escapes", "Frames with an invalid byte after a DLE.", CounterKind::kLoss,
     [](const LinkCounters& it) { return uint64_t{it.received.bad_escapes}; }},
    {"oversize_frames", "Frames longer than any message.", CounterKind::kLoss,
     [](const LinkCounters& it) { return uint64_t{it.received.oversize}; }},
    {"runt_frames", "Frames shorter than any message.", CounterKind::kLoss,
     [](const LinkCounters& it) { return uint64_t{it.received.runts}; }},
    {"refused_frames", "Frames with ID or opcode 0.", CounterKind::kLoss,
     [](const LinkCounters& it) { return uint64_t{it.received.refused}; }},
    {"restarted_frames", "Frames interrupted by the start of another frame.", CounterKind::kLoss,
     [](const LinkCounters& it) { return uint64_t{it.received.restarts}; }},
    {"gap_timeouts", "Frames abandoned at a gap timeout.", CounterKind::kLoss,
     [](const LinkCounters& it) { return uint64_t{it.received.timeouts}; }},
    {"stray_bytes", "Bytes outside of frames.", CounterKind::kSign,
     [](const LinkCounters& it) { return uint64_t{it.received.ignored_bytes}; }},
    {"openings", "Ports opened, connections accepted.", CounterKind::kTraffic,
     [](const LinkCounters& it) { return it.opened; }},
    {"late_answers", "Answers not sent because they were too late.", CounterKind::kLoss,
     [](const LinkCounters& it) { return it.late_answers; }},
    {"dropped_answers", "Answers not sent because the send queue was full.", CounterKind::kLoss,
     [](const LinkCounters& it) { return it.dropped_answers; }},
    {"withheld_errors", "ERRORs not sent because a window permits only one.", CounterKind::kLoss,
     [](const LinkCounters& it) { return it.withheld_errors; }},
    {"rounds", "ROUNDs sent.", CounterKind::kTraffic,
     [](const LinkCounters& it) { return it.rounds.rounds; }},
    {"coded_rounds", "ROUNDs coded against damaged bytes.", CounterKind::kTraffic,
     [](const LinkCounters& it) { return it.rounds.coded; }},
    {"turns", "Turns given to robots in ROUNDs.", CounterKind::kTraffic,
     [](const LinkCounters& it) { return it.rounds.turns; }},
    {"missed_turns", "Turns in which no robot was heard.", CounterKind::kSign,
     [](const LinkCounters& it) { return it.rounds.missed; }},
    {"unanswered_turns", "Turns whose answer came too late for the ROUND.", CounterKind::kLoss,
     [](const LinkCounters& it) { return it.rounds.unanswered; }},
    {"ignored_carriers", "Transmissions in spite of a carrier that did not end.",
     CounterKind::kLoss, [](const LinkCounters& it) { return it.ignored_carriers; }},
    {"undeliverable", "Messages not sent: no connection, no leave to send, or a failed write.",
     CounterKind::kLoss, [](const LinkCounters& it) { return it.undeliverable; }},
    {"dropped_connections", "Connections closed to make room for another.", CounterKind::kLoss,
     [](const LinkCounters& it) { return it.dropped_connections; }},
    {"not_allowed", "Messages of clients that the link does not serve.", CounterKind::kLoss,
     [](const LinkCounters& it) { return it.not_allowed; }},
    {"too_many", "Messages beyond the limits of the request rate.", CounterKind::kLoss,
     [](const LinkCounters& it) { return it.too_many; }},
    {"unsigned_frames", "Frames without a signature, or of no present session, on a signed link.",
     CounterKind::kLoss, [](const LinkCounters& it) { return it.signing.unsigned_frames; }},
    {"wrong_signatures", "Frames with a wrong signature: forged, or repeated.", CounterKind::kLoss,
     [](const LinkCounters& it) { return it.signing.wrong_tags; }},
    {"unknown_robots", "Frames of robots without a key, on a signed link.", CounterKind::kLoss,
     [](const LinkCounters& it) { return it.signing.unknown_robots; }},
    {"received_datagrams", "UDP datagrams received.", CounterKind::kTraffic,
     [](const LinkCounters& it) { return it.datagrams_in; }},
    {"oversize_datagrams", "UDP datagrams above the maximum length.", CounterKind::kLoss,
     [](const LinkCounters& it) { return it.oversize_datagrams; }},
    {"dropped_datagrams", "UDP datagrams dropped by the kernel.", CounterKind::kLoss,
     [](const LinkCounters& it) { return it.dropped_datagrams; }},
    {"framing_errors", "Framing errors counted by the port's driver.", CounterKind::kLoss,
     [](const LinkCounters& it) { return it.line.framing; }},
    {"overruns", "Bytes lost in the port or its driver.", CounterKind::kLoss,
     [](const LinkCounters& it) { return it.line.overruns + it.line.buffer_overruns; }},
    {"parity_errors", "Parity errors counted by the port's driver.", CounterKind::kLoss,
     [](const LinkCounters& it) { return it.line.parity; }},
    {"breaks", "Break conditions counted by the port's driver.", CounterKind::kLoss,
     [](const LinkCounters& it) { return it.line.breaks; }},
};

}  // namespace pheromone::links
