// A simulated Pioneer's reports, as packets ready to send: the standard server information packet
// (SIP), the CONFIG packet and the names in answer to SYNC2.
//
//   SipContent sip;
//   sip.x_mm = 1000;
//   Send(MakeSip(*FindPioneerModel("p3dx"), SipForm::kFull, 16, sip));
//
// Quantities of the structs are in mm, radians and seconds; MakeSip turns them into the model's
// units, to the nearest. X and Y wrap at 15 or 16 bits, headings at 4096; speeds saturate.
//
// Sources: parameter files and packet readers of ARIA and Player's P2OS driver; for the CONFIG
// packet the table of the AROS manual, version 1.5. Pure functions; any thread.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client_fw/sim/pioneer_drive.h"
#include "client_fw/sim/pioneer_models.h"

namespace pheromone::sim {

/// Newer firmware sends all fields, older firmware ends early.
enum class SipForm {
  kFull,   ///< to the charge in percent: 41 bytes and 3 a sonar reading
  kShort,  ///< to the sonar readings: 25 bytes and 3 a sonar reading
};

/// As many as fit into a full SIP of 200 bytes.
constexpr size_t kMaxSonarReadings = 53;

struct SipContent {
  bool moving = false;
  double x_mm = 0;
  double y_mm = 0;
  double heading_rad = 0;
  double left_mm_s = 0;
  double right_mm_s = 0;
  double turn_rad_s = 0;
  double battery_v = 0;
  bool left_stalled = false;
  bool right_stalled = false;
  bool motors_enabled = false;
  bool sonar_enabled = false;
  std::vector<int> ranges_mm;  ///< of sonar 0, 1, 2 ...; at most kMaxSonarReadings
};

/// `position_bits` is 15 or 16.
std::vector<uint8_t> MakeSip(const PioneerModel& model, SipForm form, int position_bits,
                             const SipContent& content);

/// The variable fields of the CONFIG packet.
struct ConfigContent {
  std::string name;
  int sip_period_ms = 100;
  int watchdog_ms = 2000;
  int sonars = 0;
  MotionLimits limits;  ///< at present
};

std::vector<uint8_t> MakeConfigPacket(const PioneerModel& model, const ConfigContent& content);

/// Name, class and subclass in answer to SYNC2. Of a name, the first 20 characters.
std::vector<uint8_t> MakeNamesPacket(const PioneerModel& model, const std::string& name);

}  // namespace pheromone::sim
