#include "client_fw/core/settings.h"

#include <stddef.h>

namespace pheromone {
namespace client {
namespace {

constexpr uint8_t kLastByte = kFaintestSetting;
constexpr uint8_t kLast = kDriveScaleSetting;

static_assert(offsetof(Settings, law) == kLawSetting - 1 &&
                  offsetof(Settings, lay_trail) == kLayTrailSetting - 1 &&
                  offsetof(Settings, lost_trail) == kLostTrailSetting - 1 &&
                  offsetof(Settings, gain_8ths) == kGainSetting - 1 &&
                  offsetof(Settings, faintest) == kFaintestSetting - 1,
              "bytes stand in the order of their ids");
static_assert(offsetof(Settings, speed_mm_s) == kLastByte &&
                  offsetof(Settings, period_ms) == kLastByte + 2 &&
                  offsetof(Settings, fail_safe_ms) == kLastByte + 4 &&
                  offsetof(Settings, lost_after_ms) == kLastByte + 6 &&
                  offsetof(Settings, drive_scale) == kLastByte + 8,
              "and so do words");

struct Range {
  uint8_t least;
  uint16_t most;
};

const Range kRanges[kLast] = {
    {1, 15},           {0, 3},     {0, 1},       {0, 3},     {0, kMaxGain}, {0, 255},
    {0, kMaxSpeedMmS}, {0, 30000}, {100, 30000}, {0, 30000}, {100, 30000}};

// The position of the setting; `id` must exist.
uint8_t OffsetOf(uint8_t id) {
  return static_cast<uint8_t>(id <= kLastByte ? id - 1 : 2 * id - kLastByte - 2);
}

}  // namespace

bool WriteSetting(uint8_t id, uint32_t value, Settings* settings) {
  const uint8_t index = static_cast<uint8_t>(id - 1);
  if (index >= kLast || value < kRanges[index].least || value > kRanges[index].most) {
    return false;
  }
  uint8_t* const at = reinterpret_cast<uint8_t*>(settings) + OffsetOf(id);
  if (id <= kLastByte) {
    *at = static_cast<uint8_t>(value & 0xFFu);
  } else {
    *reinterpret_cast<uint16_t*>(at) = static_cast<uint16_t>(value & 0xFFFFu);
  }
  return true;
}

bool ReadSetting(uint8_t id, const Settings& settings, int16_t* value) {
  if (static_cast<uint8_t>(id - 1) >= kLast) {
    return false;
  }
  const uint8_t* const at = reinterpret_cast<const uint8_t*>(&settings) + OffsetOf(id);
  *value = id <= kLastByte ? *at : *reinterpret_cast<const int16_t*>(at);
  return true;
}

}  // namespace client
}  // namespace pheromone
