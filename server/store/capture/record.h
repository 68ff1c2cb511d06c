// The records of a capture file as plain values. README.md of this folder specifies the bytes;
// format.h converts between the two.
//
//   Record record = Packet{.utc_ns = now, .link = 0, .connection = 1, .bytes = "..."};
//   if (const auto* packet = std::get_if<Packet>(&record)) ...
//
// A file consists of Start, its portions of State, the other records in chronological order, and
// End.
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "protocol/frame.h"
#include "protocol/opcodes.h"
#include "server/core/engine/event.h"

namespace pheromone::capture {

/// A message given by the engine, to be sent.
struct Sent {
  engine::LinkIndex link = 0;
  protocol::Message message;
};

/// How the bytes of a link are decoded into frames.
struct LinkInfo {
  std::string name;
  uint16_t gap_timeout_ms = 0;  ///< protocol::kNoGapTimeout: none
  bool datagrams = false;       ///< frames do not span packets
};

/// The context of all other records.
struct Start {
  uint64_t utc_ns = 0;          ///< when this file begins
  uint64_t recording = 0;       ///< the same in all files of one recording
  uint32_t part = 1;            ///< the number of the file in the recording
  std::string version;          ///< of the program
  std::string config;           ///< the configuration file, for information; replay uses State
  std::vector<LinkInfo> links;  ///< in the order of their LinkIndex
  std::vector<Sent> under_way;  ///< the messages in flight
  uint64_t state_bytes = 0;     ///< the total size of all portions of State
};

/// A portion of Engine::Save at the beginning of the file.
struct State {
  std::string bytes;
};

enum class Direction : uint8_t { kFromRobots = 1, kToRobots = 2 };

/// The raw bytes of one read or write on a link.
struct Packet {
  uint64_t utc_ns = 0;
  engine::LinkIndex link = 0;
  uint32_t connection = 0;
  Direction direction = Direction::kFromRobots;
  std::string bytes;
  uint32_t read_ms = 0;  ///< the decoder's time of the read; 0 if sent to robots
};

/// The partial frame in the decoder of a connection before its first packet in this file. `bytes`
/// bring a new decoder to the same state.
struct PartialFrame {
  engine::LinkIndex link = 0;
  uint32_t connection = 0;
  uint32_t read_ms = 0;  ///< the decoder's time of its last byte
  std::string bytes;
};

/// The outcome of a message passed to the engine.
struct Handled {
  protocol::Message message;
  uint64_t sequence = 0;                               ///< in the log; 0: no change
  protocol::Reason refused = protocol::Reason::kNone;  ///< by the log
};

/// The messages of one read, which were passed to the engine as one batch.
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

/// A decoded message that the link rejected and did not pass to the engine.
struct Rejected {
  engine::LinkIndex link = 0;
  protocol::Message message;
  protocol::Reason answer = protocol::Reason::kNone;  ///< of the ERROR sent; kNone: none
};

/// A message given by the engine that was dropped: it was too late, there was no connection, or its
/// robot sent another request before it could be sent.
struct Dropped {
  Sent sent;
};

/// A message written early in a recording that the engine had given before the recording began.
struct FromBefore {
  Sent sent;
};

/// Records were dropped here: the rest of the file cannot be replayed.
struct Gap {
  uint64_t utc_ns = 0;
  uint64_t records = 0;
};

/// The final state at the end of the file.
struct End {
  uint64_t utc_ns = 0;
  uint64_t sequence = 0;
  uint64_t state_hash = 0;
  std::vector<Sent> under_way;
};

/// A halt of all robots that is sent although the log did not accept an event for it.
struct Unlogged {
  Sent sent;
};

using Record = std::variant<Start, State, Packet, PartialFrame, Batch, EventApplied, Rejected,
                            Dropped, FromBefore, Gap, End, Unlogged>;

}  // namespace pheromone::capture
