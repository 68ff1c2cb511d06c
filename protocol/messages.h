// The messages, as structs, and their one translation to and from Message; those of TAG are in
// tag_messages.h.
//
//   SenseRequest request;
//   if (Decode(message, &request)) ...        // opcode and length are right
//   Encode(SenseAnswer{id, type, wide, left, right}, &message);
//
// Decode checks the opcode and the exact length, and of a ROUND that it is to all and that its
// turns are those of robots; nothing else: whether a value makes sense is for the one who acts on
// it to say. Encode yields a message whose length is right, given a type from 1 to 15 and a command
// code that exists; it does not check them.
//
// Each struct has one list of its fields in the order of the wire, `Fields`, from which Decode,
// Encode and LengthOf follow, and everything in fields.h: comparison, names, offsets.
//
// Units: coordinates in the map's pose unit (HELLO says how long it is, 1 mm unless configured
// otherwise); headings as binary angles, 65 536 a turn, counter-clockwise from +x; intensities in
// 1/4096 of a pheromone unit.
#pragma once

#include <stdint.h>

#include "protocol/frame.h"
#include "protocol/opcodes.h"

namespace pheromone {
namespace protocol {

/// A position on the map and the way the robot faces.
struct WirePose {
  int32_t x = 0;
  int32_t y = 0;
  uint16_t heading = 0;
};

/// Whether x and y fit the narrow messages' 16 bits.
inline bool FitsNarrow(int32_t x, int32_t y) {
  return x >= -32768 && x <= 32767 && y >= -32768 && y <= 32767;
}

/// SENSE and SENSE_WIDE: the paper's "pheromone information request" (Susnea et al. 2009, fig. 9).
struct SenseRequest {
  uint8_t id = 0;
  uint8_t type = 0;
  bool wide = false;
  WirePose pose;

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Typed(it.type, it.wide, "SENSE", kSense, "SENSE_WIDE", kSenseWide)
        .Coordinate("x", it.pose.x, it.wide)
        .Coordinate("y", it.pose.y, it.wide)
        .Field("heading", it.pose.heading);
  }
};

/// P_L and P_R of eq. (4) at the two antennas.
struct SenseAnswer {
  uint8_t id = 0;
  uint8_t type = 0;
  bool wide = false;
  int16_t left = 0;
  int16_t right = 0;

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Typed(it.type, it.wide, "SENSE_ANSWER", kFromServer | kSense, "SENSE_WIDE_ANSWER",
               kFromServer | kSenseWide)
        .Field("left", it.left)
        .Field("right", it.right);
  }
};

struct DepositRequest {
  uint8_t id = 0;
  uint8_t type = 0;
  uint8_t seq = 0;
  int16_t x = 0;
  int16_t y = 0;
  uint8_t quanta = 0;

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Typed(it.type, "DEPOSIT", kDeposit)
        .Field("seq", it.seq)
        .Field("x", it.x)
        .Field("y", it.y)
        .Field("quanta", it.quanta);
  }
};

struct DepositAnswer {
  uint8_t id = 0;
  uint8_t type = 0;
  uint8_t seq = 0;

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Typed(it.type, "DEPOSIT_ANSWER", kFromServer | kDeposit)
        .Field("seq", it.seq);
  }
};

/// TRACE and TRACE_WIDE: sense here, then leave one quantum.
struct TraceRequest {
  uint8_t id = 0;
  uint8_t type = 0;
  bool wide = false;
  uint8_t seq = 0;
  WirePose pose;

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Typed(it.type, it.wide, "TRACE", kTrace, "TRACE_WIDE", kTraceWide)
        .Field("seq", it.seq)
        .Coordinate("x", it.pose.x, it.wide)
        .Coordinate("y", it.pose.y, it.wide)
        .Field("heading", it.pose.heading);
  }
};

struct TraceAnswer {
  uint8_t id = 0;
  uint8_t type = 0;
  bool wide = false;
  uint8_t seq = 0;
  int16_t left = 0;
  int16_t right = 0;

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Typed(it.type, it.wide, "TRACE_ANSWER", kFromServer | kTrace, "TRACE_WIDE_ANSWER",
               kFromServer | kTraceWide)
        .Field("seq", it.seq)
        .Field("left", it.left)
        .Field("right", it.right);
  }
};

/// CommandArgumentLength, inline: which makes AVR images 54 bytes smaller.
inline uint8_t ArgumentLengthOf(uint8_t code) {
  switch (static_cast<CommandCode>(code)) {
    case CommandCode::kHalt:
    case CommandCode::kResume:
    case CommandCode::kPickLoad:
    case CommandCode::kDropLoad:
      return 0;
    case CommandCode::kFollowType:
    case CommandCode::kGetParameter:
      return 1;
    case CommandCode::kSpeed:
      return 2;
    case CommandCode::kGoTo:
      return 4;
    case CommandCode::kSetParameter:
      return 5;
  }
  return 0xFF;
}

/// How many of a Command's arguments are in use: none if the code is unknown.
inline uint8_t ArgumentsInUse(CommandCode code) {
  return ArgumentLengthOf(static_cast<uint8_t>(code)) <= kMaxCommandArguments
             ? ArgumentLengthOf(static_cast<uint8_t>(code))
             : uint8_t{0};
}

/// Server to client. `arguments` are as on the wire; CommandArgumentLength says how many there are.
struct Command {
  uint8_t id = 0;
  uint8_t seq = 0;
  CommandCode code = CommandCode::kHalt;
  uint8_t arguments[kMaxCommandArguments] = {};

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Opcode("COMMAND", kCommand)
        .Field("seq", it.seq)
        .Field("code", it.code)
        .Arguments("arguments", it.arguments, it.code);
  }
};

struct CommandAck {
  uint8_t id = 0;
  uint8_t seq = 0;
  CommandCode code = CommandCode::kHalt;
  int16_t result = 0;  ///< 0 accepted, else a Reason

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Opcode("COMMAND_ACK", kCommandAck)
        .Field("seq", it.seq)
        .Field("code", it.code)
        .Field("result", it.result);
  }
};

struct EventReport {
  uint8_t id = 0;
  uint8_t seq = 0;
  EventCode code = EventCode::kLoadPicked;
  int16_t argument = 0;

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Opcode("EVENT", kEvent)
        .Field("seq", it.seq)
        .Field("code", it.code)
        .Field("argument", it.argument);
  }
};

struct EventAck {
  uint8_t id = 0;
  uint8_t seq = 0;

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id).Opcode("EVENT_ACK", kEventAck).Field("seq", it.seq);
  }
};

struct HelloRequest {
  uint8_t id = 0;
  uint16_t nonce = 0;  ///< the client's boot counter
  uint8_t firmware_version = 0;
  uint8_t round_period = 0;  ///< it wants turns this often, in kRoundPeriodMs; 0: none

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Opcode("HELLO", kHello)
        .Field("nonce", it.nonce)
        .Field("firmware_version", it.firmware_version)
        .Field("round_period", it.round_period);
  }
};

struct HelloAnswer {
  uint8_t id = 0;
  uint16_t nonce = 0;
  uint8_t protocol_version = 0;
  uint16_t epoch = 0;
  uint16_t pose_unit_10um = 0;
  uint16_t antenna_distance_mm = 0;  ///< b of eq. (5)
  uint16_t type_mask = 0;            ///< bit t set: pheromone type t exists
  uint8_t slot_ms = 0;
  uint8_t response_window_ms = 0;
  uint8_t last_opcode = 0;
  uint8_t last_seq = 0;

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Opcode("HELLO_ANSWER", kHelloAnswer)
        .Field("nonce", it.nonce)
        .Field("protocol_version", it.protocol_version)
        .Field("epoch", it.epoch)
        .Field("pose_unit_10um", it.pose_unit_10um)
        .Field("antenna_distance_mm", it.antenna_distance_mm)
        .Field("type_mask", it.type_mask)
        .Field("slot_ms", it.slot_ms)
        .Field("response_window_ms", it.response_window_ms)
        .Field("last_opcode", it.last_opcode)
        .Field("last_seq", it.last_seq);
  }
};

/// Both directions; `answer` tells them apart.
struct Ping {
  uint8_t id = 0;
  bool answer = false;
  uint8_t length = 0;
  uint8_t payload[kMaxPing] = {};

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Opcode("answer", it.answer, "PING", kPing, "PING_ANSWER", kPingAnswer)
        .Rest("payload", it.payload, it.length);
  }
};

struct ErrorAnswer {
  uint8_t id = 0;
  uint8_t refused_opcode = 0;
  Reason reason = Reason::kNone;
  uint8_t seq = 0;  ///< 0 where the refused opcode has none

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Id(it.id)
        .Opcode("ERROR", kError)
        .Field("refused_opcode", it.refused_opcode)
        .Field("reason", it.reason)
        .Field("seq", it.seq);
  }
};

/// An answer in a ROUND. `left` is kNoIntensities where there are none; `right` is then the Reason
/// of an ERROR, or 0: not heard, or not answered yet.
struct RoundAnswer {
  int16_t left = 0;
  int16_t right = 0;

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.Field("left", it.left).Field("right", it.right);
  }
};

/// Server to all: the answers to the robots of the last round, and whose turns follow.
struct Round {
  uint8_t number = 0;      ///< counts the rounds of a link; wraps
  uint8_t turn_ms = 0;     ///< from the beginning of one turn to that of the next
  uint8_t turn_bytes = 0;  ///< the longest frame that fits a turn, as sent
  uint8_t slot_ms = 0;     ///< of contention, for whoever has had no answer to HELLO yet
  uint8_t open_slots = 0;  ///< contention slots after the last turn, or kOpenUntilNextRound
  uint8_t answer_count = 0;
  uint8_t turn_count = 0;
  RoundAnswer answers[kMaxTurns];  ///< in the order of the last round's turns
  uint8_t turns[kMaxTurns] = {};   ///< whose they are

  template <typename Self, typename Visit>
  static constexpr Visit Fields(Self& it, Visit&& visit) {
    return visit.ToAll()
        .Opcode("ROUND", kRound)
        .Field("number", it.number)
        .Field("turn_ms", it.turn_ms)
        .Field("turn_bytes", it.turn_bytes)
        .Field("slot_ms", it.slot_ms)
        .Field("open_slots", it.open_slots)
        .Nibbles("turn_count", it.turn_count, "answer_count", it.answer_count)
        .Some("answers", it.answers, it.answer_count)
        .Some("turns", it.turns, it.turn_count);
  }
};

/// Whether opcode and length are those of M, which is a message of this file or of tag_messages.h.
/// If not, `to` stays as it was.
template <typename M>
bool Decode(const Message& from, M* to);

/// False for a narrow message with a pose outside of the narrow range, which must be sent wide:
/// then `to` is unusable. Counts over the arrays' sizes are cut off.
template <typename M>
bool Encode(const M& from, Message* to);

}  // namespace protocol
}  // namespace pheromone
