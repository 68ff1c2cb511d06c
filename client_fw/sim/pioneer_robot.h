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
// Session: SYNC0, SYNC1, SYNC2 are echoed in this order, the last with three names; a repeated one
// is echoed again; OPEN, with an argument or without, starts the stream of SIPs; CLOSE or HangUp
// ends it. Between SYNC2 and OPEN, SYNC0 restarts the sequence. A silent line does not end the
// session. Motors are off and settings (SETV, SETA ...) are those of the model at each OPEN and
// after each end; odometry continues. Motion commands while the motors are off are ignored.
//
// Commands: PULSE, OPEN, CLOSE, ENABLE, SETA, SETV, SETO, SETRV, SETRA, VEL, RVEL, VEL2, SONAR,
// STOP, E_STOP, CONFIG (answered with a packet 0x20, or not) and HOSTBAUD (ignored: a simulated
// line has no rate). Other commands, and those with a missing argument, are ignored and counted.
// VEL2 may have its bytes raw or negated as a word. VEL or RVEL after VEL2 sets the other one to 0,
// as ARCOS changes between its two ways of motion; settings above the model's maxima are limited to
// them; an acceleration of 0 is ignored.
//
// Watchdog: without any valid packet for 2 s the robot slows down and stops; the next one makes it
// resume its speed. MobileSim does not have that (`watchdog_ms` = 0).
//
// Time is int64_t nanoseconds, from 0; motion is computed in whole milliseconds. The output depends
// on the configuration and on the bytes with their times, not on how AdvanceTo is called. A time in
// the past is treated as the present. No errors; one thread.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "client_fw/sim/pioneer_drive.h"
#include "client_fw/sim/pioneer_models.h"
#include "client_fw/sim/pioneer_packets.h"
#include "client_fw/sim/pioneer_reports.h"

namespace pheromone::sim {

struct PioneerConfig {
  PioneerModel model = PioneerModels().front();
  std::string name = "Simulated";  ///< reported in answer to SYNC2
  double wheelbase_m = 0;  ///< of the wheels on the ground; 0: as configured in the firmware
  PioneerErrors errors;
  int sip_period_ms = 100;  ///< at least 1
  int watchdog_ms = 2000;   ///< 0: never
  SipForm sip_form = SipForm::kFull;
  int position_bits = 15;         ///< X and Y wrap at 15 or 16 bits
  int sonars = 16;                ///< readings in a SIP; at most kMaxSonarReadings
  bool sonar_when_opened = true;  ///< until SONAR 0
  bool answers_config = true;
  double battery_v = 12.8;
  Blocked blocked;  ///< whether an obstacle blocks a position; none if empty
  /// The reading of sonar `number` at a pose, mm. If empty: 5000, nothing within reach.
  std::function<int(const PlanePose& pose, int number)> range_mm;
};

struct PioneerCounters {
  uint64_t packets = 0;        ///< valid ones received
  uint64_t bad_checksums = 0;  ///< dropped
  uint64_t ignored = 0;        ///< valid, but unknown, out of sequence or without their argument
  uint64_t sessions = 0;       ///< OPENs that began one
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

  /// The output since the last call. At most a few kilobytes are kept.
  std::vector<uint8_t> TakeOutput();
  /// When the next SIP is due, kNever without a session.
  int64_t NextSipTime() const { return open() ? next_sip_ns_ : kNever; }

  int64_t now_ns() const { return now_ns_; }
  bool open() const { return session_ == Session::kOpen; }
  bool motors_enabled() const { return motors_enabled_; }
  const PioneerDrive& drive() const { return drive_; }
  const MotionLimits& limits() const { return limits_; }
  PioneerCounters counters() const;

 private:
  enum class Session { kSynchronising, kSynchronised, kOpen };

  void Synchronise(const Packet& packet);
  void Obey(const Packet& packet);
  bool ObeyArgument(uint8_t command, int argument);
  bool ObeySetting(uint8_t command, int argument);
  void Open();
  void Close();
  void TickMotion();
  void SendSip();
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
  Session session_ = Session::kSynchronising;
  uint8_t next_sync_ = 0;  // SYNC0, 1 or 2
  bool motors_enabled_ = false;
  bool sonar_enabled_ = false;
  bool silent_ = false;
  bool by_wheels_ = false;  // the target is VEL2's
  Motion target_;
  MotionLimits limits_;
};

}  // namespace pheromone::sim
