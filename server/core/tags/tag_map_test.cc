#include "server/core/tags/tag_map.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace pheromone::tags {
namespace {

using Numbers = std::vector<uint16_t>;

TEST(TagMapTest, RangeIsACircleWithItsEdge) {
  TagMap map;
  map.Add({.number = 7, .x_um = -3'000'000, .y_um = 4'000'000, .range_um = 5'000'000});
  EXPECT_EQ(map.InRange(0, 0), Numbers{7});
  EXPECT_EQ(map.InRange(1, 0), Numbers{});
  EXPECT_EQ(map.InRange(-3'000'000, 9'000'000), Numbers{7});
  EXPECT_EQ(map.InRange(-3'000'000, 9'000'001), Numbers{});
}

TEST(TagMapTest, NumbersAreInOrder) {
  TagMap map;
  for (const uint16_t number : Numbers{9, 3, 5}) {
    map.Add({.number = number, .range_um = int64_t{1} << number});
  }
  EXPECT_EQ(map.InRange(0, 0), (Numbers{3, 5, 9}));
}

TEST(TagMapTest, FarPositionsDoNotOverflow) {
  TagMap map;
  map.Add({.number = 1, .x_um = kMaxPositionUm, .y_um = -kMaxPositionUm, .range_um = kMaxRangeUm});
  EXPECT_EQ(map.InRange(-kMaxPositionUm, kMaxPositionUm), Numbers{});
  EXPECT_EQ(map.InRange(kMaxPositionUm, -kMaxPositionUm - kMaxRangeUm), Numbers{1});
}

TEST(TagMapTest, FindsWhatAScanOfAllTagsFinds) {
  std::mt19937_64 random(3);
  const auto between = [&](int64_t least, int64_t most) {
    return least + static_cast<int64_t>(random() % static_cast<uint64_t>(most - least + 1));
  };
  for (const int64_t spread : {1'000, 10'000'000, 500'000'000}) {
    TagMap map;
    std::vector<Place> all;
    for (uint16_t number = 1; number <= 500; ++number) {
      const int64_t largest = number % 2 == 0 ? kMaxRangeUm : 2'000'000;
      all.push_back(
          {number, between(-spread, spread), between(-spread, spread), between(1, largest)});
      map.Add(all.back());
    }
    for (int look = 0; look < 1000; ++look) {
      const int64_t x = between(-spread, spread);
      const int64_t y = between(-spread, spread);
      Numbers expected;
      for (const Place& it : all) {
        __extension__ using Wide = __int128;
        const Wide dx = x - it.x_um;
        const Wide dy = y - it.y_um;
        if (dx * dx + dy * dy <= static_cast<Wide>(it.range_um) * it.range_um) {
          expected.push_back(it.number);
        }
      }
      ASSERT_EQ(map.InRange(x, y), expected);
    }
  }
}

}  // namespace
}  // namespace pheromone::tags
