// A CleaningState in two words, or in three with its levels of soil, so that states that differ
// only in what does not matter are equal: robots are interchangeable and, where nothing depends on
// the place, so are the directions on the grid.
//
//   CleaningKeys<2> keys(world, /*symmetric=*/true);
//   const auto packed = keys.Pack(state);   // packed.key, and how the grid was turned
//   const CleaningState same = keys.Unpack(packed.key);
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "client_fw/verify/cleaning_world.h"

namespace pheromone::verify {

/// Where each zone goes.
using ZoneMap = std::array<uint8_t, kMaxZones>;

/// All ways to lay the grid onto itself, the first of which leaves it as it is.
inline std::vector<ZoneMap> GridSymmetries(int columns, int rows) {
  std::vector<ZoneMap> maps;
  for (int way = 0; way < (columns == rows ? 8 : 4); ++way) {
    ZoneMap map{};
    const auto zone = [rows](int column, int row) {
      return static_cast<uint8_t>(column * rows + row);
    };
    for (int column = 0; column < columns; ++column) {
      for (int row = 0; row < rows; ++row) {
        int c = (way & 1) != 0 ? columns - 1 - column : column;
        int r = (way & 2) != 0 ? rows - 1 - row : row;
        if ((way & 4) != 0) {
          std::swap(c, r);
        }
        map[zone(column, row)] = zone(c, r);
      }
    }
    if (std::find(maps.begin(), maps.end(), map) == maps.end()) {
      maps.push_back(map);
    }
  }
  return maps;
}

template <size_t kWords>
class CleaningKeys {
 public:
  using Key = std::array<uint64_t, kWords>;

  struct Packed {
    Key key;
    uint8_t way = 0;    ///< the symmetry by which the state became that of `key`
    uint8_t equal = 0;  ///< how many symmetries do
  };

  CleaningKeys(const CleaningWorld& world, bool symmetric, bool has_clock = false)
      : maps_(GridSymmetries(world.limits().columns, world.limits().rows)),
        zones_(world.zones()),
        robots_(static_cast<size_t>(world.limits().robots)),
        has_clock_(has_clock),
        has_asks_(world.limits().asks > 0) {
    if (!symmetric) {
      maps_.resize(1);
    }
    assert(kWords == 2 || !has_asks_);
    assert(kWords == 2 || (zones_ <= kLeveledZones && robots_ < kMaxCleaners && !symmetric));
  }

  const std::vector<ZoneMap>& maps() const { return maps_; }

  Packed Pack(const CleaningState& state) const {
    Packed least{PackAs(state, maps_[0]), 0, 1};
    for (uint8_t way = 1; way < static_cast<uint8_t>(maps_.size()); ++way) {
      const Key key = PackAs(state, maps_[way]);
      if (key < least.key) {
        least = {key, way, 1};
      } else if (key == least.key) {
        ++least.equal;
      }
    }
    return least;
  }

  CleaningState Unpack(const Key& key) const {
    CleaningState state;
    for (size_t zone = 0; zone < zones_; ++zone) {
      state.rank[zone] = key[0] >> (zone * 4) & 15;
      if constexpr (kWords == 3) {
        state.level[zone] = key[2] >> (zone * 5) & 31;
      }
    }
    for (size_t robot = 0; robot < robots_; ++robot) {
      const uint64_t bits = key[1] >> (robot * 16);
      state.cleaners[robot] = {.phase = static_cast<CleanerPhase>(bits >> 4 & 7),
                               .zone = static_cast<uint8_t>(bits & 15),
                               .timer = static_cast<uint8_t>(bits >> 7 & 63),
                               .is_stale = (bits >> 13 & 1) != 0,
                               .has_sign = (bits >> 14 & 1) != 0};
    }
    state.is_newest_now = (key[1] >> 15 & 1) != 0;
    if constexpr (kWords == 2) {
      if (has_asks_) {
        state.wanted = static_cast<uint16_t>(key[1] >> 48 & ((1u << kAskedZones) - 1));
        state.asks_left = static_cast<uint8_t>(key[1] >> 60 & 15);
      }
    }
    if constexpr (kWords == 3) {
      state.tick = key[2] >> 60 & 15;
      state.clock = static_cast<uint16_t>(key[1] >> 48);
    }
    return state;
  }

  /// The zones in which robots are cleaning, as bits.
  uint32_t Cleaned(const Key& key) const {
    uint32_t zones = 0;
    for (size_t robot = 0; robot < robots_; ++robot) {
      const uint64_t bits = key[1] >> (robot * 16);
      if ((bits >> 4 & 7) == static_cast<uint64_t>(CleanerPhase::kCleaning)) {
        zones |= 1u << (bits & 15);
      }
    }
    return zones;
  }

 private:
  static constexpr size_t kLeveledZones = 12;

  Key PackAs(const CleaningState& state, const ZoneMap& map) const {
    Key key{};
    for (size_t zone = 0; zone < zones_; ++zone) {
      key[0] |= uint64_t{state.rank[zone]} << (map[zone] * 4);
      if constexpr (kWords == 3) {
        key[2] |= uint64_t{state.level[zone]} << (map[zone] * 5);
      }
    }
    std::array<uint64_t, kMaxCleaners> robots{};
    for (size_t robot = 0; robot < robots_; ++robot) {
      const Cleaner& it = state.cleaners[robot];
      // A robot that is gone is nowhere.
      const uint64_t zone = it.phase == CleanerPhase::kGone ? 0 : map[it.zone];
      robots[robot] = zone | uint64_t{static_cast<uint8_t>(it.phase)} << 4 |
                      uint64_t{it.timer} << 7 | uint64_t{it.is_stale} << 13 |
                      uint64_t{it.has_sign} << 14;
      for (size_t i = robot; i > 0 && robots[i - 1] < robots[i]; --i) {
        std::swap(robots[i - 1], robots[i]);
      }
    }
    for (size_t robot = 0; robot < robots_; ++robot) {
      key[1] |= robots[robot] << (robot * 16);
    }
    key[1] |= uint64_t{state.is_newest_now} << 15;
    if (has_asks_) {
      key[1] |= uint64_t{state.asks_left} << 60;
      for (size_t zone = 0; zone < zones_; ++zone) {
        key[1] |= uint64_t{state.wanted >> zone & 1u} << (48 + map[zone]);
      }
    }
    if constexpr (kWords == 3) {
      key[2] |= uint64_t{state.tick} << 60;
      key[1] |= has_clock_ ? uint64_t{state.clock} << 48 : 0;
    }
    return key;
  }

  std::vector<ZoneMap> maps_;
  size_t zones_;
  size_t robots_;
  bool has_clock_;  // else the states at all times are the same
  bool has_asks_;
};

}  // namespace pheromone::verify
