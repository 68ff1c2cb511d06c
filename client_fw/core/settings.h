// The settings that an operator may change over the radio (COMMAND 8 and 9) and a board keeps in
// EEPROM.
//
//   if (WriteSetting(kSpeedSetting, 350, &settings)) ...   // false: no such id, or out of range
//   if (ReadSetting(kSpeedSetting, settings, &value)) ...
//
// Every value is a whole number from 0 to 32 767, so that EVENT 8 can report it. A board stores the
// bytes of Settings unchanged, with a checksum of its own; another size means another firmware.
//
// Pure functions; any thread.
#pragma once

#include <stdint.h>

#include "client_fw/core/steering.h"

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

/// The ids of COMMAND 8 and 9.
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
};

/// In the order of the ids: first those of one byte, then those of two.
struct Settings {
  uint8_t type = 1;  ///< pheromone followed, and deposited if lay_trail; 1-15
  Law law = Law::kCareful;
  bool lay_trail = false;  ///< TRACE instead of SENSE
  LostTrail lost_trail = LostTrail::kSearch;
  uint8_t gain_8ths = kUnitGain;  ///< of all laws but fuzzy: steering.h; 0-29
  uint8_t faintest = 1;           ///< smallest intensity that counts as sensed, 1/4096 unit; 0-255
  int16_t speed_mm_s = 200;       ///< K of the law, 0 to kMaxSpeedMmS
  uint16_t period_ms = 200;       ///< between exchanges, at most 30 000; 0 or 1: no pause
  /// Longest drive without an answer, 100-30 000; over period_ms. The rest of half a second is for
  /// the loop, the line and the drive.
  uint16_t fail_safe_ms = 480;
  /// The trail is lost after so long; 0: never. At 100 mm/s a Pioneer turns by half a turn.
  uint16_t lost_after_ms = 5000;
  /// Length of a count in 1/10 000 mm, of a Pioneer whose model does not count whole millimetres,
  /// 100-30 000. Effective from the next start.
  uint16_t drive_scale = 4850;
};

/// False, without a change, if there is no such setting or `value` is out of range.
bool WriteSetting(uint8_t id, uint32_t value, Settings* settings);

/// False if there is no such setting.
bool ReadSetting(uint8_t id, const Settings& settings, int16_t* value);

}  // namespace client
}  // namespace pheromone
