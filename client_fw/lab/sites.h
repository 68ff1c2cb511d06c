// Nests and food, and the loads that robots carry from one to the other.
//
//   Sites sites(configs);
//   sites.Refill(now_ms);
//   sites.HandleLoads(now_ms, &robots);   // want_load of each robot, in their order
//
// A robot that wants to pick up a load where food has one left takes it; one that wants to drop a
// load at a nest has delivered it, and anywhere else the load is lost. One thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "client_fw/lab/behaviour_abi.h"
#include "client_fw/lab/robots.h"

namespace pheromone::lab {

constexpr size_t kMaxSites = 255;

struct SiteConfig {
  PheromoneSite site{};
  uint64_t refill_ms = 0;  ///< food gets one load more so often, up to its first amount; 0: never
};

/// Loads that were picked up and have an end.
struct Trips {
  uint64_t delivered = 0;
  uint64_t lost = 0;         ///< dropped elsewhere
  uint64_t duration_ms = 0;  ///< of those that were delivered, together
  double way_m = 0;          ///< driven with them
  double least_way_m = 0;    ///< the sum of SetLeastWay
  double quality = 0;        ///< the sum of the qualities of their food
};

class Sites {
 public:
  /// At most kMaxSites.
  explicit Sites(std::span<const SiteConfig> configs);

  std::span<const PheromoneSite> all() const { return sites_; }
  const Trips& trips() const { return trips_; }

  void Refill(uint64_t now_ms);
  void HandleLoads(uint64_t now_ms, Robots* robots);

  void Move(size_t site, double x_m, double y_m);
  void SetAmount(size_t site, double amount) { sites_[site].amount = amount; }
  /// The shortest way of a load from food to a nest, for the efficiency of paths.
  void SetLeastWay(size_t food, size_t nest, double metres) {
    least_way_m_[food * sites_.size() + nest] = metres;
  }

  /// Of the trips, and of the amounts and places of the sites.
  uint64_t Hash() const;

 private:
  void PickUp(size_t robot, uint64_t now_ms, Robots* robots);
  void Drop(size_t robot, uint64_t now_ms, Robots* robots);

  struct Supply {
    double capacity = 0;
    uint64_t refill_ms = 0;
    uint64_t next_ms = 0;
  };
  struct Picked {
    uint64_t at_ms = 0;
    double way_m = 0;  // of the robot until then
  };
  std::vector<PheromoneSite> sites_;
  std::vector<Supply> supplies_;
  std::vector<Picked> picked_;  // a robot
  std::vector<double> least_way_m_;
  Trips trips_;
};

}  // namespace pheromone::lab
