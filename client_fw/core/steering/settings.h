// The settings that an operator may change over the radio (COMMAND 8 and 9) and a board keeps in
// EEPROM.
//
//   if (WriteSetting(kSpeedSetting, 350, &settings)) ...   // false: refused, nothing has changed
//   if (ReadSetting(kSpeedSetting, settings, &value)) ...
//   PackSettings(settings, bytes);                         // to be stored
//   if (UnpackSettings(bytes, &settings)) ...              // false: refused, nothing has changed
//
// Every value is a whole number from 0 to 32 767, so that EVENT 8 can report it. Stored, a setting
// is two bytes, low byte first, in the order of the ids; another size means another firmware.
//
// What comes over the radio or out of an EEPROM is bounded, each value by its range and together by
// two rules: an exchange is due before the fail-safe time has passed (period_ms < fail_safe_ms),
// and a robot that hears nothing drives at most kMaxBlindMm until then. A program that runs robots
// on a host sets the fields directly, without these bounds.
//
// Pure functions; any thread.
#pragma once

#include <stdint.h>

#include "client_fw/core/steering/steering.h"

namespace pheromone {
namespace client {

/// What to do when nothing is sensed for lost_after_ms: before that, the law drives straight ahead,
/// unless it is kSearch.
enum class LostTrail : uint8_t {
  kStraight,  ///< straight ahead, at full speed: for exploring robots
  kStop,
  kSpiral,  ///< outwards, to the left
  kSearch,  ///< look around on the spot (careful.h) from the first such answer on, then stop
};

/// The ids of COMMAND 8 and 9, without gaps.
enum SettingId : uint8_t {
  kTypeSetting = 1,
  kLawSetting = 2,
  kLayTrailSetting = 3,
  kLostTrailSetting = 4,
  kGainSetting = 5,
  kFaintestSetting = 6,
  kSpeedSetting = 7,
  kPeriodSetting = 8,
  kFailSafeSetting = 9,
  kLostAfterSetting = 10,
  kDriveScaleSetting = 11,
  kStartReleasedSetting = 12,
  kBumpersSetting = 13,
  kSonarSetting = 14,
  kLowBatterySetting = 15,
  kPttLeadSetting = 16,
  kPttTailSetting = 17,
  kEndOfSettings
};

/// What a board begins with: a transmitter that needs a lead is not reached without.
#ifndef PHEROMONE_PTT_LEAD_MS
#define PHEROMONE_PTT_LEAD_MS 0
#endif
#ifndef PHEROMONE_PTT_TAIL_MS
#define PHEROMONE_PTT_TAIL_MS 0
#endif

/// The longest way without an answer: speed_mm_s * fail_safe_ms.
constexpr uint16_t kMaxBlindMm = 1000;

struct Settings {
  uint8_t type = 1;  ///< pheromone followed, and deposited if lay_trail; 1-15
  Law law = Law::kCareful;
  bool lay_trail = false;  ///< TRACE instead of SENSE
  LostTrail lost_trail = LostTrail::kSearch;
  uint8_t gain_8ths = kUnitGain;  ///< of all laws but fuzzy: steering.h; 0-29
  uint8_t faintest = 1;           ///< smallest intensity that counts as sensed, 1/4096 unit; 0-255
  int16_t speed_mm_s = 200;       ///< K of the law; over the radio at most 1000
  uint16_t period_ms = 200;       ///< between exchanges; 0 or 1: no pause
  /// Longest drive without an answer; over the radio 100-2000. The rest of half a second is for the
  /// loop, the line and the drive.
  uint16_t fail_safe_ms = 480;
  /// The trail is lost after so long, at most 30 000; 0: never. At 100 mm/s a Pioneer turns by half
  /// a turn.
  uint16_t lost_after_ms = 5000;
  /// Length of a count in 1/10 000 mm, of a Pioneer whose model does not count whole millimetres,
  /// 100-30 000. Effective from the next start.
  uint16_t drive_scale = 4850;
  /// After a reset the robot drives as soon as it is answered, unless it was halted before. False:
  /// every reset halts it until a resume.
  bool start_released = false;
  bool bumpers = true;  ///< a pressed bumper halts; false: the robot has none, and the bits float
  bool sonar = false;   ///< sonars are on, and what is ahead limits the speed
  uint8_t low_battery_100mv = 115;  ///< below it for some seconds: EVENT 9; 0: never
  /// Of a transmitter keyed by PTT, 0-500: from keying to the first bit, and from the last bit to
  /// unkeying. Effective from the next start.
  uint16_t ptt_lead_ms = PHEROMONE_PTT_LEAD_MS;
  uint16_t ptt_tail_ms = PHEROMONE_PTT_TAIL_MS;
};

/// False, without a change, if there is no such setting, `value` is out of range, or the settings
/// would not fit together.
bool WriteSetting(uint8_t id, uint32_t value, Settings* settings);

/// False if there is no such setting.
bool ReadSetting(uint8_t id, const Settings& settings, int16_t* value);

/// Bytes of stored settings.
constexpr uint8_t kSettingsSize = 2 * (kEndOfSettings - 1);

/// Writes kSettingsSize bytes.
void PackSettings(const Settings& settings, uint8_t* to);

/// False, without a change, if a value is out of range or the settings do not fit together.
bool UnpackSettings(const uint8_t* from, Settings* settings);

}  // namespace client
}  // namespace pheromone
