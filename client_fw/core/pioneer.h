// The robot's link to its Pioneer (ARCOS), without any I/O: bytes and the time go in, commands,
// odometry and stalls come out.
//
//   pioneer.OnByte(byte, now_ms);                                  // each byte from the Pioneer
//   pioneer.Poll(now_ms);                                          // every millisecond or so
//   while (pioneer.tx_size() != 0 && put(*pioneer.tx())) pioneer.OnPut(now_ms);
//   pioneer.set_wheel_speeds(200, 150);
//   if (pioneer.known()) ... pioneer.odometry() ...
//
// PioneerDrive (pioneer_drive.h) does this for a board.
//
// Session. SYNC0, SYNC1 and SYNC2 are sent, each after the echo of the one before. If an echo does
// not come within kPioneerSilenceMs, or if a SIP comes, which shows that the Pioneer is still in an
// older session, CLOSE is sent, and after a pause SYNC0 again. After the last echo come OPEN, SONAR
// 0, ENABLE 1 and zero speed. ENABLE is repeated while SIPs show the motors off and the STOP button
// not pressed, SONAR while they show sonars on. After kPioneerSilenceMs without a SIP the session
// is closed, which stops a Pioneer that receives our commands although we do not receive its
// reports, and a new session is attempted, as often as needed.
//
// Motion. Every call of set_wheel_speeds is sent; if calls come faster than commands may be sent,
// the last one. A Pioneer stops after 2 s without a command and with the next one, whatever it is,
// resumes its speed. Hence speeds are repeated every kKeepAliveMs if there is nothing else to send,
// a new session begins with zero, and calls while there is no odometry are ignored.
//
// Odometry is the path travelled since this object was created, from 0, 0, 0, within 1 mm of what
// the Pioneer counts: nothing is rounded on the way. It is unknown before the first SIP of a
// session. A Pioneer may count from zero and along other axes in a new session; odometry then
// continues from the last known pose, so that movements in between, rolling to a stop or being
// carried by hand, are not included. The loss of SIPs within a session has no effect, up to 16 383
// counts. The length of a count, DistConvFactor, is 1 mm if the subclass reported in answer to
// SYNC2 ends in "sh" (p3dx-sh, peoplebot-sh), otherwise as given (p3dx, perfpb and perfpb+: 0.485
// mm). On axes that are turned it is accurate to 3 parts in 10 000.
//
// Units: mm, mm/s, 100 nm (0.1 micrometres) for the length of a count, binary angles. Times are the
// low 16 bits of a millisecond clock; Poll has to be called more than once a minute. Nothing is
// allocated; one instance belongs to one loop (not to interrupts). Damaged or unknown packets are
// ignored.
//
// Sources: Pioneer 3 Operations Manual, "ARCOS"; ARIA, ArRobot and its parameter files.
#pragma once

#include <stdint.h>

#include "client_fw/core/angle.h"
#include "client_fw/core/pioneer_packet.h"

namespace pheromone {
namespace client {

/// Without the echo of a SYNC, or a SIP in an open session, for this time: close and begin again.
constexpr uint16_t kPioneerSilenceMs = 1000;
/// Between closing and SYNC0, in which delayed SIPs arrive.
constexpr uint16_t kAfterCloseMs = 200;
/// Speeds are repeated after this time without a command.
constexpr uint16_t kKeepAliveMs = 500;
/// From the last byte put of a command to the next command: 9 bytes leave in 9.4 ms at 9600 baud,
/// and the Pioneer requires 5 ms between commands.
constexpr uint16_t kCommandGapMs = 15;

constexpr int16_t k100NmPerMm = 10000;
/// DistConvFactor of Pioneers that count fractions of a millimetre: 0.485 mm.
constexpr int16_t kPioneerCount100Nm = 4850;

/// Bits of Pioneer::stall(); the others are bumpers.
constexpr uint16_t kLeftStall = 0x0001;
constexpr uint16_t kRightStall = 0x0100;
/// Bits of Pioneer::flags().
constexpr uint8_t kMotorsOn = 0x01;
constexpr uint8_t kSonarsOn = 0x1E;
constexpr uint8_t kStopPressed = 0x20;

/// The variables of Pioneer, separate so that one loop can clear them as plain memory.
class PioneerState {
 protected:
  // The low four bits are the command with which a phase begins.
  enum Phase : uint8_t { kSync0 = 0, kSync1 = 1, kSync2 = 2, kClosing = 0x12, kOpen = 0x11 };
  // The commands to be sent, in this order.
  enum Due : uint8_t { kPhase = 1, kSonar = 2, kEnable = 4, kSpeeds = 8 };

  PioneerReceiver receiver_;
  Phase phase_;
  uint8_t due_;
  bool known_;
  uint8_t flags_;
  uint16_t stall_;
  uint16_t since_ms_;  // when the phase began, or its last SIP came
  uint16_t put_ms_;    // when the last byte was put
  int16_t speeds_;     // the argument of VEL2
  uint16_t x_;         // as last reported by the Pioneer
  uint16_t y_;
  BinaryAngle turned_;   // the Pioneer's axes relative to ours
  int16_t count_100nm_;  // as given
  int16_t cos_100nm_;    // along our axes, for a count along the Pioneer's
  int16_t sin_100nm_;
  int16_t x_rest_100nm_;  // beyond odometry_
  int16_t y_rest_100nm_;
  Odometry odometry_;
  uint8_t tx_at_;
  uint8_t tx_end_;
  uint8_t tx_[kMaxPioneerCommand];
};

class Pioneer : private PioneerState {
 public:
  /// `count_100nm`, over 0: the length of a count of robots whose subclass does not end in "sh".
  explicit Pioneer(uint16_t now_ms, int16_t count_100nm = kPioneerCount100Nm);

  /// A byte from the Pioneer, read at `now_ms`.
  void OnByte(uint8_t byte, uint16_t now_ms);
  /// Advances to `now_ms`.
  void Poll(uint16_t now_ms);

  /// The rest of a command, to be sent without a pause; tx_size() 0: none.
  const uint8_t* tx() const { return tx_ + tx_at_; }
  uint8_t tx_size() const { return static_cast<uint8_t>(tx_end_ - tx_at_); }
  /// The first byte of tx() was given to the UART.
  void OnPut(uint16_t now_ms);

  /// To the nearest 20 mm/s, at most 2540 mm/s; ignored while known() is false.
  void set_wheel_speeds(int16_t left_mm_s, int16_t right_mm_s);

  /// The Pioneer is sending odometry.
  bool known() const { return known_; }
  const Odometry& odometry() const { return odometry_; }
  /// From the last SIP that contained it; meaningful while known().
  uint16_t stall() const { return stall_; }
  uint8_t flags() const { return flags_; }

 private:
  void Enter(Phase phase, uint16_t now_ms);
  void OnPacket(uint16_t now_ms);
  void OnSip();
  void Move();
  void Send();
};

}  // namespace client
}  // namespace pheromone
