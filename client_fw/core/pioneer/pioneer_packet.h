// Packets of ARCOS, the protocol of a Pioneer's microcontroller (and of its predecessors AROS and
// P2OS): encodes commands to the robot, and decodes the robot's packets byte by byte.
//
//   uint8_t size = EncodeCommand(PioneerCommand::kVel2, word, packet);   // 9 bytes to send
//   if (receiver.Push(byte, now_ms)) ... receiver.id(), receiver.X() ... // a packet is complete
//
// A packet, both ways: FA FB, count N, N - 2 bytes of which the first is the command or the type of
// packet, checksum high byte first. The checksum is the sum, modulo 65 536, of the bytes taken in
// pairs, the first one high; a byte left over is combined with the low byte by exclusive or.
// Numbers are little-endian. A packet with a wrong checksum is dropped silently; so is one with a
// pause of over kPacketGapMs inside, so that a damaged count does not consume the following bytes.
//
// Sources: Pioneer 3 Operations Manual, chapter "ARCOS"; ARIA, ArRobotPacket and ArSipHandler.
//
// No I/O, no memory but the objects; one instance belongs to one loop (not to interrupts). Times
// are the low 16 bits of a millisecond clock.
#pragma once

#include <stdint.h>

#include "client_fw/core/steering/drive_status.h"
#include "protocol/byte_order.h"

namespace pheromone {
namespace client {

/// Commands to the robot. The first three have a second meaning while no session is open, when the
/// robot echoes them.
enum class PioneerCommand : uint8_t {
  kSync0 = 0,
  kSync1 = 1,
  kSync2 = 2,
  kPulse = 0,            ///< no effect, except for the robot's watchdog
  kOpen = 1,             ///< begin to send information
  kClose = 2,            ///< end of the session
  kEnable = 4,           ///< motors on (1) or off (0); they are off when a session begins
  kSetAcceleration = 5,  ///< mm/s^2; negative: the deceleration
  kVel = 11,             ///< mm/s forward
  kRvel = 21,            ///< degrees/s counter-clockwise
  kSonar = 28,           ///< on (1) or off (0)
  kVel2 = 32,            ///< wheel speeds: see WheelWord
  kEmergencyStop = 55,   ///< stop regardless of the deceleration
};

constexpr uint8_t kMaxPioneerCommand = 9;

/// Writes a command without or with an argument and returns its size: 6 and 9 bytes. `packet` holds
/// kMaxPioneerCommand bytes. A negative argument is sent as its absolute value with a separate
/// type, as by ARIA.
uint8_t EncodeCommand(PioneerCommand command, uint8_t* packet);
uint8_t EncodeCommand(PioneerCommand command, int16_t argument, uint8_t* packet);

/// A wheel's speed in VEL2 is counted in these (Vel2Divisor of Pioneer 2, 3 and PeopleBot).
constexpr int16_t kWheelUnitMmS = 20;
/// The argument of VEL2: left wheel in the high byte, right wheel in the low one, each to the
/// nearest unit, halves away from zero, and at most 127 units (2540 mm/s) either way.
int16_t WheelWord(int16_t left_mm_s, int16_t right_mm_s);

/// The longest pause inside a packet. SIPs begin 100 ms apart and last 43 ms at 9600 baud.
constexpr uint16_t kPacketGapMs = 40;

/// The sonars ahead are the middle ones of the front array of eight, 10 and 30 degrees to either
/// side.
constexpr uint8_t kFirstFrontSonar = 2;
constexpr uint8_t kFrontSonars = 4;

/// Plain memory: PioneerReceiver() is all zero, and ready.
class PioneerReceiver {
 public:
  /// A byte from the robot, read at `now_ms`. True: it completes a packet, which can be read until
  /// the next Push.
  bool Push(uint8_t byte, uint16_t now_ms);

  /// Command echoed, or type.
  uint8_t id() const { return kept_[0]; }
  /// 0x30 to 0x34: a standard server information packet (SIP), and long enough to contain the pose.
  bool IsSip() const { return static_cast<uint8_t>(id() - 0x30) <= 4 && length_ >= 9; }

  // Fields of a SIP, as the robot counts them.
  uint16_t X() const { return protocol::GetU16(kept_ + 1); }
  uint16_t Y() const { return protocol::GetU16(kept_ + 3); }
  uint16_t Heading() const { return protocol::GetU16(kept_ + 5); }  ///< 4096 a turn
  /// Packets of old firmware end early.
  bool HasStallAndFlags() const { return length_ >= 20; }
  uint8_t Battery() const { return kept_[7]; }  ///< 0.1 V
  uint16_t Stall() const { return protocol::GetU16(kept_ + 8); }
  uint8_t Flags() const { return kept_[12]; }  ///< the low byte
  /// The shortest range of the sonars ahead in this packet, mm; kNoRange if it has none of them.
  uint16_t FrontRange() const { return front_; }

  /// A third string, as in the answer to SYNC2.
  bool HasNames() const { return subclass_end_ != 0; }
  /// In the answer to SYNC2: the subclass, its third string, ends in "sh" or "SH".
  bool SubclassIsSh() const { return subclass_end_ == ('s' << 8 | 'h'); }

 private:
  void PushHeader(uint8_t byte);

  void PushSonar(uint8_t byte);

  // Of the bytes counted by N, those from 0 to 6 and from 11 to 16 are kept: type and pose;
  // battery, stall, the heading setpoint, and flags.
  uint8_t kept_[13];
  uint8_t readings_;        // of sonars, still to come
  uint8_t reading_at_;      // byte of the one that comes
  uint8_t reading_number_;  // its sonar
  uint8_t reading_low_;
  uint16_t front_;
  uint8_t header_;         // bytes of FA FB N seen
  uint8_t length_;         // N
  uint8_t left_;           // of the N bytes; 0: in the header
  uint8_t strings_;        // that have ended
  uint16_t subclass_end_;  // the last two letters, in lower case
  uint16_t sum_;
  uint16_t last_byte_ms_;
};

}  // namespace client
}  // namespace pheromone
