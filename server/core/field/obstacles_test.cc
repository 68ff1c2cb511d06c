#include "server/core/field/obstacles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "server/base/hash.h"

namespace pheromone::field {
namespace {

__extension__ using Int128 = __int128;
using Nodes = std::set<NodeIndex>;

Nodes NodesOf(const ObstacleMask& mask) {
  Nodes nodes;
  mask.ForEach([&](NodeIndex node) { EXPECT_TRUE(nodes.insert(node).second); });
  return nodes;
}

// Every way of asking the mask, against the set of what is blocked.
void ExpectHolds(const ObstacleMask& mask, const Nodes& blocked) {
  EXPECT_EQ(mask.count(), blocked.size());
  EXPECT_EQ(mask.empty(), blocked.empty());
  EXPECT_EQ(NodesOf(mask), blocked);
  for (int32_t row = -9; row < mask.rows() + 9; ++row) {
    for (int32_t column = -9; column < mask.columns() + 9; ++column) {
      ASSERT_EQ(mask.Blocked({column, row}), blocked.contains({column, row}))
          << column << ", " << row;
    }
  }
  for (int32_t tile_row = -2; tile_row < mask.rows() / 8 + 10; ++tile_row) {
    for (int32_t tile_column = -2; tile_column < mask.columns() / 8 + 10; ++tile_column) {
      uint64_t expected = 0;
      for (int32_t i = 0; i < 64; ++i) {
        const NodeIndex node{8 * tile_column + i % 8, 8 * tile_row + i / 8};
        expected |= uint64_t{blocked.contains(node)} << i;
      }
      ASSERT_EQ(mask.TileBits(tile_column, tile_row), expected) << tile_column << ", " << tile_row;
    }
  }
  uint64_t hash = 0;
  for (const NodeIndex node : blocked) {
    hash += Hash64({static_cast<uint64_t>(node.column), static_cast<uint64_t>(node.row)});
  }
  EXPECT_EQ(mask.Hash(), hash);
}

TEST(ObstacleMask, HoldsWhatASetHolds) {
  std::mt19937 random(1);
  const auto between = [&](int32_t low, int32_t high) {
    return std::uniform_int_distribution<int32_t>(low, high)(random);
  };
  for (const auto& [columns, rows] : {std::pair{1, 1}, {64, 64}, {65, 130}, {200, 63}, {7, 300}}) {
    ObstacleMask mask(columns, rows);
    Nodes blocked;
    ExpectHolds(mask, blocked);
    for (int round = 0; round < 6; ++round) {
      for (int i = 0; i < 400; ++i) {
        const NodeIndex node{between(-3, columns + 2), between(-3, rows + 2)};
        const bool on_map =
            node.column >= 0 && node.column < columns && node.row >= 0 && node.row < rows;
        if (round % 2 == 0) {
          mask.Set(node);
          if (on_map) {
            blocked.insert(node);
          }
        } else {
          mask.Set(node, false);
          blocked.erase(node);
        }
      }
      const int32_t row = between(-1, rows);
      const int32_t first = between(-100, columns + 10);
      const int32_t last = between(first - 5, columns + 100);
      mask.BlockRow(row, first, last);
      for (int32_t column = first; column <= last; ++column) {
        if (row >= 0 && row < rows && column >= 0 && column < columns) {
          blocked.insert({column, row});
        }
      }
      ExpectHolds(mask, blocked);
    }
  }
}

TEST(ObstacleMask, IsEqualWhenTheSameNodesAreBlockedHoweverItCameToThat) {
  ObstacleMask one(300, 200);
  ObstacleMask other(300, 200);
  EXPECT_EQ(one, other);
  one.Set({5, 7});
  EXPECT_NE(one, other);
  one.Set({299, 199});
  other.Set({299, 199});
  other.Set({150, 80});
  EXPECT_NE(one, other);  // as many, but others
  other.Set({150, 80}, false);
  other.Set({5, 7});
  EXPECT_EQ(one, other);
  EXPECT_EQ(one.Hash(), other.Hash());
  EXPECT_EQ(one.bytes(), other.bytes());
  EXPECT_NE(ObstacleMask(300, 200), ObstacleMask(300, 201));
}

TEST(ObstacleMask, TakesMemoryForWhatIsBlockedAndNotForTheMap) {
  ObstacleMask mask(30'000, 30'000);
  EXPECT_LE(mask.bytes(), 2'000'000u);
  const uint64_t empty = mask.bytes();
  mask.BlockRow(17'000, 0, 29'999);
  EXPECT_EQ(mask.count(), 30'000u);
  EXPECT_LE(mask.bytes() - empty, 300'000u);
  for (int32_t column = 0; column < 30'000; ++column) {
    mask.Set({column, 17'000}, false);
  }
  EXPECT_EQ(mask.bytes(), empty);
}

// The shapes, node by node, in half micrometres: `overlaps` is asked with the centre of each square
// and half its side.
struct Half {
  Int128 x;
  Int128 y;
};
Half InHalves(PointUm point) {
  return {Int128{2} * point.x, Int128{2} * point.y};
}

Nodes Overlapping(const MapGeometry& map, const std::function<bool(Half, Int128)>& overlaps) {
  Nodes nodes;
  for (int32_t row = 0; row < map.rows(); ++row) {
    for (int32_t column = 0; column < map.columns(); ++column) {
      if (overlaps(InHalves(map.PositionOf({column, row})), map.cell_um)) {
        nodes.insert({column, row});
      }
    }
  }
  return nodes;
}

bool RectangleOverlaps(PointUm a, PointUm b, Half centre, Int128 half) {
  return std::max(2 * a.x, 2 * b.x) > centre.x - half &&
         std::min(2 * a.x, 2 * b.x) < centre.x + half &&
         std::max(2 * a.y, 2 * b.y) > centre.y - half &&
         std::min(2 * a.y, 2 * b.y) < centre.y + half;
}

// Whether `p` is less than `radius` from the segment.
bool IsNear(Half p, Half a, Half b, Int128 radius) {
  const Half d{b.x - a.x, b.y - a.y};
  const Half q{p.x - a.x, p.y - a.y};
  const Int128 length2 = d.x * d.x + d.y * d.y;
  // |q - t d|^2 < radius^2 with t = along / length2 from 0 to 1, times length2 where t is inside.
  const Int128 along = q.x * d.x + q.y * d.y;
  if (along <= 0 || length2 == 0) {
    return q.x * q.x + q.y * q.y < radius * radius;
  }
  if (along >= length2) {
    return (q.x - d.x) * (q.x - d.x) + (q.y - d.y) * (q.y - d.y) < radius * radius;
  }
  return (q.x * q.x + q.y * q.y) * length2 - along * along < radius * radius * length2;
}

// Whether the segment meets the open square: what is left of the segment after it was clipped
// between the square's sides (Liang and Barsky 1984), with the parameter as a numerator over
// |dx| |dy|.
bool Crosses(Half a, Half b, Half centre, Int128 half) {
  const Half d{b.x - a.x, b.y - a.y};
  const Int128 over_x = std::max<Int128>(d.x < 0 ? -d.x : d.x, 1);
  const Int128 over_y = std::max<Int128>(d.y < 0 ? -d.y : d.y, 1);
  Int128 enter = 0;
  Int128 leave = over_x * over_y;
  const auto clip = [&](Int128 start, Int128 delta, Int128 other) {
    if (delta == 0) {
      return -half < start && start < half;
    }
    const Int128 forward = delta > 0 ? start : -start;
    enter = std::max(enter, (-half - forward) * other);
    leave = std::min(leave, (half - forward) * other);
    return true;
  };
  return clip(a.x - centre.x, d.x, over_y) && clip(a.y - centre.y, d.y, over_x) && enter < leave;
}

bool StrokeOverlaps(const std::vector<PointUm>& points, Int128 radius, Half centre, Int128 half) {
  const Half corner[] = {{centre.x - half, centre.y - half},
                         {centre.x + half, centre.y - half},
                         {centre.x + half, centre.y + half},
                         {centre.x - half, centre.y + half}};
  bool overlaps = false;
  for (size_t i = 0; i < points.size(); ++i) {
    const PointUm from = points[i > 0 ? i - 1 : 0];
    const Half a = InHalves(from);
    const Half b = InHalves(points[i]);
    overlaps = overlaps || Crosses(a, b, centre, half);
    for (size_t k = 0; k < 4; ++k) {
      overlaps = overlaps || IsNear(corner[k], a, b, radius) ||
                 IsNear(a, corner[k], corner[(k + 1) % 4], radius) ||
                 IsNear(b, corner[k], corner[(k + 1) % 4], radius);
    }
  }
  return overlaps;
}

class RandomShape {
 public:
  int64_t Between(int64_t low, int64_t high) {
    return std::uniform_int_distribution<int64_t>(low, high)(random_);
  }
  MapGeometry Map() {
    const int64_t cells_um[] = {1, 2, 3, 10, 25, 99'999, 1'000'000};
    const int64_t cell_um = cells_um[Between(0, 6)];
    return {{Between(-100, 100), Between(-100, 100)},
            Between(0, 25) * cell_um + Between(0, cell_um - 1),
            Between(0, 25) * cell_um + Between(0, cell_um - 1),
            cell_um};
  }
  // On the map or up to some cells beside it; often on a node, on a border or at a corner.
  PointUm Point(const MapGeometry& map) {
    const int64_t cell = map.cell_um;
    if (Between(0, 1) == 0) {
      return {map.origin.x + Between(-5 * cell, map.width_um + 5 * cell),
              map.origin.y + Between(-5 * cell, map.height_um + 5 * cell)};
    }
    return {map.origin.x + Between(-5, map.columns() + 5) * cell + Between(0, 1) * (cell / 2),
            map.origin.y + Between(-5, map.rows() + 5) * cell + Between(0, 1) * (cell / 2)};
  }

 private:
  std::mt19937_64 random_{3};
};

TEST(BlockRectangle, BlocksTheSquaresThatItOverlaps) {
  RandomShape random;
  size_t blocked = 0;
  for (int round = 0; round < 3000; ++round) {
    const MapGeometry map = random.Map();
    const PointUm a = random.Point(map);
    const PointUm b = round % 8 == 0 ? a : random.Point(map);
    ObstacleMask mask(map.columns(), map.rows());
    BlockRectangle(map, a, b, &mask);
    const Nodes expected = Overlapping(
        map, [&](Half centre, Int128 half) { return RectangleOverlaps(a, b, centre, half); });
    ASSERT_EQ(NodesOf(mask), expected) << round;
    blocked += expected.size();
  }
  EXPECT_GT(blocked, 50'000u);
}

TEST(BlockLine, BlocksTheSquaresThatItOverlaps) {
  RandomShape random;
  size_t blocked = 0;
  for (int round = 0; round < 4000; ++round) {
    const MapGeometry map = random.Map();
    std::vector<PointUm> points;
    for (int64_t count = random.Between(1, 4); count > 0; --count) {
      points.push_back(random.Point(map));
    }
    if (round % 7 == 0) {
      points.push_back(points.back());
    }
    if (round % 5 == 0) {
      points.push_back({random.Point(map).x, points.back().y});  // along a row
    }
    const int64_t width_um = round % 3 == 0   ? 0
                             : round % 3 == 1 ? map.cell_um * random.Between(1, 6)
                                              : random.Between(1, 4 * map.cell_um);
    ObstacleMask mask(map.columns(), map.rows());
    BlockLine(map, points, width_um, &mask);
    const Nodes expected = Overlapping(map, [&](Half centre, Int128 half) {
      return StrokeOverlaps(points, width_um, centre, half);
    });
    ASSERT_EQ(NodesOf(mask), expected) << round;
    blocked += expected.size();
  }
  EXPECT_GT(blocked, 50'000u);
}

TEST(BlockDisc, TouchesWithoutBlockingAtTheRadius) {
  const MapGeometry map{{0, 0}, 1000, 1000, 10};
  ObstacleMask mask(map.columns(), map.rows());
  BlockDisc(map, {500, 500}, 5, &mask);  // from border to border of a square
  EXPECT_EQ(NodesOf(mask), (Nodes{{50, 50}}));
  BlockDisc(map, {500, 500}, 6, &mask);
  EXPECT_EQ(NodesOf(mask), (Nodes{{50, 50}, {49, 50}, {51, 50}, {50, 49}, {50, 51}}));
  // The corner (45, 45) um from the centre's square is 3-4-5 away from a disc of 25 at (30, 25).
  ObstacleMask corner(map.columns(), map.rows());
  BlockDisc(map, {30, 25}, 25, &corner);
  EXPECT_FALSE(corner.Blocked({5, 5}));
  BlockDisc(map, {30, 25}, 26, &corner);
  EXPECT_TRUE(corner.Blocked({5, 5}));
}

TEST(BlockLine, AWallWithoutWidthAlongTheBorderBetweenSquaresBlocksNeither) {
  const MapGeometry map{{0, 0}, 1000, 1000, 10};
  ObstacleMask mask(map.columns(), map.rows());
  const std::vector<PointUm> wall = {{100, 105}, {300, 105}};
  BlockLine(map, wall, 0, &mask);
  EXPECT_TRUE(mask.empty());
  BlockLine(map, wall, 1, &mask);
  EXPECT_EQ(mask.count(), 2 * 21u);
  EXPECT_TRUE(mask.Blocked({20, 10}));
  EXPECT_TRUE(mask.Blocked({20, 11}));
  BlockLine(map, {}, 10, &mask);
  EXPECT_EQ(mask.count(), 2 * 21u);
}

// On the largest map, in the direction (3, 4), whose length is whole: distances are exact without
// squares.
TEST(BlockLine, IsExactOverTensOfKilometres) {
  const int64_t cell_um = 1'000'000;
  const MapGeometry map{{-5, 7}, 29'999 * cell_um, 29'999 * cell_um, cell_um};
  const PointUm from{map.origin.x + 1'000'000'123, map.origin.y + 2'000'000'456};
  const int64_t steps = 6'000'000'000;
  const PointUm to{from.x + 3 * steps, from.y + 4 * steps};
  for (const int64_t width_um : {int64_t{0}, int64_t{1}, int64_t{2'400'001}, int64_t{30'000'000}}) {
    ObstacleMask mask(map.columns(), map.rows());
    BlockLine(map, {{from, to}}, width_um, &mask);
    size_t blocked = 0;
    for (int32_t row = 2100; row < 25'900; row += 37) {
      const int64_t y = map.PositionOf({0, row}).y - from.y;
      const auto near = static_cast<int32_t>((from.x + y * 3 / 4 - map.origin.x) / cell_um);
      for (int32_t column = near - 60; column <= near + 60; ++column) {
        const int64_t x = map.PositionOf({column, row}).x - from.x;
        // 5 * the distance of the centre from the line, less what the square and the wall extend,
        // in half micrometres.
        const int64_t across = 2 * std::abs(4 * x - 3 * y) - 7 * cell_um - 5 * width_um;
        ASSERT_EQ(mask.Blocked({column, row}), across < 0) << column << ", " << row;
        blocked += across < 0 ? 1 : 0;
      }
    }
    EXPECT_GT(blocked, 500u);
  }
}

}  // namespace
}  // namespace pheromone::field
