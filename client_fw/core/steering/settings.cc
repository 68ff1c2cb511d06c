#include "client_fw/core/steering/settings.h"

#include <stddef.h>

#include "client_fw/core/base/outlined.h"
#include "protocol/byte_order.h"

namespace pheromone {
namespace client {
namespace {

// Where a setting is, with kWide if it has two bytes, and what it may be.
struct Row {
  uint8_t at;
  uint8_t least;
  uint16_t most;
};
constexpr uint8_t kWide = 0x80;
static_assert(sizeof(Settings) <= kWide, "each offset leaves a bit for kWide");

#define PHEROMONE_SETTING(field, least, most) \
  { offsetof(Settings, field) | (sizeof(Settings::field) == 2 ? kWide : 0), least, most }
const Row kRows[kEndOfSettings - 1] = {
    PHEROMONE_SETTING(type, 1, 15),
    PHEROMONE_SETTING(law, 0, 3),
    PHEROMONE_SETTING(lay_trail, 0, 1),
    PHEROMONE_SETTING(lost_trail, 0, 3),
    PHEROMONE_SETTING(gain_8ths, 0, kMaxGain),
    PHEROMONE_SETTING(faintest, 0, 255),
    PHEROMONE_SETTING(speed_mm_s, 0, 1000),
    PHEROMONE_SETTING(period_ms, 0, 2000),
    PHEROMONE_SETTING(fail_safe_ms, 100, 2000),
    PHEROMONE_SETTING(lost_after_ms, 0, 30000),
    PHEROMONE_SETTING(drive_scale, 100, 30000),
    PHEROMONE_SETTING(start_released, 0, 1),
    PHEROMONE_SETTING(bumpers, 0, 1),
    PHEROMONE_SETTING(sonar, 0, 1),
    PHEROMONE_SETTING(low_battery_100mv, 0, 255),
    PHEROMONE_SETTING(ptt_lead_ms, 0, 500),
    PHEROMONE_SETTING(ptt_tail_ms, 0, 500),
};
#undef PHEROMONE_SETTING

PHEROMONE_OUTLINED bool InRange(uint8_t id, uint16_t value) {
  const uint8_t index = static_cast<uint8_t>(id - 1);
  return index < kEndOfSettings - 1 && value >= kRows[index].least && value <= kRows[index].most;
}

uint16_t Get(uint8_t id, const Settings& from) {
  const Row& row = kRows[id - 1];
  const uint8_t* const at = reinterpret_cast<const uint8_t*>(&from) + (row.at & (kWide - 1));
  return row.at >= kWide ? *reinterpret_cast<const uint16_t*>(at) : *at;
}

// `value` is in range.
void Put(uint8_t id, uint16_t value, Settings* to) {
  const Row& row = kRows[id - 1];
  uint8_t* const at = reinterpret_cast<uint8_t*>(to) + (row.at & (kWide - 1));
  if (row.at >= kWide) {
    *reinterpret_cast<uint16_t*>(at) = value;
  } else {
    *at = static_cast<uint8_t>(value & 0xFFu);
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
