#include "server/core/field/sight.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <random>
#include <vector>

namespace pheromone::field {
namespace {

__extension__ using Int128 = __int128;

Int128 Magnitude(Int128 value) {
  return value < 0 ? -value : value;
}

enum class Meeting { kNone, kTouches, kCrosses };

// How the closed segment between two points meets a node's square: by the separating axis theorem,
// along x, along y and across the segment, in half micrometres.
Meeting MeetingOf(PointUm from, PointUm to, PointUm centre, int64_t cell_um) {
  const Int128 ax = Int128{2} * (from.x - centre.x);
  const Int128 ay = Int128{2} * (from.y - centre.y);
  const Int128 bx = Int128{2} * (to.x - centre.x);
  const Int128 by = Int128{2} * (to.y - centre.y);
  const Int128 half = cell_um;
  // Above 0: they are apart along this axis; 0: they touch.
  const Int128 along_x = std::max({std::min(ax, bx) - half, -half - std::max(ax, bx)});
  const Int128 along_y = std::max({std::min(ay, by) - half, -half - std::max(ay, by)});
  const Int128 extent = half * (Magnitude(bx - ax) + Magnitude(by - ay));
  const Int128 across = Magnitude(ax * by - ay * bx) - extent;
  const bool is_point = from == to;  // has no direction, so no axis across
  if (along_x > 0 || along_y > 0 || (!is_point && across > 0)) {
    return Meeting::kNone;
  }
  const bool crosses = along_x < 0 && along_y < 0 && (is_point || across < 0);
  return crosses ? Meeting::kCrosses : Meeting::kTouches;
}

// What the segment does at the blocked nodes, all of them looked at.
Meeting WorstMeeting(const ObstacleMask& mask, const MapGeometry& map, PointUm antenna,
                     NodeIndex node) {
  Meeting worst = Meeting::kNone;
  mask.ForEach([&](NodeIndex blocked) {
    worst = std::max(
        worst, MeetingOf(antenna, map.PositionOf(node), map.PositionOf(blocked), map.cell_um));
  });
  return worst;
}

MapGeometry MapOf(int32_t columns, int32_t rows, int64_t cell_um, PointUm origin = {0, 0}) {
  return {origin, (columns - 1) * cell_um, (rows - 1) * cell_um, cell_um};
}

// A map with some of its nodes blocked, and the window that holds it all.
struct Scene {
  Scene(const MapGeometry& geometry, const std::vector<NodeIndex>& blocked)
      : map(geometry), mask(map.columns(), map.rows()) {
    for (const NodeIndex node : blocked) {
      mask.Set(node);
    }
    sight.Load(mask, map, {0, 0}, {map.columns() - 1, map.rows() - 1});
  }
  bool Sees(PointUm antenna, NodeIndex node) const { return sight.Sees(antenna, node); }

  MapGeometry map;
  ObstacleMask mask;
  SightWindow sight;
};

// The cells are 10 um wide and the map 20 nodes, or 100 for the other way of walking.
class Sight : public ::testing::TestWithParam<int32_t> {
 protected:
  Scene With(const std::vector<NodeIndex>& blocked) const {
    return Scene(MapOf(GetParam(), GetParam(), 10), blocked);
  }
};
INSTANTIATE_TEST_SUITE_P(SmallAndLarge, Sight, ::testing::Values(20, 100));

TEST_P(Sight, AWallHidesWhatIsBehindIt) {
  const Scene scene = With({{5, 4}, {5, 5}, {5, 6}});
  EXPECT_TRUE(scene.Sees({20, 50}, {4, 5}));
  EXPECT_FALSE(scene.Sees({20, 50}, {6, 5}));
  EXPECT_FALSE(scene.Sees({20, 50}, {19, 7}));
  EXPECT_TRUE(scene.Sees({20, 50}, {6, 9}));
  EXPECT_FALSE(scene.Sees({80, 53}, {4, 5}));
  EXPECT_FALSE(scene.Sees({50, 150}, {5, 1}));
}

TEST_P(Sight, ABlockedNodeIsNeverSeen) {
  const Scene scene = With({{5, 5}});
  for (const PointUm antenna : {PointUm{0, 50}, {45, 50}, {45, 45}, {50, 50}, {52, 47}, {-8, 3}}) {
    EXPECT_FALSE(scene.Sees(antenna, {5, 5})) << antenna.x << ", " << antenna.y;
  }
}

TEST_P(Sight, FromInsideABlockedSquareNothingIsSeen) {
  const Scene scene = With({{5, 5}});
  for (const PointUm antenna : {PointUm{50, 50}, {46, 46}, {54, 46}, {46, 54}, {54, 54}}) {
    for (int32_t row = 0; row < 20; ++row) {
      for (int32_t column = 0; column < 20; ++column) {
        EXPECT_FALSE(scene.Sees(antenna, {column, row}));
      }
    }
  }
}

TEST_P(Sight, FromTheBorderOfABlockedSquareItsOwnSideIsSeen) {
  const Scene scene = With({{5, 5}});
  EXPECT_TRUE(scene.Sees({45, 50}, {4, 5}));
  EXPECT_TRUE(scene.Sees({45, 50}, {0, 19}));
  EXPECT_FALSE(scene.Sees({45, 50}, {6, 5}));
  EXPECT_FALSE(scene.Sees({45, 50}, {6, 19}));
  EXPECT_TRUE(scene.Sees({50, 55}, {3, 6}));
  EXPECT_TRUE(scene.Sees({55, 55}, {4, 6}));  // over the corner
}

TEST_P(Sight, TouchingACornerHidesNothing) {
  // Through (45, 45), which is a corner of both.
  const Scene scene = With({{5, 4}, {4, 5}});
  EXPECT_TRUE(scene.Sees({10, 10}, {8, 8}));
  EXPECT_TRUE(scene.Sees({80, 80}, {1, 1}));
  EXPECT_FALSE(scene.Sees({11, 10}, {8, 8}));
  EXPECT_FALSE(scene.Sees({10, 11}, {8, 8}));
  const Scene other = With({{4, 4}, {5, 5}});  // (45, 45) once more, from the other two sides
  EXPECT_TRUE(other.Sees({10, 80}, {8, 1}));
  EXPECT_TRUE(other.Sees({80, 10}, {1, 8}));
  EXPECT_FALSE(other.Sees({81, 10}, {1, 8}));
}

TEST_P(Sight, ASegmentAlongAWallIsFree) {
  // No node lies on a border between squares, so only a segment of length 0 or one that ends at the
  // border can run along it: the antenna slides along the wall's face, and looks past its end.
  const Scene scene = With({{3, 5}, {4, 5}, {5, 5}});
  EXPECT_TRUE(scene.Sees({30, 55}, {8, 6}));
  EXPECT_TRUE(scene.Sees({25, 45}, {2, 9}));
  EXPECT_FALSE(scene.Sees({30, 55}, {8, 5}));
}

TEST_P(Sight, AnAntennaAtANodeSeesThatNode) {
  const Scene scene = With({{4, 5}, {6, 5}, {5, 4}, {5, 6}});
  EXPECT_TRUE(scene.Sees({50, 50}, {5, 5}));
  EXPECT_TRUE(scene.Sees({53, 47}, {5, 5}));
  EXPECT_FALSE(scene.Sees({50, 50}, {7, 5}));
}

TEST_P(Sight, AnAntennaOffTheMapSeesInUntilAWall) {
  const int32_t last = GetParam() - 1;
  const Scene scene = With({{3, 0}, {3, 1}, {3, 2}, {last, last}});
  EXPECT_TRUE(scene.Sees({-70, 10}, {2, 1}));
  EXPECT_FALSE(scene.Sees({-70, 10}, {4, 1}));
  EXPECT_FALSE(scene.Sees({-1'000'000'000, -1'000'000'000'000}, {3, 3}));
  EXPECT_TRUE(scene.Sees({-1'000'000'000'000, 30}, {3, 3}));
  EXPECT_TRUE(scene.Sees({60, -500}, {4, 3}));
  EXPECT_FALSE(scene.Sees({10'000, 10'000}, {last - 1, last - 1}));
}

TEST(SightWindow, HoldsWhatIsBlockedBetweenItsCornersAndNothingElse) {
  const MapGeometry map = MapOf(300, 300, 10, {-77, 1234});
  std::mt19937 random(1);
  const auto below = [&](int32_t count) {
    return static_cast<int32_t>(random() % static_cast<uint32_t>(count));
  };
  ObstacleMask mask(map.columns(), map.rows());
  for (int i = 0; i < 9000; ++i) {
    mask.Set({below(300), below(300)});
  }
  SightWindow sight;
  int large = 0;
  for (int round = 0; round < 400; ++round) {
    const NodeIndex low{below(300), below(300)};
    const int32_t most = round % 2 == 0 ? 20 : 200;
    const NodeIndex high{std::min(low.column + below(most), 299),
                         std::min(low.row + below(most), 299)};
    large += high.column - low.column >= 64 || high.row - low.row >= 64 ? 1 : 0;
    sight.Load(mask, map, low, high);
    bool any = false;
    for (int32_t row = low.row; row <= high.row; ++row) {
      for (int32_t column = low.column; column <= high.column; ++column) {
        any |= mask.Blocked({column, row});
        ASSERT_EQ(sight.Sees(map.PositionOf({column, row}), {column, row}),
                  !mask.Blocked({column, row}));
      }
    }
    ASSERT_EQ(sight.any(), any);
    // Right outside of the window nothing is in the way.
    if (!mask.Blocked(low)) {
      const PointUm at = map.PositionOf(low);
      EXPECT_TRUE(sight.Sees(PointUm{at.x - 10 * map.cell_um, at.y}, low));
      EXPECT_TRUE(sight.Sees(PointUm{at.x, at.y - 10 * map.cell_um}, low));
    }
    if (!mask.Blocked(high)) {
      const PointUm at = map.PositionOf(high);
      EXPECT_TRUE(sight.Sees(PointUm{at.x + 10 * map.cell_um, at.y}, high));
      EXPECT_TRUE(sight.Sees(PointUm{at.x, at.y + 10 * map.cell_um}, high));
    }
  }
  EXPECT_GT(large, 50);
}

// How the antennas of the comparison below are chosen.
enum class Choice { kOnANode, kOnABorder, kAnywhere, kGrazing, kNearlyGrazing };
constexpr int kChoices = 5;

struct Tally {
  int seen = 0;
  int hidden = 0;
  int seen_touching = 0;  // of the seen ones: it touches a blocked square
};

class RandomSight {
 public:
  explicit RandomSight(unsigned seed) : random_(seed) {}

  int64_t Between(int64_t low, int64_t high) {
    return std::uniform_int_distribution<int64_t>(low, high)(random_);
  }

  // One map with a number of antennas and nodes.
  void Compare(int32_t columns, int32_t rows, int64_t cell_um, double density) {
    const MapGeometry map = MapOf(columns, rows, cell_um,
                                  {Between(-1'000'000'000, 1'000'000'000), Between(-5000, 5000)});
    ObstacleMask mask(columns, rows);
    std::vector<NodeIndex> blocked;
    std::bernoulli_distribution is_blocked(density);
    for (int32_t row = 0; row < rows; ++row) {
      for (int32_t column = 0; column < columns; ++column) {
        if (is_blocked(random_)) {
          mask.Set({column, row});
          blocked.push_back({column, row});
        }
      }
    }
    sight_.Load(mask, map, {0, 0}, {columns - 1, rows - 1});
    for (int i = 0; i < 100; ++i) {
      const NodeIndex node{static_cast<int32_t>(Between(0, columns - 1)),
                           static_cast<int32_t>(Between(0, rows - 1))};
      const auto choice = static_cast<Choice>(i % kChoices);
      const PointUm antenna = Antenna(choice, map, node, blocked);
      const Meeting meeting = WorstMeeting(mask, map, antenna, node);
      const bool seen = sight_.Sees(antenna, node);
      ASSERT_EQ(seen, meeting != Meeting::kCrosses)
          << columns << " x " << rows << " nodes of " << cell_um << " um, antenna at ("
          << antenna.x - map.origin.x << ", " << antenna.y - map.origin.y << ") um, node ("
          << node.column << ", " << node.row << ")";
      Tally& tally = tallies[i % kChoices];
      ++(seen ? tally.seen : tally.hidden);
      tally.seen_touching += seen && meeting == Meeting::kTouches ? 1 : 0;
    }
  }

  Tally tallies[kChoices];

 private:
  PointUm Antenna(Choice choice, const MapGeometry& map, NodeIndex node,
                  const std::vector<NodeIndex>& blocked) {
    const int64_t cell = map.cell_um;
    const PointUm anywhere{map.origin.x + Between(-2 * cell, (map.columns() + 1) * cell),
                           map.origin.y + Between(-2 * cell, (map.rows() + 1) * cell)};
    const PointUm near_node = map.PositionOf(
        map.NearestNode({std::clamp(anywhere.x, map.origin.x, map.origin.x + map.width_um),
                         std::clamp(anywhere.y, map.origin.y, map.origin.y + map.height_um)}));
    switch (choice) {
      case Choice::kOnANode:
        return near_node;
      case Choice::kOnABorder:  // or next to it, if the cell is odd
        return {near_node.x + Between(-1, 1) * (cell / 2),
                near_node.y + Between(0, 1) * (cell / 2)};
      case Choice::kGrazing:
      case Choice::kNearlyGrazing:
        if (!blocked.empty()) {
          return Grazing(
              choice == Choice::kNearlyGrazing, map, node,
              blocked[static_cast<size_t>(Between(0, static_cast<int64_t>(blocked.size()) - 1))]);
        }
        return anywhere;
      case Choice::kAnywhere:
        break;
    }
    return anywhere;
  }

  // So that the segment to `node` goes through a corner of the obstacle's square; or beside it, as
  // near as whole micrometres permit.
  PointUm Grazing(bool nearly, const MapGeometry& map, NodeIndex node, NodeIndex obstacle) {
    const PointUm at = map.PositionOf(node);
    // The corner is at (x, y) half cells from the node; the antenna as far, or up to twice.
    const int64_t x = 2 * (obstacle.column - node.column) + (Between(0, 1) == 0 ? 1 : -1);
    const int64_t y = 2 * (obstacle.row - node.row) + (Between(0, 1) == 0 ? 1 : -1);
    const int64_t scale = Between((map.cell_um + 1) / 2, map.cell_um);
    const PointUm through{at.x + x * scale, at.y + y * scale};
    if (!nearly) {
      return through;
    }
    // The area between the segment and the way to the corner is u y - v x, at least 1.
    const int64_t area = Between(0, 1) == 0 ? 1 : -1;
    for (int64_t v = y * scale; v < y * scale + std::abs(y); ++v) {
      if ((x * v + area) % y == 0) {
        return {at.x + (x * v + area) / y, at.y + v};
      }
    }
    return {through.x + area, through.y};  // x and y have a common factor
  }

  std::mt19937_64 random_;
  SightWindow sight_;  // used again and again, as in a query
};

TEST(SightWindow, AgreesWithTheSeparatingAxesOfAllSquares) {
  RandomSight random(42);
  const int64_t cells_um[] = {
      1, 2, 3, 10, 25, 50'000, 99'999, 100'000, 1'000'000, 1 << 21, (1 << 21) + 1, 3'000'001};
  for (int round = 0; round < 2200; ++round) {
    const int64_t cell_um = cells_um[static_cast<size_t>(random.Between(0, 11))];
    const int64_t most = round % 10 == 0 ? 150 : round % 3 == 0 ? 64 : 20;
    const double density = round % 4 == 0 ? 0.1 : round % 4 == 1 ? 0.03 : 0.005;
    ASSERT_NO_FATAL_FAILURE(random.Compare(static_cast<int32_t>(random.Between(1, most)),
                                           static_cast<int32_t>(random.Between(1, most)), cell_um,
                                           density));
  }
  for (const Tally& tally : random.tallies) {
    EXPECT_EQ(tally.seen + tally.hidden, 44'000);
    EXPECT_GT(tally.seen, 8000);
    EXPECT_GT(tally.hidden, 8000);
  }
  EXPECT_GT(random.tallies[static_cast<size_t>(Choice::kOnANode)].seen_touching, 500);
  EXPECT_GT(random.tallies[static_cast<size_t>(Choice::kOnABorder)].seen_touching, 500);
  EXPECT_GT(random.tallies[static_cast<size_t>(Choice::kGrazing)].seen_touching, 3000);
}

// The largest squares of the small window's arithmetic, far apart, past the corner by the least.
TEST(SightWindow, IsExactAcrossTheWholeSmallWindow) {
  RandomSight random(7);
  for (int round = 0; round < 300; ++round) {
    ASSERT_NO_FATAL_FAILURE(random.Compare(64, 64, (1 << 21) - random.Between(0, 1), 0.003));
  }
  EXPECT_GT(random.tallies[static_cast<size_t>(Choice::kNearlyGrazing)].seen, 1000);
  EXPECT_GT(random.tallies[static_cast<size_t>(Choice::kNearlyGrazing)].hidden, 1000);
}

}  // namespace
}  // namespace pheromone::field
