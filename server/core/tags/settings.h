// The part of the configuration that the tags depend on, in integers.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/base/fields.h"
#include "server/base/result.h"
#include "server/core/tags/tag.h"
#include "server/core/tags/tag_map.h"

namespace pheromone::tags {

constexpr size_t kMaxTags = 20'000;

struct TagSettings {
  std::string name;
  int64_t x_um = 0;
  int64_t y_um = 0;
  int64_t range_um = 1'000'000;  ///< how far it is read and written
  uint8_t slots = kDefaultSlots;
  bool operator==(const TagSettings&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("name", it.name);
    visit("x_um", it.x_um, Within(-kMaxPositionUm, kMaxPositionUm));
    visit("y_um", it.y_um, Within(-kMaxPositionUm, kMaxPositionUm));
    visit("range_um", it.range_um, Within(1, kMaxRangeUm));
    visit("slots", it.slots, Within(1, kMaxSlots));
  }
};

struct Settings {
  std::vector<TagSettings> tags{};
  std::vector<std::string> privileged{};  ///< unique IDs of authors whose blocks are never dropped
  bool operator==(const Settings&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("tags", it.tags);
    visit("privileged", it.privileged);
  }
};

/// Beyond the bounds of single values. Errors: too many tags, two of one name, an empty name.
Status CheckSettings(const Settings& settings);

}  // namespace pheromone::tags
