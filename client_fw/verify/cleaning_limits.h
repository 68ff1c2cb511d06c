// What is explored of cleaning robots: the floor, how long they take, and faults.
//
//   const CleaningLimits limits = {.columns = 4, .rows = 3, .robots = 2};
//   const std::string wrong = WhatIsWrong(limits);  // empty: it can be explored
//
// Times are in the paper's units.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace pheromone::verify {

constexpr size_t kMaxZones = 62;   ///< their ranks, and a new one, are bits of a word
constexpr int kSoilingStep = 15;   ///< the paper's time_step
constexpr int kFullPercent = 100;  ///< it does not become dirtier
constexpr int kMaxUnits = 250;     ///< of all times below

/// By zone, those beside it: a robot there sees their tags, and goes there in one move.
using CleaningNeighbours = std::vector<std::vector<uint8_t>>;

/// Of a grid: the four zones beside each, in the order in which a robot sees them. Zones are
/// numbered from 0, column by column, from the bottom up.
CleaningNeighbours GridNeighbours(int columns, int rows);

/// What is explored.
struct CleaningLimits {
  int columns = 4;
  int rows = 3;
  int robots = 2;
  int clean_min = 5;  ///< how long cleaning a zone takes
  int clean_max = 5;
  int move_min = 1;  ///< and moving to a zone beside
  int move_max = 1;
  int wait = 1;     ///< after which a robot looks again when all zones in sight are occupied
  int lease = 16;   ///< of the sign "occupied"; 0: it has none
  int crashes = 0;  ///< robots that may break down, cleaning or not
  bool passers_by = false;  ///< write on tags as much as they like
  uint64_t closed = 0;      ///< zones from which an operator's sign keeps robots away, as bits
  int asks = 0;  ///< how often an operator may write that a zone is to be cleaned again; at most 15
  /// Seeded faults, beside a lease of 0 or one shorter than cleaning takes.
  bool moves_between_equals = false;    ///< a robot's own zone does not win ties
  bool claims_unconditionally = false;  ///< writes without naming what it has read
  bool asks_for_ever = false;           ///< that a zone was cleaned since does not count
  /// Not empty: the floor, which is then no grid of `columns` and `rows`.
  CleaningNeighbours neighbours{};
  std::vector<int> rates_percent{};  ///< by zone, of soil in each step; empty: there is none
  int soiling_step = kSoilingStep;   ///< time after which zones become dirtier, again and again
  /// Of steps that are due at the same time, only those orders that may differ in what they lead
  /// to (see CleaningWorld), and of time stamps only what robots can compare (cleaning_stamps.h).
  bool reduced = false;

  CleaningNeighbours Floor() const {
    return neighbours.empty() ? GridNeighbours(columns, rows) : neighbours;
  }
};

/// Empty, or what cannot be explored: the value, and what was expected.
std::string WhatIsWrong(const CleaningLimits& limits);

}  // namespace pheromone::verify
