// Routes around obstacles, compared with the shortest way over the nodes that Dijkstra's algorithm
// finds in a dense table.

#include "server/core/field/route.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <vector>

namespace pheromone::field {
namespace {

constexpr MapGeometry kMap{{0, 0}, 10'000'000, 6'000'000, 100'000};

Shared<ObstacleMask> Walls(const std::vector<std::pair<PointUm, PointUm>>& rectangles) {
  ObstacleMask mask(kMap.columns(), kMap.rows());
  for (const auto& [corner, opposite] : rectangles) {
    BlockRectangle(kMap, corner, opposite, &mask);
  }
  return Shared(std::move(mask));
}

double LengthOf(const std::vector<PointUm>& route) {
  double length = 0;
  for (size_t i = 1; i < route.size(); ++i) {
    length += std::hypot(static_cast<double>(route[i].x - route[i - 1].x),
                         static_cast<double>(route[i].y - route[i - 1].y));
  }
  return length;
}

// The least distance of the route from the position of a blocked node.
double NearestObstacle(const std::vector<PointUm>& route, const ObstacleMask& mask) {
  double least = std::numeric_limits<double>::infinity();
  for (size_t i = 1; i < route.size(); ++i) {
    for (int step = 0; step <= 1000; ++step) {
      const double x = static_cast<double>(route[i - 1].x) +
                       static_cast<double>(route[i].x - route[i - 1].x) * step / 1000;
      const double y = static_cast<double>(route[i - 1].y) +
                       static_cast<double>(route[i].y - route[i - 1].y) * step / 1000;
      mask.ForEach([&](NodeIndex node) {
        const PointUm at = kMap.PositionOf(node);
        least = std::min(least,
                         std::hypot(x - static_cast<double>(at.x), y - static_cast<double>(at.y)));
      });
    }
  }
  return least;
}

// Over all nodes that are not blocked, in micrometres; infinite if there is no way.
double ShortestOverNodes(const ObstacleMask& mask, NodeIndex from, NodeIndex to) {
  const auto columns = static_cast<size_t>(kMap.columns());
  const auto rows = static_cast<size_t>(kMap.rows());
  std::vector<double> cost(columns * rows, std::numeric_limits<double>::infinity());
  const auto at = [&](NodeIndex node) -> double& {
    return cost[static_cast<size_t>(node.row) * columns + static_cast<size_t>(node.column)];
  };
  at(from) = 0;
  for (bool changed = true; changed;) {  // Bellman and Ford: slower, and simpler
    changed = false;
    for (int32_t row = 0; row < kMap.rows(); ++row) {
      for (int32_t column = 0; column < kMap.columns(); ++column) {
        for (int i = 0; i < 9; ++i) {
          const NodeIndex here{column, row};
          const NodeIndex next{column + i % 3 - 1, row + i / 3 - 1};
          const NodeIndex sides[] = {next, {next.column, row}, {column, next.row}};
          bool free = true;
          for (const NodeIndex side : sides) {
            free = free && side.column >= 0 && side.row >= 0 && side.column < kMap.columns() &&
                   side.row < kMap.rows() && !mask.Blocked(side);
          }
          const double step = std::hypot(next.column - column, next.row - row) * 1e5;
          if (free && at(here) + step < at(next) - 1) {
            at(next) = at(here) + step;
            changed = true;
          }
        }
      }
    }
  }
  return at(to);
}

TEST(Route, IsTheStraightLineWhereNothingIsInTheWay) {
  const std::vector<PointUm> straight{{1'000'000, 1'000'000}, {9'000'000, 5'000'000}};
  EXPECT_EQ(FindRoute(kMap, {}, straight[0], straight[1]).value(), straight);
  const auto aside = Walls({{{1'000'000, 5'000'000}, {2'000'000, 6'000'000}}});
  EXPECT_EQ(FindRoute(kMap, aside, straight[0], straight[1]).value(), straight);
}

TEST(Route, GoesAroundAWallAtItsClearance) {
  const auto wall = Walls({{{5'000'000, 0}, {5'200'000, 4'000'000}}});
  const PointUm from{1'000'000, 1'000'000};
  const PointUm to{9'000'000, 1'000'000};
  const auto route = FindRoute(kMap, wall, from, to);
  ASSERT_TRUE(route.ok()) << route.error();
  EXPECT_EQ(route.value().front(), from);
  EXPECT_EQ(route.value().back(), to);
  EXPECT_GE(NearestObstacle(route.value(), *wall), kRouteClearanceUm - 50'000);
  // Around the two upper corners of the wall, widened by the clearance, and a little more.
  const double around = std::hypot(3.7, 3.3) + 0.8 + std::hypot(3.5, 3.3);
  EXPECT_LT(LengthOf(route.value()) / 1e6, around + 0.5);
  EXPECT_LE(route.value().size(), 8u);
}

TEST(Route, TakesANarrowDoorOnlyIfThereIsNoOther) {
  const std::pair<PointUm, PointUm> lower{{5'000'000, 0}, {5'100'000, 2'000'000}};
  const std::pair<PointUm, PointUm> upper{{5'000'000, 2'400'000}, {5'100'000, 6'000'000}};
  const std::pair<PointUm, PointUm> less{{5'000'000, 2'400'000}, {5'100'000, 5'000'000}};
  const PointUm from{4'000'000, 2'200'000};
  const PointUm to{6'000'000, 2'200'000};
  const auto only = Walls({lower, upper});
  const auto through = FindRoute(kMap, only, from, to);
  ASSERT_TRUE(through.ok()) << through.error();
  EXPECT_LT(LengthOf(through.value()), 2'100'000);
  const auto wide = Walls({lower, less});
  const auto around = FindRoute(kMap, wide, from, to);
  ASSERT_TRUE(around.ok()) << around.error();
  EXPECT_GE(NearestObstacle(around.value(), *wide), kRouteClearanceUm - 50'000);
  EXPECT_GT(LengthOf(around.value()), 5'000'000);
}

TEST(Route, IsAtMostAsLongAsTheShortestOverTheNodes) {
  std::mt19937_64 random(5);
  int found = 0;
  for (int i = 0; i < 20; ++i) {
    ObstacleMask mask(kMap.columns(), kMap.rows());
    for (int block = 0; block < 60; ++block) {
      const auto column = static_cast<int32_t>(random() % 100);
      mask.BlockRow(static_cast<int32_t>(random() % 60), column, column + 8);
    }
    const NodeIndex from{2, 3};
    const NodeIndex to{95, 55};
    mask.Set(from, false);
    mask.Set(to, false);
    const double shortest = ShortestOverNodes(mask, from, to);
    const auto route = FindRoute(kMap, Shared(ObstacleMask(std::move(mask))), kMap.PositionOf(from),
                                 kMap.PositionOf(to), 0);
    ASSERT_EQ(route.ok(), std::isfinite(shortest));
    if (route.ok()) {
      ++found;
      EXPECT_LE(LengthOf(route.value()), shortest + 1e3);
    }
  }
  EXPECT_GE(found, 10);
}

TEST(Route, SaysWhyThereIsNone) {
  const auto box = Walls({{{4'000'000, 2'000'000}, {6'000'000, 2'100'000}},
                          {{4'000'000, 4'000'000}, {6'000'000, 4'100'000}},
                          {{4'000'000, 2'000'000}, {4'100'000, 4'100'000}},
                          {{6'000'000, 2'000'000}, {6'100'000, 4'100'000}}});
  const PointUm from{1'000'000, 1'000'000};
  EXPECT_EQ(FindRoute(kMap, box, from, {5'000'000, 3'000'000}).error(),
            "there is no way around the obstacles from (1, 1) m to (5, 3) m");
  EXPECT_EQ(FindRoute(kMap, box, from, {5'000'000, 2'050'000}).error(),
            "(5, 2.05) m is blocked by an obstacle");
  EXPECT_EQ(FindRoute(kMap, box, from, {10'000'001, 0}).error(),
            "(10.000001, 0) m is off the map: x from 0 to 10 m, y from 0 to 6 m");
  EXPECT_EQ(FindRoute(kMap, box, {-1, 0}, from).error(),
            "(-0.000001, 0) m is off the map: x from 0 to 10 m, y from 0 to 6 m");
}

TEST(Route, GivesUpOnALargeMaze) {
  const MapGeometry map{{0, 0}, 2'000'000'000, 2'000'000'000, 1'000'000};
  ObstacleMask mask(map.columns(), map.rows());
  mask.BlockRow(1000, 0, 2000);  // the map's whole width
  const auto route = FindRoute(map, Shared(std::move(mask)), {0, 0}, {0, 2'000'000'000});
  EXPECT_EQ(route.error(),
            "found no route from (0, 0) m to (0, 2000) m within 1000000 nodes of the map");
}

TEST(Route, ARobotBesideAWallMayLeaveIt) {
  const auto wall = Walls({{{5'000'000, 0}, {5'200'000, 4'000'000}}});
  const auto route = FindRoute(kMap, wall, {4'850'000, 1'000'000}, {5'350'000, 1'000'000});
  ASSERT_TRUE(route.ok()) << route.error();
  EXPECT_GT(LengthOf(route.value()), 6'000'000);
  // Its own node is blocked, since part of its square is.
  EXPECT_TRUE(FindRoute(kMap, wall, {4'960'000, 1'000'000}, {1'000'000, 1'000'000}).ok());
}

}  // namespace
}  // namespace pheromone::field
