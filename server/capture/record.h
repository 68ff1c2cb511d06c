// What a capture file holds, record by record, as plain values. README.md of this folder has the
// bytes; format.h turns one into the other.
//
//   Record record = Packet{.utc_ns = now, .link = 0, .connection = 1, .bytes = "..."};
//   if (const auto* packet = std::get_if<Packet>(&record)) ...
//
// A file is Start, its portions of State, then the rest in the order in which it happened, then
// End.
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "protocol/frame.h"
#include "protocol/opcodes.h"
#include "server/engine/event.h"

namespace pheromone::capture {

/// A message that the engine wants to have sent.
struct Sent {
  engine::LinkIndex link = 0;
  protocol::Message message;
};

/// How a link's bytes become frames.
struct LinkInfo {
  std::string name;
  uint16_t gap_timeout_ms = 0;  ///< protocol::kNoGapTimeout: none
  bool datagrams = false;       ///< frames do not go on from one packet to the next
};

/// What the rest is to be understood from.
struct Start {
  uint64_t utc_ns = 0;          ///< when this file begins
  uint64_t recording = 0;       ///< the same in all files of one recording
  uint32_t part = 1;            ///< the file's place among them
  std::string version;          ///< of the program
  std::string config;           ///< the configuration file, for people: State has what counts
  std::vector<LinkInfo> links;  ///< in the order of their LinkIndex
  std::vector<Sent> under_way;  ///< what the engine gave before and is yet to be written
  uint64_t state_bytes = 0;     ///< of all portions of State together
  uint8_t format_version = 1;   ///< as read; what is written is always of kFormatVersion
};

/// A portion of Engine::Save at the beginning of the file.
struct State {
  std::string bytes;
};

enum class Direction : uint8_t { kFromRobots = 1, kToRobots = 2 };

/// What was read or written at once on a link, as it was on the wire.
struct Packet {
  uint64_t utc_ns = 0;
  engine::LinkIndex link = 0;
  uint32_t connection = 0;
  Direction direction = Direction::kFromRobots;
  std::string bytes;
  uint32_t read_ms = 0;  ///< the decoder's time of it; 0 if to the robots
};

/// A connection's first packet in this file finds its decoder in the middle of something. Fed to a
/// new decoder, `bytes` bring it to the same place.
struct Carry {
  engine::LinkIndex link = 0;
  uint32_t connection = 0;
  uint32_t read_ms = 0;  ///< the decoder's time of its last byte
  std::string bytes;
};

/// What became of a message that was handed to the engine.
struct Handled {
  protocol::Message message;
  uint64_t sequence = 0;                               ///< in the log; 0: it changed nothing
  protocol::Reason refused = protocol::Reason::kNone;  ///< by the log
};

/// The messages of one read, which met the engine together.
struct Batch {
  uint64_t number = 0;  ///< counts from 1 in each file
  engine::LinkIndex link = 0;
  engine::Stamp stamp;
  std::vector<Handled> messages;
};

/// A change that did not come from a robot.
struct EventApplied {
  uint64_t sequence = 0;
  engine::Stamp stamp;
  engine::Event event;
};

/// A message that was decoded, but that the link did not hand to the engine.
struct TurnedAway {
  engine::LinkIndex link = 0;
  protocol::Message message;
  protocol::Reason answer = protocol::Reason::kNone;  ///< of the ERROR given for it; kNone: silence
};

/// A message that the engine gave but that never went out: too late, or nobody is there, or its
/// robot asked again before it could be sent.
struct NotSent {
  Sent sent;
};

/// A message that was written early in a recording but given by the engine before it began.
struct FromBefore {
  Sent sent;
};

/// Here records are missing: what follows cannot be replayed.
struct Gap {
  uint64_t utc_ns = 0;
  uint64_t records = 0;
};

/// How things stand at the end of the file.
struct End {
  uint64_t utc_ns = 0;
  uint64_t sequence = 0;
  uint64_t state_hash = 0;
  std::vector<Sent> under_way;
};

/// A halt to all robots that is sent although the log took no event for it.
struct Unlogged {
  Sent sent;
};

using Record = std::variant<Start, State, Packet, Carry, Batch, EventApplied, TurnedAway, NotSent,
                            FromBefore, Gap, End, Unlogged>;

}  // namespace pheromone::capture
