// Numbers of COMMAND 9 that are not settings: what a lab asks a robot that behaves oddly. Answered
// by an EVENT *parameter value*, at most 32 767; counters wrap at 65 536 before that limit applies.
#pragma once

#include <stdint.h>

namespace pheromone {
namespace client {

enum Diagnostic : uint8_t {
  // Of the board: Board::diagnostic.
  kResetCause = 128,          ///< of the last start: a set of ResetCause
  kRadioFramingErrors = 129,  ///< bytes without a stop bit, of the radio's UART
  kRadioOverruns = 130,       ///< times that bytes came faster than an interrupt took them
  kRobotFramingErrors = 131,  ///< the same, of the robot's UART
  kRobotOverruns = 132,
  kEndOfBoardDiagnostics = 133,
  // Of the conversation and the drive.
  kStopFlags = 133,      ///< why it stands: a set of StopFlag
  kAlarms = 134,         ///< present ones: a set of Alarm
  kBumperWord = 135,     ///< stalls and bumpers as last reported by the drive
  kBattery = 136,        ///< 0.1 V; 0: unknown
  kFrontRange = 137,     ///< mm to what is ahead; 32 767: nothing
  kRequestCount = 138,   ///< requests sent
  kTimeoutCount = 139,   ///< of them, without an answer
  kCrcErrorCount = 140,  ///< damaged frames heard
  kFailSafeCount = 141,  ///< stops because answers were missing
  kEndOfDiagnostics
};

/// As MCUSR of an AVR has it. 0: not known, since a bootloader has read it.
enum ResetCause : uint8_t {
  kPowerOnReset = 0x01,
  kExternalReset = 0x02,  ///< the reset pin
  kBrownOutReset = 0x04,  ///< the supply sagged
  kWatchdogReset = 0x08,  ///< the program hung
};

}  // namespace client
}  // namespace pheromone
