#include "client_fw/core/steering/settings.h"

#include "protocol/byte_order.h"

namespace pheromone {
namespace client {
namespace {

struct Range {
  uint8_t least;
  uint16_t most;
};

const Range kRanges[kEndOfSettings - 1] = {
    {1, 15},        // type
    {0, 3},         // law
    {0, 1},         // lay_trail
    {0, 3},         // lost_trail
    {0, kMaxGain},  // gain_8ths
    {0, 255},       // faintest
    {0, 1000},      // speed_mm_s
    {0, 2000},      // period_ms
    {100, 2000},    // fail_safe_ms
    {0, 30000},     // lost_after_ms
    {100, 30000},   // drive_scale
    {0, 1},         // start_released
    {0, 1},         // bumpers
    {0, 1},         // sonar
    {0, 255},       // low_battery_100mv
};

bool InRange(uint8_t id, uint16_t value) {
  const uint8_t index = static_cast<uint8_t>(id - 1);
  return index < kEndOfSettings - 1 && value >= kRanges[index].least &&
         value <= kRanges[index].most;
}

uint16_t Get(uint8_t id, const Settings& from) {
  switch (id) {
    case kTypeSetting:
      return from.type;
    case kLawSetting:
      return static_cast<uint8_t>(from.law);
    case kLayTrailSetting:
      return from.lay_trail;
    case kLostTrailSetting:
      return static_cast<uint8_t>(from.lost_trail);
    case kGainSetting:
      return from.gain_8ths;
    case kFaintestSetting:
      return from.faintest;
    case kSpeedSetting:
      return static_cast<uint16_t>(from.speed_mm_s);
    case kPeriodSetting:
      return from.period_ms;
    case kFailSafeSetting:
      return from.fail_safe_ms;
    case kLostAfterSetting:
      return from.lost_after_ms;
    case kDriveScaleSetting:
      return from.drive_scale;
    case kStartReleasedSetting:
      return from.start_released;
    case kBumpersSetting:
      return from.bumpers;
    case kSonarSetting:
      return from.sonar;
    default:
      return from.low_battery_100mv;
  }
}

// `value` is in range.
void Put(uint8_t id, uint16_t value, Settings* to) {
  const uint8_t byte = static_cast<uint8_t>(value & 0xFFu);
  switch (id) {
    case kTypeSetting:
      to->type = byte;
      break;
    case kLawSetting:
      to->law = static_cast<Law>(byte);
      break;
    case kLayTrailSetting:
      to->lay_trail = byte != 0;
      break;
    case kLostTrailSetting:
      to->lost_trail = static_cast<LostTrail>(byte);
      break;
    case kGainSetting:
      to->gain_8ths = byte;
      break;
    case kFaintestSetting:
      to->faintest = byte;
      break;
    case kSpeedSetting:
      to->speed_mm_s = static_cast<int16_t>(value);
      break;
    case kPeriodSetting:
      to->period_ms = value;
      break;
    case kFailSafeSetting:
      to->fail_safe_ms = value;
      break;
    case kLostAfterSetting:
      to->lost_after_ms = value;
      break;
    case kDriveScaleSetting:
      to->drive_scale = value;
      break;
    case kStartReleasedSetting:
      to->start_released = byte != 0;
      break;
    case kBumpersSetting:
      to->bumpers = byte != 0;
      break;
    case kSonarSetting:
      to->sonar = byte != 0;
      break;
    default:
      to->low_battery_100mv = byte;
  }
}

bool FitTogether(const Settings& settings) {
  const uint32_t blind_um = static_cast<uint32_t>(settings.speed_mm_s) * settings.fail_safe_ms;
  return settings.period_ms < settings.fail_safe_ms && blind_um <= 1000u * uint32_t{kMaxBlindMm};
}

}  // namespace

bool WriteSetting(uint8_t id, uint32_t value, Settings* settings) {
  const uint16_t word = static_cast<uint16_t>(value & 0xFFFFu);
  if (word != value || !InRange(id, word)) {
    return false;
  }
  const uint16_t before = Get(id, *settings);
  Put(id, word, settings);
  if (!FitTogether(*settings)) {
    Put(id, before, settings);
    return false;
  }
  return true;
}

bool ReadSetting(uint8_t id, const Settings& settings, int16_t* value) {
  if (id == 0 || id >= kEndOfSettings) {
    return false;
  }
  *value = static_cast<int16_t>(Get(id, settings));
  return true;
}

void PackSettings(const Settings& settings, uint8_t* to) {
  for (uint8_t id = 1; id < kEndOfSettings; ++id, to += 2) {
    protocol::PutU16(to, Get(id, settings));
  }
}

bool UnpackSettings(const uint8_t* from, Settings* settings) {
  Settings found = *settings;
  for (uint8_t id = 1; id < kEndOfSettings; ++id, from += 2) {
    const uint16_t value = protocol::GetU16(from);
    if (!InRange(id, value)) {
      return false;
    }
    Put(id, value, &found);
  }
  if (!FitTogether(found)) {
    return false;
  }
  *settings = found;
  return true;
}

}  // namespace client
}  // namespace pheromone
