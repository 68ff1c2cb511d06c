#include "client_fw/verify/cleaning_stamps.h"

#include <algorithm>
#include <bit>
#include <cstddef>

namespace pheromone::verify {

ZoneSets ComparedZones(const ZoneSets& in_sight) {
  ZoneSets compared{};
  for (const uint64_t seen : in_sight) {
    for (size_t zone = 0; zone < kMaxZones; ++zone) {
      compared[zone] |= (seen >> zone & 1) != 0 ? seen & ~(uint64_t{1} << zone) : 0;
    }
  }
  return compared;
}

void RankBySight(const ZoneSets& compared, uint64_t zones, bool is_newest_now, StampRanks* ranks) {
  StampRanks& rank_of = *ranks;
  const auto each = [](uint64_t set, const auto& visit) {
    for (; set != 0; set &= set - 1) {
      visit(static_cast<size_t>(std::countr_zero(set)));
    }
  };
  std::array<uint64_t, kMaxZones> of_rank{};
  uint8_t newest = 0;
  each(zones, [&](size_t zone) {
    of_rank[rank_of[zone]] |= uint64_t{1} << zone;
    newest = std::max(newest, rank_of[zone]);
  });
  std::array<uint64_t, kMaxZones> ranked{};  // those of each new rank
  uint8_t count = 0;
  for (size_t rank = 0; rank <= newest; ++rank) {
    const uint64_t equal = of_rank[rank];
    if (rank == newest && is_newest_now) {
      each(equal, [&](size_t zone) { rank_of[zone] = count; });
      break;
    }
    each(equal, [&](size_t zone) {
      uint8_t least = count;
      while (least > 0 && (compared[zone] & ranked[least - 1u]) == 0) {
        --least;
      }
      rank_of[zone] = least;
    });
    // Equals that are compared, some of them by way of others, stay equal.
    for (bool is_changed = !std::has_single_bit(equal); is_changed;) {
      is_changed = false;
      each(equal, [&](size_t zone) {
        each(compared[zone] & equal, [&](size_t other) {
          if (rank_of[other] > rank_of[zone]) {
            rank_of[zone] = rank_of[other];
            is_changed = true;
          }
        });
      });
    }
    each(equal, [&](size_t zone) {
      ranked[rank_of[zone]] |= uint64_t{1} << zone;
      count = std::max(count, static_cast<uint8_t>(rank_of[zone] + 1));
    });
  }
}

}  // namespace pheromone::verify
