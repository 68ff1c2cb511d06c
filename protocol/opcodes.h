// Every number of the protocol that has a name, but for those inside of TAG's messages
// (tag_messages.h). Bit 7 of an opcode is set in the server's messages; bits 6-4 select the
// service, bits 3-0 the pheromone type (1-15) or a function of the service.
#pragma once

#include <stdint.h>

namespace pheromone {
namespace protocol {

constexpr uint8_t kProtocolVersion = 1;

constexpr uint8_t kFromServer = 0x80;

/// Services that take a pheromone type in their low four bits.
enum Service : uint8_t {
  kSense = 0x00,
  kSenseWide = 0x10,
  kDeposit = 0x20,
  kTrace = 0x30,
  kTraceWide = 0x60,
};

/// Opcodes of the services that take a function instead.
enum Opcode : uint8_t {
  kScan = 0x41,
  kTagRead = 0x42,
  kTagWrite = 0x43,
  kTagErase = 0x44,
  kSymbol = 0x45,
  kResolve = 0x46,
  kCommandAck = 0x51,
  kEvent = 0x52,
  kHello = 0x71,
  kPing = 0x72,
  kScanAnswer = 0xC1,
  kTagReadAnswer = 0xC2,
  kTagWriteAnswer = 0xC3,
  kTagEraseAnswer = 0xC4,
  kSymbolAnswer = 0xC5,
  kResolveAnswer = 0xC6,
  kCommand = 0xD1,
  kEventAck = 0xD2,
  kHelloAnswer = 0xF1,
  kPingAnswer = 0xF2,
  kRound = 0xF3,
  kError = 0xFE,
};

enum class Reason : uint8_t {
  kNone = 0,
  kUnknownOpcode = 1,
  kBadLength = 2,
  kOffTheMap = 3,
  kUnknownPheromone = 4,
  kSequenceReused = 5,
  kSayHello = 6,
  kBusy = 7,
  kReadOnly = 8,
  kMapFull = 9,
  kNotPermitted = 10,
  kBadValue = 11,
  kBlockedByObstacle = 12,
  kNoTagInRange = 16,  ///< or no such tag
  kTagProtected = 17,
  kTagFull = 18,
  kGenerationChanged = 19,
  kUnknownSymbol = 20,  ///< or the robot has no number
};

enum class CommandCode : uint8_t {
  kHalt = 1,
  kResume = 2,
  kSpeed = 3,       ///< i16 mm/s
  kGoTo = 4,        ///< x i16, y i16, pose units
  kFollowType = 5,  ///< u8
  kPickLoad = 6,
  kDropLoad = 7,
  kSetParameter = 8,  ///< id u8, value i32
  kGetParameter = 9,  ///< id u8
};

enum class EventCode : uint8_t {
  kLoadPicked = 1,
  kLoadDropped = 2,
  kObstacle = 3,
  kOffTheMap = 4,
  kTrailLost = 5,
  kFailSafeStop = 6,
  kGoalReached = 7,
  kParameterValue = 8,
  kBatteryLow = 9,
  kStoppedByHand = 10,
  kPoseLost = 11,
  kNetException = 12,
};
constexpr EventCode kLastEvent = EventCode::kNetException;

constexpr uint8_t kMinType = 1;
constexpr uint8_t kMaxType = 15;
constexpr uint8_t kMaxPing = 16;
constexpr uint8_t kMaxCommandArguments = 5;
/// Turns of one ROUND.
constexpr uint8_t kMaxTurns = 11;
/// The unit of the period in HELLO.
constexpr uint8_t kRoundPeriodMs = 20;
/// From the end of a ROUND to its first turn.
constexpr uint8_t kBeforeTurnsMs = 1;
/// So much after its beginning, a turn can still be taken.
constexpr uint8_t kLatestTurnMs = 2;
/// In ROUNDs whose number is a multiple of it, a robot may tell an EVENT in its turn.
constexpr uint8_t kEventRounds = 8;
/// Contention slots of a ROUND after which the channel is free until the next one.
constexpr uint8_t kOpenUntilNextRound = 255;
/// P_L of an answer in a ROUND that has no intensities: -32768, which no intensity is.
constexpr int16_t kNoIntensities = -32767 - 1;

inline bool IsFromServer(uint8_t opcode) {
  return (opcode & kFromServer) != 0;
}

/// The service bits of an opcode, without the direction: comparable with Service.
inline uint8_t ServiceOf(uint8_t opcode) {
  return static_cast<uint8_t>(opcode & 0x70u);
}

/// The pheromone type of an opcode; meaningful for the services of `Service` only.
inline uint8_t TypeOf(uint8_t opcode) {
  return static_cast<uint8_t>(opcode & 0x0Fu);
}

/// Whether the service of `opcode` is one of `Service`.
inline bool TakesType(uint8_t opcode) {
  const uint8_t service = ServiceOf(opcode);
  return service == kSense || service == kSenseWide || service == kDeposit || service == kTrace ||
         service == kTraceWide;
}

/// Whether a client's `opcode` changes the server's state and therefore begins with a seq.
inline bool IsMutating(uint8_t opcode) {
  const uint8_t service = ServiceOf(opcode);
  return !IsFromServer(opcode) &&
         (opcode == kEvent || service == kDeposit || service == kTrace || service == kTraceWide ||
          (opcode >= kTagWrite && opcode <= kSymbol));
}

/// How long DATA of an opcode may be.
struct LengthRule {
  bool known;  ///< false: no such opcode
  uint8_t least;
  uint8_t most;  ///< equal to `least` where DATA has no list, text or payload
};

/// The lengths of a COMMAND are further bound by its code (see CommandArgumentLength), those of a
/// ROUND by its counts, those of an answer to SCAN by its rows of 8 bytes, those of one to RESOLVE
/// by the length of the whole text.
LengthRule LengthOf(uint8_t opcode);

/// Bytes of arguments that a COMMAND's code takes, or 0xFF for an unknown code. Not inline: that
/// costs an AVR flash.
uint8_t CommandArgumentLength(uint8_t code);

}  // namespace protocol
}  // namespace pheromone
