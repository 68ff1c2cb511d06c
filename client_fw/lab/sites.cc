#include "client_fw/lab/sites.h"

#include <bit>

#include "server/base/hash.h"

namespace pheromone::lab {

Sites::Sites(std::span<const SiteConfig> configs) : least_way_m_(configs.size() * configs.size()) {
  for (const SiteConfig& config : configs) {
    sites_.push_back(config.site);
    supplies_.push_back({config.site.amount, config.refill_ms, config.refill_ms});
  }
}

void Sites::Refill(uint64_t now_ms) {
  for (size_t i = 0; i < sites_.size(); ++i) {
    Supply& supply = supplies_[i];
    while (supply.refill_ms != 0 && supply.next_ms <= now_ms) {
      if (sites_[i].amount < supply.capacity) {
        sites_[i].amount += 1;
      }
      supply.next_ms += supply.refill_ms;
    }
  }
}

void Sites::HandleLoads(uint64_t now_ms, Robots* robots) {
  if (sites_.empty()) {
    return;
  }
  picked_.resize(robots->count);
  for (size_t i = 0; i < robots->count; ++i) {
    const int8_t want = robots->failed[i] != 0 ? int8_t{0} : robots->want_load[i];
    if (want > 0 && robots->load[i] == 0) {
      PickUp(i, now_ms, robots);
    } else if (want < 0 && robots->load[i] != 0) {
      Drop(i, now_ms, robots);
    }
  }
}

void Sites::PickUp(size_t robot, uint64_t now_ms, Robots* robots) {
  const uint8_t at = robots->site[robot];
  if (at == 0 || sites_[at - 1u].is_food == 0 || sites_[at - 1u].amount < 1) {
    return;
  }
  sites_[at - 1u].amount -= 1;
  robots->load[robot] = at;
  picked_[robot] = {now_ms, robots->way_m[robot]};
}

void Sites::Drop(size_t robot, uint64_t now_ms, Robots* robots) {
  const uint8_t at = robots->site[robot];
  const size_t food = robots->load[robot] - 1u;
  robots->load[robot] = 0;
  if (at == 0 || sites_[at - 1u].is_food != 0) {
    ++trips_.lost;
    return;
  }
  const size_t nest = at - 1u;
  sites_[nest].amount += 1;
  ++trips_.delivered;
  trips_.duration_ms += now_ms - picked_[robot].at_ms;
  trips_.way_m += robots->way_m[robot] - picked_[robot].way_m;
  trips_.least_way_m += least_way_m_[food * sites_.size() + nest];
  trips_.quality += sites_[food].quality;
}

void Sites::Move(size_t site, double x_m, double y_m) {
  sites_[site].x_m = x_m;
  sites_[site].y_m = y_m;
}

uint64_t Sites::Hash() const {
  uint64_t sum = Hash64({'T', trips_.delivered, trips_.lost, trips_.duration_ms,
                         std::bit_cast<uint64_t>(trips_.way_m)});
  for (size_t i = 0; i < sites_.size(); ++i) {
    sum += Hash64({'S', i, std::bit_cast<uint64_t>(sites_[i].amount),
                   std::bit_cast<uint64_t>(sites_[i].x_m), std::bit_cast<uint64_t>(sites_[i].y_m)});
  }
  return sum;
}

}  // namespace pheromone::lab
