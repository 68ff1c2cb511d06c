#include "server/core/field/edit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "server/core/field/field.h"
#include "server/core/field/testing/naive_law.h"
#include "server/core/field/testing/random_field.h"
#include "server/core/field/testing/trail_field.h"

namespace pheromone::field {
namespace {

using Action = FieldEdit::Action;
using Shape = FieldEdit::Shape;
using testing::Between;
using testing::BytesOf;
using testing::HashFromADump;
using testing::OneIn;
using testing::Random;
using testing::RandomPoint;
using testing::TrailConfig;
using testing::TrailLaw;
using testing::Wide;

std::set<NodeIndex> SetOf(const Result<std::vector<NodeIndex>>& nodes) {
  EXPECT_TRUE(nodes.ok());
  std::set<NodeIndex> set(nodes.value().begin(), nodes.value().end());
  EXPECT_EQ(set.size(), nodes.value().size()) << "a node twice";
  EXPECT_TRUE(
      std::is_sorted(nodes.value().begin(), nodes.value().end(), [](NodeIndex a, NodeIndex b) {
        return std::pair{a.row, a.column} < std::pair{b.row, b.column};
      }));
  return set;
}

// Whether `p` is within `radius` of the straight line from `a` to `b`: of its ends, or, where the
// foot of the perpendicular is between them, by Pythagoras.
bool IsWithin(PointUm p, PointUm a, PointUm b, int64_t radius) {
  const auto squared = [](PointUm from, PointUm to) {
    return Wide{to.x - from.x} * (to.x - from.x) + Wide{to.y - from.y} * (to.y - from.y);
  };
  const Wide limit = Wide{radius} * radius;
  const Wide side_a = squared(p, a);
  const Wide side_b = squared(p, b);
  const Wide length = squared(a, b);
  if (side_a <= limit || side_b <= limit) {
    return true;
  }
  const bool foot_between = side_a < side_b + length && side_b < side_a + length;
  const Wide along = side_a + length - side_b;  // twice the projection times the length
  return foot_between && 4 * side_a * length - along * along <= 4 * limit * length;
}

TEST(NodesOf, ARectangleHasItsEdgesWhicheverCornersAreGiven) {
  const MapGeometry map = TrailConfig().map;
  FieldEdit edit;
  edit.points = {{500'000, 200'000}, {299'999, 400'000}};
  EXPECT_EQ(SetOf(NodesOf(edit, map)),
            (std::set<NodeIndex>{
                {3, 2}, {4, 2}, {5, 2}, {3, 3}, {4, 3}, {5, 3}, {3, 4}, {4, 4}, {5, 4}}));
}

TEST(NodesOf, OnePointIsADisc) {
  const MapGeometry map = TrailConfig().map;
  FieldEdit edit;
  edit.shape = Shape::kStroke;
  edit.radius_um = 100'000;
  edit.points = {{500'000, 500'000}};
  EXPECT_EQ(SetOf(NodesOf(edit, map)),
            (std::set<NodeIndex>{{5, 4}, {4, 5}, {5, 5}, {6, 5}, {5, 6}}));
}

TEST(NodesOf, WhatLiesBesideTheMapHasNoNodes) {
  const MapGeometry map = TrailConfig().map;
  FieldEdit edit;
  edit.points = {{-500'000, -1}, {-1, 20'000'000}};
  EXPECT_TRUE(SetOf(NodesOf(edit, map)).empty());
  edit.points = {{10'000'001, 0}, {10'500'000, 10'000'000}};
  EXPECT_TRUE(SetOf(NodesOf(edit, map)).empty());
  edit.points = {{110'000, 110'000}, {190'000, 190'000}};  // between nodes
  EXPECT_TRUE(SetOf(NodesOf(edit, map)).empty());
}

TEST(NodesOf, RandomShapesHoldTheNodesThatAreInThem) {
  Random random(21);
  int64_t inside = 0;
  for (int i = 0; i < 2'000; ++i) {
    MapGeometry map;
    map.cell_um = Between(random, 10, 300'000);
    map.origin = {Between(random, -5'000'000, 5'000'000), Between(random, -5'000'000, 5'000'000)};
    map.width_um = Between(random, 0, 25 * map.cell_um);
    map.height_um = Between(random, 0, 25 * map.cell_um);
    FieldEdit edit;
    edit.shape = OneIn(random, 3) ? Shape::kRectangle : Shape::kStroke;
    edit.radius_um = Between(random, 0, 4 * map.cell_um);
    const size_t points = edit.shape == Shape::kRectangle ? 2 : 1 + random() % 4;
    while (edit.points.size() < points) {
      const int64_t beyond = 5 * map.cell_um;
      PointUm point{map.origin.x + Between(random, -beyond, map.width_um + beyond),
                    map.origin.y + Between(random, -beyond, map.height_um + beyond)};
      if (OneIn(random, 2)) {  // on a node
        point = {point.x - (point.x - map.origin.x) % map.cell_um,
                 point.y - (point.y - map.origin.y) % map.cell_um};
      }
      edit.points.push_back(point);
    }
    std::set<NodeIndex> expected;
    for (int32_t row = 0; row < map.rows(); ++row) {
      for (int32_t column = 0; column < map.columns(); ++column) {
        const PointUm at = map.PositionOf({column, row});
        bool in = false;
        if (edit.shape == Shape::kRectangle) {
          const PointUm a = edit.points[0];
          const PointUm b = edit.points[1];
          in = (at.x - a.x) * (at.x - b.x) <= 0 && (at.y - a.y) * (at.y - b.y) <= 0;
        } else {
          for (size_t p = 0; p < edit.points.size(); ++p) {
            in |= IsWithin(at, edit.points[p == 0 ? 0 : p - 1], edit.points[p], edit.radius_um);
          }
        }
        if (in) {
          expected.insert({column, row});
        }
      }
    }
    ASSERT_EQ(SetOf(NodesOf(edit, map)), expected) << i;
    inside += static_cast<int64_t>(expected.size());
  }
  EXPECT_GE(inside, 50'000);
}

// On a map of 3000 km, where the squares of products of distances need 161 bits.
TEST(NodesOf, AStrokeIsExactOnTheLargestMap) {
  constexpr int64_t kKm = 1'000'000'000;
  const MapGeometry map{{0, 0}, 3'000 * kKm, 3'000 * kKm, kKm};
  FieldEdit edit;
  edit.shape = Shape::kStroke;
  edit.points = {{0, 0}, {3'000 * kKm, 1'000 * kKm}};
  // Node (column, row) is |column - 3 row| / sqrt(10) km from the line, so two beside it in a row
  // are within 0.9 km, of which the third is 0.949 km away.
  edit.radius_um = 900'000'000;
  const std::set<NodeIndex> nodes = SetOf(NodesOf(edit, map));
  for (int32_t row = 10; row < 990; ++row) {
    for (int32_t column = 3 * row - 4; column <= 3 * row + 4; ++column) {
      ASSERT_EQ(nodes.contains({column, row}), std::abs(column - 3 * row) <= 2)
          << column << ", " << row;
    }
  }
}

TEST(NodesOf, SaysWhatIsWrong) {
  MapGeometry map = TrailConfig().map;
  FieldEdit edit;
  edit.points = {{0, 0}};
  EXPECT_NE(NodesOf(edit, map).error().find("points"), std::string::npos);
  edit.shape = Shape::kStroke;
  edit.points = {};
  EXPECT_FALSE(NodesOf(edit, map).ok());
  edit.points = {{0, 0}};
  edit.radius_um = -1;
  EXPECT_FALSE(NodesOf(edit, map).ok());
  map.cell_um = 1'000;  // 10 001 x 10 001 nodes
  edit.shape = Shape::kAll;
  edit.radius_um = 0;
  EXPECT_NE(NodesOf(edit, map).error().find("parts"), std::string::npos);
}

TEST(NodesOf, AsManyAsAnEditMayTouchAndNotOneMore) {
  MapGeometry map = TrailConfig().map;
  map.cell_um = 1'000;
  FieldEdit edit;
  edit.points = {{0, 0}, {4'095'000, 4'095'000}};
  EXPECT_EQ(NodesOf(edit, map).value().size(), static_cast<size_t>(kMaxNodesOfEdit));
  edit.points = {{0, 0}, {4'095'000, 4'096'000}};
  EXPECT_NE(NodesOf(edit, map).error().find("parts"), std::string::npos);
}

FieldEdit Square(Action action, uint32_t level) {
  FieldEdit edit;
  edit.action = action;
  edit.level = level;
  edit.points = {{0, 0}, {200'000, 200'000}};  // nine nodes
  return edit;
}

TEST(Edit, SetsAddsUpToTheMaximumAndErases) {
  Field field(TrailConfig());
  field.Deposit(1, {100'000, 100'000}, 8, 0);
  ASSERT_TRUE(field.Edit(Square(Action::kSet, 128), 10).ok());
  EXPECT_EQ(field.LevelOf(1, {1, 1}, 10), 128u);
  EXPECT_EQ(field.node_count(), 9u);
  ASSERT_TRUE(field.Edit(Square(Action::kAdd, 300), 20).ok());
  EXPECT_EQ(field.LevelOf(1, {2, 2}, 20), 428u);
  ASSERT_TRUE(field.Edit(Square(Action::kAdd, UINT32_MAX), 30).ok());
  EXPECT_EQ(field.LevelOf(1, {0, 0}, 30), TrailLaw().max_level());
  ASSERT_TRUE(field.Edit(Square(Action::kErase, 7), 40).ok());
  EXPECT_EQ(field.node_count(), 0u);
  EXPECT_EQ(HashFromADump(field), field.hash());
}

TEST(Edit, WhatIsSetEvaporatesFromThen) {
  Field field(TrailConfig());
  ASSERT_TRUE(field.Edit(Square(Action::kSet, 128), 1'000).ok());
  EXPECT_EQ(field.LevelOf(1, {1, 1}, 30'999), 128u);
  EXPECT_EQ(field.LevelOf(1, {1, 1}, 31'000), 64u);
}

TEST(Edit, ErasingTheWholeMapNeedsNoParts) {
  FieldConfig config = TrailConfig();
  config.map.cell_um = 1'000;
  Field field(config);
  Random random(1);
  for (int i = 0; i < 500; ++i) {
    field.Deposit(1, RandomPoint(random, config.map), 1, 0);
  }
  FieldEdit edit;
  edit.shape = Shape::kAll;
  edit.action = Action::kErase;
  ASSERT_TRUE(field.Edit(edit, 0).ok());
  EXPECT_EQ(field.node_count(), 0u);
  EXPECT_EQ(field.used_bytes(), BytesOf(config.map, 0, 0));
  EXPECT_EQ(HashFromADump(field), field.hash());
}

TEST(Edit, LeavesBlockedNodesAlone) {
  FieldConfig config = TrailConfig();
  ObstacleMask mask(config.map.columns(), config.map.rows());
  mask.Set({1, 1});
  config.obstacles = Shared<ObstacleMask>(std::move(mask));
  Field field(config);
  ASSERT_TRUE(field.Edit(Square(Action::kSet, 64), 0).ok());
  EXPECT_EQ(field.node_count(), 8u);
  EXPECT_EQ(field.LevelOf(1, {1, 1}, 0), 0u);
}

// An obstacle may have come where something permanent lay.
TEST(Edit, ErasesWhatLiesUnderAnObstacle) {
  FieldConfig config = TrailConfig();
  config.pheromones[0].tau_ms = 0;
  Field field(config);
  field.Deposit(1, {100'000, 100'000}, 8, 0);
  ObstacleMask mask(config.map.columns(), config.map.rows());
  mask.Set({1, 1});
  config.obstacles = Shared<ObstacleMask>(std::move(mask));
  field.Reconfigure(config, 0);
  EXPECT_EQ(field.LevelOf(1, {1, 1}, 0), 8 * kLevelsPerQuantum);
  ASSERT_TRUE(field.Edit(Square(Action::kErase, 0), 0).ok());
  EXPECT_EQ(field.node_count(), 0u);
}

TEST(Edit, SaysWhyItCannot) {
  FieldConfig config = TrailConfig();
  PheromoneLaw blend;
  blend.type = 2;
  blend.blend = {{1, 1000}};
  config.pheromones.push_back(blend);
  Field field(config);
  FieldEdit edit = Square(Action::kSet, 64);
  edit.type = 9;
  EXPECT_NE(field.Edit(edit, 0).error().find("type 9 is not configured"), std::string::npos);
  edit.type = 2;
  EXPECT_NE(field.Edit(edit, 0).error().find("blend"), std::string::npos);
  edit.type = 1;
  edit.points.clear();
  EXPECT_FALSE(field.Edit(edit, 0).ok());
}

// A map with room for three of the tiles: half of the edits do not fit, and leave no trace.
TEST(Edit, IsAllOrNothing) {
  Random random(33);
  FieldConfig config = TrailConfig();
  config.memory_bytes = BytesOf(config.map, 3, 1);
  config.pheromones[0].tau_ms = 0;
  int refused = 0;
  int done = 0;
  for (int round = 0; round < 400; ++round) {
    Field field(config);
    for (int i = 0; i < 10; ++i) {
      field.Deposit(1, RandomPoint(random, config.map), 3, 0);
    }
    std::map<NodeIndex, NodeState> before;
    field.ForEach([&](uint8_t, NodeIndex node, NodeState state) { before[node] = state; });
    const uint64_t hash = field.hash();
    const uint64_t bytes = field.used_bytes();
    FieldEdit edit;
    edit.shape = Shape::kStroke;
    edit.action = OneIn(random, 2) ? Action::kSet : Action::kAdd;
    edit.level = static_cast<uint32_t>(Between(random, 1, 600));
    edit.radius_um = Between(random, 0, 200'000);
    const PointUm start = before.begin()->first.column != 0
                              ? config.map.PositionOf(before.begin()->first)
                              : RandomPoint(random, config.map);
    edit.points = {start, {start.x + Between(random, -400'000, 400'000), start.y}};
    if (field.Edit(edit, 50).ok()) {
      ++done;
    } else {
      ++refused;
      std::map<NodeIndex, NodeState> after;
      field.ForEach([&](uint8_t, NodeIndex node, NodeState state) { after[node] = state; });
      ASSERT_EQ(after, before);
      ASSERT_EQ(field.hash(), hash);
      ASSERT_EQ(field.used_bytes(), bytes);
    }
    ASSERT_EQ(HashFromADump(field), field.hash());
  }
  EXPECT_GE(done, 50);
  EXPECT_GE(refused, 50);
}

}  // namespace
}  // namespace pheromone::field
