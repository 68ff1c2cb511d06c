// A Pioneer robot that speaks ARCOS, without I/O and without a clock: bytes and the time go in,
// bytes come out. It stands in for the real one on a serial port, in virtual or in real time.
//
//   PioneerConfig config;
//   config.model = *FindPioneerModel("p3dx-sh");
//   PioneerRobot robot(config, {1.0, 2.0, 0});         // where it stands: m, m, rad
//   robot.OnBytes(from_client, now_ns);
//   robot.AdvanceTo(now_ns);
//   Send(robot.TakeOutput());                         // echoes at once, a SIP every 100 ms
//
// Session: SYNC0, SYNC1, SYNC2 are echoed, the last with three names, also repeated or out of
// sequence; OPEN, with an argument or without, starts the stream of SIPs; CLOSE or HangUp ends it.
// From SYNC2 on the same numbers are commands, as for MobileSim: SYNC0 is PULSE, which nobody
// answers, and a CLOSE that comes before SYNC0 begins a session that only another CLOSE ends. A
// silent line does not end the session. Motors are off and settings (SETV, SETA ...) are those of
// the model at each OPEN and after each end; odometry continues. Motion commands while the motors
// are off are ignored.
//
// Commands: PULSE, OPEN, CLOSE, ENABLE, SETA, SETV, SETO, MOVE, ROTATE, SETRV, VEL, HEAD, DHEAD,
// CONFIG (answered with a packet 0x20, or not), ENCODER, RVEL, SETRA, SONAR, STOP, VEL2, IOREQUEST,
// E_STOP and HOSTBAUD (ignored: a simulated line has no rate). Other commands, and those with a
// missing argument, are ignored and counted. Settings above the model's maxima are limited to them;
// an acceleration of 0 is ignored.
//
// Motion: translation and rotation are independent. MOVE and VEL end each other, as do HEAD, DHEAD,
// ROTATE and RVEL, of which the last two are the same. MOVE covers a distance, HEAD turns the
// shorter way to a heading of the odometry and DHEAD turns by an angle, of any size; all three obey
// the accelerations and stand at their end. SETO during one of them does not change where it ends.
// VEL2, whose bytes may be raw or negated as a word, sets both axes; a command for one axis after
// VEL2 sets the other one to 0, as ARCOS changes between its two ways of motion.
//
// ENCODER and IOREQUEST: after the next SIP (1), after every one from now on (2 or more) or after
// none (0) come a packet 0x90 and 0xF0.
//
// Watchdog: without any valid packet for 2 s the robot slows down and stops; the next one makes it
// resume its speed, or go on with a MOVE, HEAD or DHEAD. MobileSim does not have that
// (`watchdog_ms` = 0).
//
// SIPs are of type 0x33 while the robot moves, else 0x32. A client that begins a session closes an
// older one only when it sees 0x32; until then it repeats SYNC0, which for the older session is a
// PULSE and keeps a robot driving that its client has left. So speeds that for the watchdog's time
// only PULSEs have kept up are reported as 0x32, and without a watchdog all, as by MobileSim.
//
// The STOP button halts the robot regardless of its deceleration, switches its motors off and keeps
// them off; once it is released they can be enabled again. While it is pressed, SIPs report both
// wheels stalled and two flags.
//
// Obstacles stop the robot, whose wheels then stall; it tries again until it is commanded
// otherwise. Bumpers and sonars: pioneer_sensors.h.
//
// Time is int64_t nanoseconds, from 0; motion is computed in whole milliseconds. The output depends
// on the configuration and on the calls with their times, not on how AdvanceTo is called. A time in
// the past is treated as the present. No errors; one thread.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "client_fw/sim/pioneer/pioneer_drive.h"
#include "client_fw/sim/pioneer/pioneer_models.h"
#include "client_fw/sim/pioneer/pioneer_packets.h"
#include "client_fw/sim/pioneer/pioneer_reports.h"
#include "client_fw/sim/pioneer/pioneer_sensors.h"
#include "client_fw/sim/pioneer/pioneer_setpoint.h"

namespace pheromone::sim {

struct PioneerConfig {
  PioneerModel model = PioneerModels().front();
  std::string name = "Simulated";  ///< reported in answer to SYNC2
  double wheelbase_m = 0;  ///< of the wheels on the ground; 0: as configured in the firmware
  PioneerErrors errors;
  int sip_period_ms = 100;  ///< at least 1
  int watchdog_ms = 2000;   ///< 0: never
  SipForm sip_form = SipForm::kFull;
  int position_bits = 15;  ///< X and Y wrap at 15 or 16 bits
  int sonars = 16;         ///< readings in a SIP, at most kMaxSonarReadings; more sonars take turns
  int bumpers = 5;         ///< segments of the rings in front and behind, at most 7; 0: no bumpers
  bool answers_config = true;
  double battery_v = 12.8;
  Blocked blocked;    ///< whether an obstacle blocks a position; none if empty
  RangeFinder range;  ///< to the obstacles that sonars and bumpers perceive; none if empty
};

struct PioneerCounters {
  uint64_t packets = 0;        ///< valid ones received
  uint64_t bad_checksums = 0;  ///< dropped
  uint64_t ignored = 0;        ///< valid, but unknown, before a session or without their argument
  uint64_t sessions = 0;       ///< OPENs that began one
  uint64_t closes = 0;         ///< CLOSEs that ended one, or what SYNC2 had begun
  uint64_t sips = 0;           ///< sent
  uint64_t lost_sips = 0;      ///< not sent because the output was not taken
  uint64_t watchdog_stops = 0;
};

class PioneerRobot {
 public:
  static constexpr int64_t kNever = std::numeric_limits<int64_t>::max();

  PioneerRobot(const PioneerConfig& config, const PlanePose& start);

  /// Bytes from the client, received at `time_ns`.
  void OnBytes(std::span<const uint8_t> bytes, int64_t time_ns);
  /// Processes all events up to and including `time_ns`.
  void AdvanceTo(int64_t time_ns);
  /// The client has disconnected: like CLOSE.
  void HangUp();

  /// Presses or releases the STOP button.
  void set_stop_pressed(bool pressed);
  void set_battery_v(double battery_v) { config_.battery_v = battery_v; }

  /// The output since the last call. At most a few kilobytes are kept.
  std::vector<uint8_t> TakeOutput();
  /// When the next SIP is due, kNever without a session.
  int64_t NextSipTime() const { return open() ? next_sip_ns_ : kNever; }

  int64_t now_ns() const { return now_ns_; }
  bool open() const { return session_ == Session::kOpen; }
  bool motors_enabled() const { return motors_enabled_; }
  bool stop_pressed() const { return stop_pressed_; }
  double battery_v() const { return config_.battery_v; }
  PressedBumpers bumpers() const;
  const PioneerDrive& drive() const { return drive_; }
  const MotionLimits& limits() const { return limits_; }
  PioneerCounters counters() const;

 private:
  enum class Session { kSynchronising, kSynchronised, kOpen };

  void Synchronise(const Packet& packet);
  void Obey(const Packet& packet);
  bool ObeyArgument(uint8_t command, int argument);
  bool ObeyMotion(uint8_t command, int argument);
  bool ObeySetting(uint8_t command, int argument);
  void LeaveWheels();
  void StandStill();
  void Open();
  void Close();
  void TickMotion();
  void SendSip();
  void SendExtras();
  std::vector<SonarReading> ReadSonar();
  bool ReportsMoving() const;
  void Send(const std::vector<uint8_t>& packet);
  MotionLimits ModelLimits() const;
  bool Silent() const;

  PioneerConfig config_;
  PioneerDrive drive_;
  PacketReader reader_;
  PioneerCounters counters_;
  std::vector<uint8_t> output_;
  int64_t now_ns_ = 0;
  int64_t next_tick_ns_;
  int64_t next_sip_ns_ = 0;
  int64_t last_packet_ns_ = 0;
  int64_t last_command_ns_ = 0;  // other than PULSE
  Session session_ = Session::kSynchronising;
  bool motors_enabled_ = false;
  bool sonar_enabled_ = false;
  bool silent_ = false;
  bool stop_pressed_ = false;
  bool by_wheels_ = false;  // the setpoints are VEL2's
  Setpoint translation_;
  Setpoint rotation_;
  int encoder_packets_ = 0;  // as asked for: 0, 1 or more
  int io_packets_ = 0;
  size_t next_sonar_ = 0;  // first of the next SIP
  MotionLimits limits_;
};

}  // namespace pheromone::sim
