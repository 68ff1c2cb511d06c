#include "client_fw/verify/cleaning_key.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <compare>
#include <utility>

namespace pheromone::verify {
namespace {

constexpr size_t kPhaseBits = 3;
constexpr size_t kFlagBits = 2;  // stale, sign
constexpr size_t kClockBits = 16;
constexpr size_t kAskBits = 4;

uint8_t BitsFor(uint64_t most) {
  return static_cast<uint8_t>(std::bit_width(most));
}

// Rates count where soil does; all else that a search is about is the same everywhere.
std::vector<ZoneMap> MapsOf(const CleaningLimits& limits, const KeyParts& parts) {
  if (!parts.symmetric) {
    return {LeaveAsItIs()};
  }
  return FloorSymmetries(limits.Floor(), parts.soil ? limits.rates_percent : std::vector<int>(),
                         limits.closed);
}

}  // namespace

CleaningKeys::CleaningKeys(const CleaningWorld& world, const KeyParts& parts, int soil_percent)
    : zones_(world.zones()),
      robots_(static_cast<size_t>(world.limits().robots)),
      parts_(parts),
      has_asks_(world.limits().asks > 0),
      maps_(MapsOf(world.limits(), parts)),
      zone_bits_(BitsFor(zones_ - 1)) {
  const CleaningLimits& limits = world.limits();
  timer_bits_ = BitsFor(static_cast<uint64_t>(
      std::max({limits.clean_max, limits.move_max, limits.wait, limits.lease})));
  for (size_t robot = 0; robot < robots_; ++robot) {
    robot_[robot] = Reserve(kPhaseBits + kFlagBits + zone_bits_ + timer_bits_);
  }
  newest_ = Reserve(1);
  if (parts_.soil) {
    tick_ = Reserve(BitsFor(static_cast<uint64_t>(limits.soiling_step)));
  }
  if (parts_.clock) {
    clock_ = Reserve(kClockBits);
  }
  if (has_asks_) {
    asks_ = Reserve(kAskBits);
    wanted_ = Reserve(zones_);
  }
  for (size_t zone = 0; zone < zones_; ++zone) {
    rank_[zone] = Reserve(BitsFor(world.limits().passers_by ? zones_ : zones_ - 1));
  }
  FindLevels(world, soil_percent);
  assert(words_ <= kMaxWords);
}

CleaningKeys::Place CleaningKeys::Reserve(size_t wanted) {
  const size_t bits = std::max<size_t>(wanted, 1);
  if (used_ + bits > 64) {
    ++words_;
    used_ = 0;
  }
  const Place place{static_cast<uint8_t>(words_ - 1), used_, static_cast<uint8_t>(bits)};
  used_ = static_cast<uint8_t>(used_ + bits);
  return place;
}

void CleaningKeys::FindLevels(const CleaningWorld& world, int soil_percent) {
  for (size_t zone = 0; zone < zones_; ++zone) {
    if ((parts_.leveled >> zone & 1) == 0) {
      continue;
    }
    std::vector<uint8_t>& levels = levels_[zone];
    const auto add = [&](uint8_t level) {
      while (std::find(levels.begin(), levels.end(), level) == levels.end()) {
        levels.push_back(level);
        level = world.Soiled(zone, level);
      }
    };
    add(0);
    if (!world.IsClosed(zone)) {
      add(static_cast<uint8_t>(soil_percent));
    }
    for (size_t code = 0; code < levels.size(); ++code) {
      level_code_[zone][levels[code]] = static_cast<uint8_t>(code);
    }
    level_[zone] = Reserve(BitsFor(levels.size() - 1));
  }
}

void CleaningKeys::PackAs(const CleaningState& state, const ZoneMap& map, Key* key) const {
  std::fill_n(key->begin(), words_, 0);
  for (size_t zone = 0; zone < zones_; ++zone) {
    rank_[map[zone]].Put(state.rank[zone], key);
    if (parts_.leveled != 0 && (parts_.leveled >> map[zone] & 1) != 0) {
      level_[map[zone]].Put(level_code_[map[zone]][state.level[zone]], key);
    }
  }
  std::array<uint64_t, kMaxCleaners> robots{};
  for (size_t robot = 0; robot < robots_; ++robot) {
    const Cleaner& it = state.cleaners[robot];
    // A robot that is gone is nowhere.
    const uint64_t zone = it.phase == CleanerPhase::kGone ? 0 : map[it.zone];
    robots[robot] = static_cast<uint64_t>(it.phase) | uint64_t{it.is_stale} << kPhaseBits |
                    uint64_t{it.has_sign} << (kPhaseBits + 1) | zone << (kPhaseBits + kFlagBits) |
                    uint64_t{it.timer} << (kPhaseBits + kFlagBits + zone_bits_);
    for (size_t i = robot; i > 0 && robots[i - 1] < robots[i]; --i) {
      std::swap(robots[i - 1], robots[i]);
    }
  }
  for (size_t robot = 0; robot < robots_; ++robot) {
    robot_[robot].Put(robots[robot], key);
  }
  newest_.Put(state.is_newest_now ? 1 : 0, key);
  if (parts_.soil) {
    tick_.Put(state.tick, key);
  }
  if (parts_.clock) {
    clock_.Put(state.clock, key);
  }
  if (has_asks_) {
    asks_.Put(state.asks_left, key);
    for (size_t zone = 0; zone < zones_; ++zone) {
      wanted_.Put((state.wanted >> zone & 1) << map[zone], key);
    }
  }
}

CleaningKeys::Packed CleaningKeys::Pack(const CleaningState& state) const {
  Packed least;
  least.equal = 1;
  PackAs(state, maps_[0], &least.key);
  const auto end = static_cast<ptrdiff_t>(words_);
  Key key;
  for (uint8_t way = 1; way < static_cast<uint8_t>(maps_.size()); ++way) {
    PackAs(state, maps_[way], &key);
    const auto order = std::lexicographical_compare_three_way(
        key.begin(), key.begin() + end, least.key.begin(), least.key.begin() + end);
    if (order < 0) {
      std::copy_n(key.begin(), words_, least.key.begin());
      least.way = way;
      least.equal = 1;
    } else if (order == 0) {
      ++least.equal;
    }
  }
  return least;
}

CleaningState CleaningKeys::Unpack(const uint64_t* key) const {
  CleaningState state;
  for (size_t zone = 0; zone < zones_; ++zone) {
    state.rank[zone] = static_cast<uint8_t>(rank_[zone].Get(key));
    if ((parts_.leveled >> zone & 1) != 0) {
      state.level[zone] = levels_[zone][level_[zone].Get(key)];
    }
  }
  for (size_t robot = 0; robot < robots_; ++robot) {
    const uint64_t bits = robot_[robot].Get(key);
    const uint64_t zone = bits >> (kPhaseBits + kFlagBits) & ((uint64_t{1} << zone_bits_) - 1);
    state.cleaners[robot] = {
        .phase = PhaseOf(bits),
        .zone = static_cast<uint8_t>(zone),
        .timer = static_cast<uint8_t>(bits >> (kPhaseBits + kFlagBits + zone_bits_)),
        .is_stale = (bits >> kPhaseBits & 1) != 0,
        .has_sign = (bits >> (kPhaseBits + 1) & 1) != 0};
  }
  state.is_newest_now = newest_.Get(key) != 0;
  if (parts_.soil) {
    state.tick = static_cast<uint8_t>(tick_.Get(key));
  }
  if (parts_.clock) {
    state.clock = static_cast<uint16_t>(clock_.Get(key));
  }
  if (has_asks_) {
    state.asks_left = static_cast<uint8_t>(asks_.Get(key));
    state.wanted = wanted_.Get(key);
  }
  return state;
}

uint64_t CleaningKeys::Cleaned(const uint64_t* key) const {
  uint64_t zones = 0;
  for (size_t robot = 0; robot < robots_; ++robot) {
    const uint64_t bits = robot_[robot].Get(key);
    if (PhaseOf(bits) == CleanerPhase::kCleaning) {
      zones |=
          uint64_t{1} << (bits >> (kPhaseBits + kFlagBits) & ((uint64_t{1} << zone_bits_) - 1));
    }
  }
  return zones;
}

}  // namespace pheromone::verify
