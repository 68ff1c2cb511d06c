// Where the tags are: finds those in range of a point in time that does not depend on how many
// there are elsewhere.
//
//   TagMap map;
//   map.Add({.number = 7, .x_um = 1'000'000, .y_um = 2'000'000, .range_um = 500'000});
//   map.InRange(x_um, y_um);   // {7}
//
// A tag is in a square of a grid whose squares are at least as wide as its range, so that only nine
// squares need a look; there is a grid for each power of two.
//
// Pure; one thread at a time.
#pragma once

#include <cstdint>
#include <map>
#include <unordered_map>
#include <vector>

namespace pheromone::tags {

/// Where a tag is, in micrometres on the map, and how far it is read and written.
struct Place {
  uint16_t number = 0;
  int64_t x_um = 0;
  int64_t y_um = 0;
  int64_t range_um = 1;  ///< from 1 to kMaxRangeUm
  bool operator==(const Place&) const = default;

  /// Within range: the distance is at most range_um.
  bool Reaches(int64_t x, int64_t y) const;
};

constexpr int64_t kMaxRangeUm = 100'000'000;
/// Positions are within +/- this, 10^9 m.
constexpr int64_t kMaxPositionUm = 1'000'000'000'000'000;

class TagMap {
 public:
  void Clear() { grids_.clear(); }
  void Add(const Place& place);

  /// The numbers of the tags that reach the point, in ascending order.
  std::vector<uint16_t> InRange(int64_t x_um, int64_t y_um) const;

 private:
  using Square = std::unordered_map<uint64_t, std::vector<Place>>;
  std::map<int, Square> grids_;  // by the exponent of the width of their squares
};

}  // namespace pheromone::tags
