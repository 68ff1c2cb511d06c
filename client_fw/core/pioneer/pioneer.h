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
// older session, CLOSE is sent, and after a pause SYNC0 again; a Pioneer without a session may take
// CLOSE for SYNC2 and answer with its names, as MobileSim does. After the last echo come OPEN,
// SONAR, SETA with kDecelerationMmS2, ENABLE 1 and zero speed. ENABLE is repeated only if motors
// are off, nobody presses the STOP button, and the robot is to move; SONAR while sonars are not as
// wanted. After kPioneerSilenceMs without a SIP the session is closed, which stops a Pioneer that
// receives our commands although we do not receive its reports, and a new session is attempted, as
// often as needed.
//
// Rates. A Pioneer's port is at 9600 baud when it is switched on; a program that used it before,
// such as ARIA, may have left it at another rate. So each SYNC0 without an answer is followed by
// CLOSE and SYNC0 at the next of the board's rates (rate()), again and again. In a session the rate
// remains, also for the next one.
//
// A warm reset of our own leaves the Pioneer in its session. Continue() stops it with E_STOP and
// goes on in that session with the next SIP, so that odometry includes whatever it rolled in
// between. If no SIP comes, a new session begins, and kPoseLostAlarm says that odometry has a gap.
//
// Motion. Every call of set_wheel_speeds is sent; if calls come faster than commands may be sent,
// the last one. A Pioneer stops after 2 s without a command and with the next one, whatever it is,
// resumes its speed. Hence speeds are repeated every kKeepAliveMs if there is nothing else to send,
// a new session begins with zero, and calls while there is no odometry are ignored.
//
// Alarms. A stall and a pressed bumper or STOP button last as long as SIPs report them; motors that
// go off, having been on in this session, until the next SIP.
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

#include "client_fw/core/base/angle.h"
#include "client_fw/core/pioneer/pioneer_packet.h"
#include "client_fw/core/steering/drive_status.h"

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

/// Told to the Pioneer at the beginning of a session: what its flash has is anybody's guess. From
/// 300 mm/s it stops in 0.6 s, on 90 mm.
constexpr int16_t kDecelerationMmS2 = 500;

/// Each sonar is reported in one of so many SIPs at least: they fire one after the other, 40 ms
/// apart.
constexpr uint8_t kSonarSips = 4;

constexpr int16_t k100NmPerMm = 10000;
/// DistConvFactor of Pioneers that count fractions of a millimetre: 0.485 mm.
constexpr int16_t kPioneerCount100Nm = 4850;

/// Bits of DriveStatus::bumpers; the others are bumpers.
constexpr uint16_t kLeftStall = 0x0001;
constexpr uint16_t kRightStall = 0x0100;
constexpr uint16_t kStalls = kLeftStall | kRightStall;
/// Bits of Pioneer::flags().
constexpr uint8_t kMotorsOn = 0x01;
constexpr uint8_t kSonarsOn = 0x1E;
constexpr uint8_t kStopPressed = 0x60;  ///< the button, or a stop that it has caused

/// All that odometry depends on. Plain memory; a board may keep it over a warm reset (Continue).
struct PioneerTrack {
  Odometry odometry;
  uint16_t x;  ///< as last reported by the Pioneer
  uint16_t y;
  BinaryAngle turned;  ///< the Pioneer's axes relative to ours
  int16_t cos_100nm;   ///< along our axes, for a count along the Pioneer's
  int16_t sin_100nm;
  int16_t x_rest_100nm;  ///< beyond odometry
  int16_t y_rest_100nm;
  uint8_t rate;  ///< Pioneer::rate()
};

/// The variables of Pioneer, separate so that one loop can clear them as plain memory.
class PioneerState {
 protected:
  // The low four bits are the command with which a phase begins.
  enum Phase : uint8_t {
    kSync0 = 0,
    kSync1 = 1,
    kSync2 = 2,
    kClosing = 0x12,
    kOpen = 0x21,
    kContinuing = 0x30,  // waits for a SIP of the session of before a warm reset
  };
  // The commands to be sent, in this order.
  enum Due : uint8_t {
    kPhase = 1,
    kEmergency = 2,
    kSonar = 4,
    kDeceleration = 8,
    kEnable = 16,
    kSpeeds = 32
  };

  PioneerReceiver receiver_;
  Phase phase_;
  uint8_t due_;
  bool known_;
  bool with_sonar_;
  bool motors_used_;  // they were on in this session
  uint8_t sips_;      // that have moved the track; wraps
  uint8_t flags_;
  uint16_t front_mm_;       // the shortest range ahead of this window of SIPs
  uint16_t last_front_mm_;  // and of the one before
  uint8_t window_sips_;
  uint16_t since_ms_;    // when the phase began, or its last SIP came
  uint16_t put_ms_;      // when the last byte was put
  int16_t speeds_;       // the argument of VEL2
  int16_t count_100nm_;  // as given
  PioneerTrack track_;
  DriveStatus status_;
  uint8_t tx_at_;
  uint8_t tx_end_;
  uint8_t tx_[kMaxPioneerCommand];
};

class Pioneer : private PioneerState {
 public:
  /// `count_100nm`, over 0: the length of a count of robots whose subclass does not end in "sh".
  /// `with_sonar`: sonars are switched on, else off.
  explicit Pioneer(uint16_t now_ms, int16_t count_100nm = kPioneerCount100Nm,
                   bool with_sonar = false);

  /// After a warm reset, before anything else: goes on with the session in which this was the
  /// track.
  void Continue(const PioneerTrack& track);

  /// A new connection to the Pioneer: begins with SYNC0, or with CLOSE if a program before us may
  /// have left it in a session, where it would resume that one's speed at SYNC0.
  void Restart(uint16_t now_ms, bool close_first = false);

  /// A byte from the Pioneer, read at `now_ms`. Whether it was the last one of a SIP, of which the
  /// next SIP leaves nothing in status().
  bool OnByte(uint8_t byte, uint16_t now_ms);
  /// Advances to `now_ms`.
  void Poll(uint16_t now_ms);

  /// The rest of a command, to be sent without a pause; tx_size() 0: none.
  const uint8_t* tx() const { return tx_ + tx_at_; }
  uint8_t tx_size() const { return static_cast<uint8_t>(tx_end_ - tx_at_); }
  /// The first byte of tx() was given to the UART.
  void OnPut(uint16_t now_ms);

  /// To the nearest 20 mm/s, at most 2540 mm/s; ignored while known() is false.
  void set_wheel_speeds(int16_t left_mm_s, int16_t right_mm_s);

  /// Stops it without regard to its deceleration, whatever the session's state; speeds are zero.
  void emergency_stop();

  /// The Pioneer is sending odometry.
  bool known() const { return known_; }
  const Odometry& odometry() const { return track_.odometry; }
  const PioneerTrack& track() const { return track_; }
  /// Counts the rates at which it did not answer, from 0; wraps. tx() is to be sent at this one of
  /// the board's.
  uint8_t rate() const { return track_.rate; }
  /// Changes with every SIP that has changed the track.
  uint8_t sips() const { return sips_; }
  /// From the last SIP that contained it; meaningful while known().
  uint8_t flags() const { return flags_; }
  /// As of the last SIP; empty while there is none.
  const DriveStatus& status() const { return status_; }

 private:
  void Enter(Phase phase, uint16_t now_ms);
  void OnPacket(uint16_t now_ms);
  void OnSip();
  void OnStatus();
  void LookAhead();
  void Move();
  void Send();
};

}  // namespace client
}  // namespace pheromone
