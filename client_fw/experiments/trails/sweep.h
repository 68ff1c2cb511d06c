// How often robots lock in on the long trail: timetable runs over evaporation laws, deposit rules,
// exploration, numbers of robots and lifetimes of a deposit.
//
//   std::vector<LockInRow> rows = CountLockIn(bench, LockInCases({}), /*seeds=*/25);
//   LockInToCsv(rows);
//
// A run is locked in if at least nine of ten choices of its last quarter are for one trail. Rows do
// not depend on the number of processors. Pure; any thread.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "client_fw/experiments/trails/timetable.h"

namespace pheromone::swarm {

struct LockInCase {
  petri::EvaporationLaw law = petri::EvaporationLaw::kE1;
  client::DepositRule rule = client::DepositRule::kEqual;
  int explore_percent = 0;
  int robots = 4;
  int lifetime_s = 60;  ///< of one deposit (RateForLifetime)
  int64_t duration_ms = 7'200'000;
};

struct LockInRow {
  LockInCase its;
  int runs = 0;
  int on_a = 0;  ///< locked in on the short trail
  int on_b = 0;  ///< and on the long one
  double trips_per_hour = 0;
  double share_b = 0;  ///< of all choices
  uint64_t exceptions = 0;
};

/// What a deposit is worth under a rule: robots take that much, and burn one unit a second if it is
/// scaled, so that a deposit by the short trail is about twice one by the long trail.
struct DepositScale {
  uint16_t capacity = 40;
  uint16_t burn_per_s = 0;
  double by_a = 40;  ///< deposit on an undisturbed trip
};
DepositScale ScaleOf(client::DepositRule rule);
Timetable TimetableOf(const LockInCase& its);

/// All of: E1 to E4, exponential, counter; equal and scaled deposits; 0 and 5 % exploration; 2, 4
/// and 7 robots; lifetimes of 30, 60, 120 and 300 s.
std::vector<LockInCase> LockInCases();

/// Runs of seed 1 to `seeds` of each case. `on_run`, if given, is called with the number of runs
/// done, by one thread at a time. Errors: those of RunTimetable.
Result<std::vector<LockInRow>> CountLockIn(const TrailsBench& bench,
                                           const std::vector<LockInCase>& cases, int seeds,
                                           const std::function<void(size_t done)>& on_run = {});

/// The sum of rows that differ only in what is not in the key.
LockInRow Sum(const std::vector<LockInRow>& rows,
              const std::function<bool(const LockInCase&)>& belongs);

/// A header line, then a line for each row.
std::string LockInToCsv(const std::vector<LockInRow>& rows);
/// A table for people: by law, rule and exploration; a column for each number of robots.
std::string LockInToTable(const std::vector<LockInRow>& rows);

}  // namespace pheromone::swarm
