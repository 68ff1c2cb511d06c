#include "server/core/field/path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>
#include <set>

namespace pheromone::field {
namespace {

MapGeometry TenMetres() {
  return {.origin = {0, 0}, .width_um = 10'000'000, .height_um = 10'000'000, .cell_um = 100'000};
}

Path Polyline(std::vector<PointUm> points, bool closed = false) {
  Path path;
  path.points = std::move(points);
  path.closed = closed;
  return path;
}

void ExpectOneNodeWide(const std::vector<NodeIndex>& nodes, bool closed) {
  const size_t count = nodes.size();
  std::set<NodeIndex> distinct(nodes.begin(), nodes.end());
  EXPECT_EQ(distinct.size(), count);
  for (size_t i = 1; i < count + (closed ? 1 : 0); ++i) {
    const NodeIndex a = nodes[i - 1];
    const NodeIndex b = nodes[i % count];
    EXPECT_LE(std::abs(a.column - b.column), 1) << i;
    EXPECT_LE(std::abs(a.row - b.row), 1) << i;
  }
}

TEST(NodesAlong, AStraightLineOnTheGridIsEachNodeOfTheRow) {
  const auto nodes =
      NodesAlong(TenMetres(), Polyline({{1'000'000, 5'000'000}, {3'000'000, 5'000'000}}));
  ASSERT_EQ(nodes.size(), 21u);
  for (int i = 0; i < 21; ++i) {
    EXPECT_EQ(nodes[static_cast<size_t>(i)], (NodeIndex{10 + i, 50}));
  }
}

TEST(NodesAlong, ADiagonalHasNoCorners) {
  const auto nodes = NodesAlong(TenMetres(), Polyline({{0, 0}, {2'000'000, 2'000'000}}));
  ASSERT_EQ(nodes.size(), 21u);
  for (int i = 0; i < 21; ++i) {
    EXPECT_EQ(nodes[static_cast<size_t>(i)], (NodeIndex{i, i}));
  }
}

TEST(NodesAlong, EveryLineIsConnectedOneNodeWideAndNearTheLine) {
  for (int degrees = 0; degrees < 360; degrees += 7) {
    const double angle = degrees * std::numbers::pi / 180;
    const Path path = Polyline({{5'000'000, 5'000'000},
                                {5'000'000 + std::llround(4e6 * std::cos(angle)),
                                 5'000'000 + std::llround(4e6 * std::sin(angle))}});
    const auto nodes = NodesAlong(TenMetres(), path);
    ExpectOneNodeWide(nodes, false);
    for (const NodeIndex node : nodes) {
      const PointUm at = TenMetres().PositionOf(node);
      const PathPosition nearest =
          Locate(path, static_cast<double>(at.x), static_cast<double>(at.y));
      EXPECT_LE(nearest.distance_um, 0.7072 * 100'000);
    }
  }
}

TEST(NodesAlong, ACircleClosesAndStaysOnItsRadius) {
  const auto points = CirclePoints({5'000'000, 5'000'000}, 1'500'000, 50'000);
  const auto nodes = NodesAlong(TenMetres(), Polyline(points, true));
  ExpectOneNodeWide(nodes, true);
  for (const NodeIndex node : nodes) {
    EXPECT_NEAR(std::hypot(node.column - 50, node.row - 50), 15, 0.7072);
  }
}

// Bends that a corner cut must not eat: there and back, closed in a line, a spike.
TEST(NodesAlong, APathThatTurnsBackKeepsItsFarEnd) {
  const auto row = [](int32_t from, int32_t to) {
    std::set<NodeIndex> nodes;
    for (int32_t column = from; column <= to; ++column) {
      nodes.insert({column, 10});
    }
    return nodes;
  };
  const auto as_set = [](const std::vector<NodeIndex>& nodes) {
    return std::set<NodeIndex>(nodes.begin(), nodes.end());
  };
  const PointUm a{1'000'000, 1'000'000};
  const PointUm b{3'000'000, 1'000'000};
  const PointUm c{5'000'000, 1'000'000};
  EXPECT_EQ(as_set(NodesAlong(TenMetres(), Polyline({a, c, a}))), row(10, 50));
  EXPECT_EQ(as_set(NodesAlong(TenMetres(), Polyline({a, b, c}, true))), row(10, 50));
  EXPECT_EQ(as_set(NodesAlong(TenMetres(), Polyline(SplinePoints({a, c}, true, 25'000), true))),
            row(10, 50));
  const auto spike = as_set(
      NodesAlong(TenMetres(), Polyline({a, {2'000'000, 1'000'000}, {1'000'000, 1'100'000}})));
  EXPECT_TRUE(spike.contains({20, 10}));
  EXPECT_TRUE(spike.contains({10, 11}));
  EXPECT_EQ(spike.size(), 17u);  // columns 10 to 20 out, 10 to 15 back in the next row
}

// However a path bends: its nearest node lies within half a cell's diagonal, and if that node is
// cut as a corner, the next ones are one cell on.
TEST(NodesAlong, EveryPartOfARandomPathHasANodeNearby) {
  std::mt19937 random(3);
  for (int round = 0; round < 300; ++round) {
    Path path = Polyline({}, random() % 2 == 0);
    for (int i = 0; i < 5; ++i) {
      path.points.push_back({static_cast<int64_t>(1'000'000 + random() % 2'000'000),
                             static_cast<int64_t>(1'000'000 + random() % 2'000'000)});
    }
    const auto nodes = NodesAlong(TenMetres(), path);
    for (size_t i = 1; i < path.points.size(); ++i) {
      const PointUm from = path.points[i - 1];
      const PointUm to = path.points[i];
      for (int step = 0; step <= 50; ++step) {
        const PointUm at{from.x + (to.x - from.x) * step / 50,
                         from.y + (to.y - from.y) * step / 50};
        double nearest = 1e9;
        for (const NodeIndex node : nodes) {
          const PointUm position = TenMetres().PositionOf(node);
          nearest = std::min(nearest, std::hypot(position.x - at.x, position.y - at.y));
        }
        ASSERT_LE(nearest, 1.7072 * 100'000) << round;
      }
    }
  }
}

TEST(NodesAlong, ASinglePointIsOneNode) {
  EXPECT_EQ(NodesAlong(TenMetres(), Polyline({{1'040'000, 0}})).size(), 1u);
}

TEST(CirclePoints, LieOnTheCircleInStepsNoLongerThanAsked) {
  const auto points = CirclePoints({0, 0}, 1'000'000, 100'000);
  ASSERT_GE(points.size(), 63u);
  for (size_t i = 0; i < points.size(); ++i) {
    const PointUm a = points[i];
    const PointUm b = points[(i + 1) % points.size()];
    EXPECT_NEAR(std::hypot(a.x, a.y), 1e6, 1);
    EXPECT_LE(std::hypot(b.x - a.x, b.y - a.y), 100'001);
  }
}

TEST(SplinePoints, GoThroughEveryPoint) {
  const std::vector<PointUm> knots = {
      {0, 0}, {2'000'000, 1'000'000}, {4'000'000, 0}, {5'000'000, 3'000'000}};
  for (const bool closed : {false, true}) {
    const Path curve = Polyline(SplinePoints(knots, closed, 50'000), closed);
    for (const PointUm knot : knots) {
      EXPECT_LE(Locate(curve, static_cast<double>(knot.x), static_cast<double>(knot.y)).distance_um,
                2);
    }
  }
}

TEST(SplinePoints, OfPointsOnALineIsThatLine) {
  const auto points = SplinePoints({{0, 0}, {1'000'000, 0}, {3'000'000, 0}}, false, 50'000);
  for (const PointUm point : points) {
    EXPECT_EQ(point.y, 0);
  }
  EXPECT_EQ(points.back(), (PointUm{3'000'000, 0}));
}

TEST(SplinePoints, TakeRepeatedPointsOnce) {
  const std::vector<PointUm> plain = {{0, 0}, {1'000'000, 500'000}, {2'000'000, 0}};
  const std::vector<PointUm> repeated = {
      {0, 0}, {0, 0}, {1'000'000, 500'000}, {2'000'000, 0}, {0, 0}};
  EXPECT_EQ(SplinePoints(plain, true, 50'000), SplinePoints(repeated, true, 50'000));
}

TEST(Locate, MeasuresDistanceAndProgress) {
  const Path path = Polyline({{0, 0}, {1'000'000, 0}, {1'000'000, 1'000'000}});
  const PathPosition corner = Locate(path, 1'300'000, -400'000);
  EXPECT_DOUBLE_EQ(corner.distance_um, 500'000);
  EXPECT_DOUBLE_EQ(corner.along_um, 1'000'000);
  const PathPosition beside = Locate(path, 900'000, 500'000);
  EXPECT_DOUBLE_EQ(beside.distance_um, 100'000);
  EXPECT_DOUBLE_EQ(beside.along_um, 1'500'000);
  EXPECT_DOUBLE_EQ(LengthOf(path), 2'000'000);
}

TEST(Locate, CountsTheClosingSide) {
  const Path square =
      Polyline({{0, 0}, {1'000'000, 0}, {1'000'000, 1'000'000}, {0, 1'000'000}}, true);
  EXPECT_DOUBLE_EQ(Locate(square, 0, 500'000).distance_um, 0);
  EXPECT_DOUBLE_EQ(LengthOf(square), 4'000'000);
}

TEST(NearestPath, IsTheFirstOfThoseEquallyNear) {
  const std::vector<Path> paths = {Polyline({{0, 0}, {0, 1'000'000}}),
                                   Polyline({{2'000'000, 0}, {2'000'000, 1'000'000}}),
                                   Polyline({{2'000'000, 500'000}})};
  EXPECT_EQ(NearestPath(paths, 900'000, 500'000), 0u);
  EXPECT_EQ(NearestPath(paths, 1'000'000, 500'000), 0u);
  EXPECT_EQ(NearestPath(paths, 1'100'000, 500'000), 1u);
  EXPECT_EQ(NearestPath({paths.data() + 2, 1}, 0, 0), 0u);
}

}  // namespace
}  // namespace pheromone::field
