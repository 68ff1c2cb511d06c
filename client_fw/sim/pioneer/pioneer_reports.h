// A simulated Pioneer's reports, as packets ready to send: the standard server information packet
// (SIP), the packets of encoders and of inputs and outputs, CONFIG and the names in answer to
// SYNC2.
//
//   SipContent sip;
//   sip.x_mm = 1000;
//   Send(MakeSip(*FindPioneerModel("p3dx"), SipForm::kFull, 16, sip));
//
// Quantities of the structs are in mm, radians and seconds; MakeSip turns them into the model's
// units, to the nearest. X and Y wrap at 15 or 16 bits. Headings are signed, from -2048 to 2047 of
// 4096 a turn, as real controllers and MobileSim send them: a client that adds up their differences
// with 0.00153 for 2 pi / 4096, as ARIA does, is then wrong by a degree behind its back, not
// whenever it looks ahead. Speeds saturate.
//
// Sources: parameter files and packet readers of ARIA and Player's P2OS driver; ENCODERpac, IOpac
// and the flags: Pioneer 3 operations manual, "ARCOS"; CONFIG: the table of the AROS manual,
// continued as ARIA reads it. Pure functions; any thread.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client_fw/sim/pioneer/pioneer_drive.h"
#include "client_fw/sim/pioneer/pioneer_models.h"

namespace pheromone::sim {

/// Newer firmware sends all fields, older firmware ends early.
enum class SipForm {
  kFull,   ///< to the charge in percent: 41 bytes and 3 a sonar reading
  kShort,  ///< to the sonar readings: 25 bytes and 3 a sonar reading
};

/// As many as fit into a full SIP of 200 bytes.
constexpr size_t kMaxSonarReadings = 53;

struct SonarReading {
  int number = 0;
  int range_mm = 0;
};

/// Segments of a ring of bumpers that are pressed: bit 0 is the first one. In front they count from
/// left to right, behind from right to left: clockwise, seen from above, as ARIA understands them.
struct PressedBumpers {
  uint8_t front = 0;
  uint8_t rear = 0;

  bool operator==(const PressedBumpers&) const = default;
};

struct SipContent {
  bool moving = false;
  double x_mm = 0;
  double y_mm = 0;
  double heading_rad = 0;
  double heading_setpoint_rad = 0;
  double left_mm_s = 0;
  double right_mm_s = 0;
  double turn_rad_s = 0;
  double battery_v = 0;
  bool left_stalled = false;
  bool right_stalled = false;
  PressedBumpers bumpers;  ///< at most 7 segments each
  bool motors_enabled = false;
  bool sonar_enabled = false;
  bool stop_pressed = false;
  std::vector<SonarReading> sonar;  ///< at most kMaxSonarReadings
};

/// `position_bits` is 15 or 16.
std::vector<uint8_t> MakeSip(const PioneerModel& model, SipForm form, int position_bits,
                             const SipContent& content);

/// The encoders' counts: 32 bits each, which wrap.
std::vector<uint8_t> MakeEncoderPacket(const PioneerModel& model, double left_mm, double right_mm);

/// Four bytes of digital inputs (the general ones, the bumpers in front and behind, infrared
/// sensors), one of outputs, and nine analog values of 10 bits, the last of which is the battery's
/// (assumed: 1023 for 20 V). Nothing is connected but bumpers and battery. A bumper's input is 0
/// while it is pressed; it has the bit that it has in a SIP.
std::vector<uint8_t> MakeIoPacket(const PressedBumpers& bumpers, double battery_v);

/// The variable fields of the CONFIG packet.
struct ConfigContent {
  std::string name;
  int sip_period_ms = 100;
  int watchdog_ms = 2000;
  int bumpers = 0;      ///< segments of each ring
  MotionLimits limits;  ///< at present
};

std::vector<uint8_t> MakeConfigPacket(const PioneerModel& model, const ConfigContent& content);

/// Name, class and subclass in answer to SYNC2. Of a name, the first 20 characters.
std::vector<uint8_t> MakeNamesPacket(const PioneerModel& model, const std::string& name);

}  // namespace pheromone::sim
