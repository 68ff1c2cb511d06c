// The order of time stamps, as far as it can matter.
//
// Robots compare time stamps of zones that they see at the same time, and of others never. So of
// the order of all stamps only that part counts, now and, since a new stamp is newer than all,
// later. Of all orders that agree in it, this is the one with the least ranks.
//
//   const ZoneSets compared = ComparedZones(in_sight);
//   RankBySight(compared, zones, state.is_newest_now, &state.rank);
#pragma once

#include <array>
#include <cstdint>

#include "client_fw/verify/cleaning_limits.h"

namespace pheromone::verify {

/// Of each zone's last time stamp, among all: 0 is the oldest, equals are equal.
using StampRanks = std::array<uint8_t, kMaxZones>;
/// Of each zone, some others, as bits.
using ZoneSets = std::array<uint64_t, kMaxZones>;

/// Those that some robot sees together with it, if a robot in a zone sees `in_sight`.
ZoneSets ComparedZones(const ZoneSets& in_sight);

/// Ranks `zones`, as bits, anew. If the newest stamp is of the present time, those of it keep one
/// rank, as long as more of them may come.
void RankBySight(const ZoneSets& compared, uint64_t zones, bool is_newest_now, StampRanks* ranks);

}  // namespace pheromone::verify
