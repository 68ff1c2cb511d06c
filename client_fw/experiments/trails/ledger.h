// What happened on the two-trail bench, from what robots have told on tags and were answered
// (net_tally.h): choices, deposits, round trips, and where each robot is.
//
//   TrailsLedger ledger(/*robots=*/4);
//   ledger.Add(told);
//   ledger.trips().size();
//
// Robots are counted from 0: CLIENT_ID - 1. Pure; one thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "client_fw/experiments/trails/net_tally.h"

namespace pheromone::swarm {

enum class BenchTrail : uint8_t { kA, kB };
constexpr size_t kTrails = 2;

/// A round trip: from the choice to the deposit, and home.
struct TrailsTrip {
  int robot = 0;
  BenchTrail trail = BenchTrail::kA;
  int64_t chosen_ms = 0;
  int64_t stored_ms = 0;
  int64_t home_ms = 0;  ///< left the area of P; -1: not yet
  uint16_t amount = 0;  ///< deposited
  bool operator==(const TrailsTrip&) const = default;
};

struct TrailsChoice {
  int64_t time_ms = 0;
  int robot = 0;
  BenchTrail trail = BenchTrail::kA;
};

class TrailsLedger {
 public:
  explicit TrailsLedger(int robots) : robots_(static_cast<size_t>(robots)) {}

  void Add(const NetTold& told);

  const std::vector<TrailsChoice>& choices() const { return choices_; }
  /// Deposits, in their order; of a round trip that is completed, home_ms is not -1.
  const std::vector<TrailsTrip>& deposits() const { return deposits_; }
  uint64_t deposited() const { return deposited_; }  ///< energy
  uint64_t taken() const { return taken_; }          ///< energy
  uint64_t trips() const { return trips_; }
  uint64_t refusals() const { return refusals_; }
  uint64_t records() const { return records_; }
  /// How many robots have chosen that trail, and not yet stored it.
  int robots_on(BenchTrail trail) const;

 private:
  struct Robot {
    bool on_trail = false;
    BenchTrail trail = BenchTrail::kA;
    int64_t chosen_ms = 0;
    int64_t deposit = -1;  // of deposits_, until it is home
  };

  std::vector<Robot> robots_;
  std::vector<TrailsChoice> choices_;
  std::vector<TrailsTrip> deposits_;
  uint64_t deposited_ = 0;
  uint64_t taken_ = 0;
  uint64_t trips_ = 0;
  uint64_t refusals_ = 0;
  uint64_t records_ = 0;
};

}  // namespace pheromone::swarm
