#include "server/core/tags/tag_map.h"

#include <algorithm>
#include <bit>
#include <cassert>

#include "server/base/hash.h"

namespace pheromone::tags {
namespace {

// The power of two that is not smaller than the range.
int ExponentFor(int64_t range_um) {
  return static_cast<int>(std::bit_width(static_cast<uint64_t>(range_um - 1)));
}

// Shifts of negative numbers round down since C++20.
uint64_t KeyOf(int64_t column, int64_t row) {
  return Hash64({static_cast<uint64_t>(column), static_cast<uint64_t>(row)});
}

}  // namespace

bool Place::Reaches(int64_t x, int64_t y) const {
  const int64_t dx = x - x_um;
  const int64_t dy = y - y_um;
  if (dx > range_um || dx < -range_um || dy > range_um || dy < -range_um) {
    return false;  // and no overflow below
  }
  return dx * dx + dy * dy <= range_um * range_um;
}

void TagMap::Add(const Place& place) {
  assert(place.range_um >= 1 && place.range_um <= kMaxRangeUm);
  const int exponent = ExponentFor(place.range_um);
  grids_[exponent][KeyOf(place.x_um >> exponent, place.y_um >> exponent)].push_back(place);
}

std::vector<uint16_t> TagMap::InRange(int64_t x_um, int64_t y_um) const {
  std::vector<uint16_t> numbers;
  for (const auto& [exponent, squares] : grids_) {
    for (int64_t column = -1; column <= 1; ++column) {
      for (int64_t row = -1; row <= 1; ++row) {
        // Two squares may share a key, but no tag is in both.
        const auto found =
            squares.find(KeyOf((x_um >> exponent) + column, (y_um >> exponent) + row));
        if (found == squares.end()) {
          continue;
        }
        for (const Place& place : found->second) {
          if (place.Reaches(x_um, y_um)) {
            numbers.push_back(place.number);
          }
        }
      }
    }
  }
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  return numbers;
}

}  // namespace pheromone::tags
