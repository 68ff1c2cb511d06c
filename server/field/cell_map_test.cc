#include "server/field/cell_map.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

namespace pheromone::field {
namespace {

constexpr int32_t kColumns = 300;  // three leaves of 128 nodes a side
constexpr int32_t kRows = 200;

// A map and what it needs.
struct World {
  explicit World(uint64_t limit_bytes) : budget{limit_bytes, 0} {}
  MemoryBudget budget;
  TilePool pool;
  Reclaimer reclaimer;
  CellMap map{kColumns, kRows, &budget, &reclaimer, &pool};
};

uint64_t BytesOf(size_t tiles, size_t leaves) {
  return tiles * CellMap::kTileBytes + leaves * CellMap::kLeafBytes +
         CellMap::TopBytes(kColumns, kRows);
}

TEST(PackNode, KeepsTheLargestLevelAndTime) {
  for (const NodeState state :
       {NodeState{(1u << 22) - 1, kTimeMask}, NodeState{1, 0}, NodeState{64, 1'000'000'000'000}}) {
    EXPECT_EQ(UnpackNode(PackNode(state)), state);
  }
}

TEST(CellMap, RemembersWhatAnOrdinaryMapRemembers) {
  std::mt19937_64 random(1);
  World world(64 << 20);
  std::map<NodeIndex, NodeState> expected;
  for (int i = 0; i < 100'000; ++i) {
    const NodeIndex node{static_cast<int32_t>(random() % kColumns),
                         static_cast<int32_t>(random() % kRows)};
    ASSERT_EQ(world.map.Read(node), expected.contains(node) ? expected.at(node) : NodeState{});
    const NodeState state{static_cast<uint32_t>(random() % 3), random() & kTimeMask};
    ASSERT_TRUE(world.map.Write(node, state));
    if (state.level == 0) {
      expected.erase(node);
    } else {
      expected[node] = state;
    }
  }
  std::map<NodeIndex, NodeState> seen;
  world.map.ForEach(
      [&](NodeIndex node, NodeState state) { EXPECT_TRUE(seen.emplace(node, state).second); });
  EXPECT_EQ(seen, expected);
  EXPECT_EQ(world.map.node_count(), expected.size());
}

TEST(CellMap, KnowsTheNodesOfEachLeaf) {
  World world(64 << 20);
  const std::map<int32_t, NodeIndex> node_of_leaf = {
      {0, {127, 127}}, {1, {128, 127}}, {2, {299, 0}}, {3, {127, 128}}, {4, {128, 128}}};
  for (const auto& [leaf, node] : node_of_leaf) {
    world.map.Write(node, {64, 0});
  }
  ASSERT_EQ(world.map.leaf_count(), 6);
  for (int32_t leaf = 0; leaf < world.map.leaf_count(); ++leaf) {
    std::set<NodeIndex> seen;
    world.map.ForEachInLeaf(leaf, [&](NodeIndex node, NodeState) { seen.insert(node); });
    const bool used = node_of_leaf.contains(leaf);
    EXPECT_EQ(seen, used ? std::set{node_of_leaf.at(leaf)} : std::set<NodeIndex>{}) << leaf;
    EXPECT_EQ(world.map.tiles_in_leaf(leaf), used ? 1u : 0u);
  }
}

TEST(CellMap, MayBeEmptiedFromInsideOfAVisit) {
  World world(64 << 20);
  for (int32_t i = 0; i < 200; ++i) {
    world.map.Write({i, i}, {64, 0});
  }
  int visited = 0;
  world.map.ForEach([&](NodeIndex node, NodeState) {
    world.map.Write(node, {});
    ++visited;
  });
  EXPECT_EQ(visited, 200);
  EXPECT_EQ(world.map.node_count(), 0u);
  EXPECT_EQ(world.budget.used_bytes, BytesOf(0, 0));
}

TEST(CellMap, CountsTheMemoryOfItsTilesLeavesAndTopTable) {
  World world(64 << 20);
  EXPECT_EQ(world.budget.used_bytes, 0u);
  world.map.Write({0, 0}, {64, 0});
  EXPECT_EQ(world.budget.used_bytes, BytesOf(1, 1));
  world.map.Write({7, 7}, {64, 0});  // the same tile
  EXPECT_EQ(world.budget.used_bytes, BytesOf(1, 1));
  world.map.Write({8, 0}, {64, 0});
  EXPECT_EQ(world.budget.used_bytes, BytesOf(2, 1));
  world.map.Write({128, 0}, {64, 0});
  EXPECT_EQ(world.budget.used_bytes, BytesOf(3, 2));
  EXPECT_EQ(world.map.tile_count(), 3u);
}

TEST(CellMap, RefusesAnotherTileBeyondTheBudgetAndKeepsTheRest) {
  World world(BytesOf(2, 1));
  EXPECT_TRUE(world.map.Write({0, 0}, {64, 0}));
  EXPECT_TRUE(world.map.Write({8, 0}, {64, 0}));
  EXPECT_FALSE(world.map.Write({16, 0}, {64, 0}));
  EXPECT_FALSE(world.map.Write({128, 0}, {64, 0}));
  EXPECT_EQ(world.budget.used_bytes, BytesOf(2, 1));
  EXPECT_TRUE(world.map.Write({7, 7}, {64, 0}));
  EXPECT_EQ(world.map.Read({16, 0}).level, 0u);
  EXPECT_EQ(world.map.Read({8, 0}).level, 64u);
}

TEST(CellMap, TakesNothingForAFirstNodeThatDoesNotFit) {
  World world(BytesOf(1, 1) - 1);
  EXPECT_FALSE(world.map.Write({0, 0}, {64, 0}));
  EXPECT_EQ(world.budget.used_bytes, 0u);
}

TEST(CellMap, GivesBackTheTileOfItsLastNodeAndTheLeafOfItsLastTile) {
  World world(BytesOf(1, 1));
  ASSERT_TRUE(world.map.Write({3, 3}, {64, 0}));
  ASSERT_TRUE(world.map.Write({3, 3}, {}));
  EXPECT_EQ(world.budget.used_bytes, BytesOf(0, 0));
  EXPECT_TRUE(world.map.Write({100, 100}, {64, 0}));
}

TEST(CellMap, ForgettingWhatWasNeverThereCostsNothing) {
  World world(0);
  EXPECT_TRUE(world.map.Write({3, 3}, {}));
  EXPECT_EQ(world.map.tile_count(), 0u);
}

// A tile stays as it was for a reader that found it before its last node went.
TEST(CellMap, KeepsATileForAReaderThatFoundItBefore) {
  World world(64 << 20);
  world.map.Write({3, 3}, {64, 5});
  const int reader = world.reclaimer.Register();
  world.reclaimer.Enter(reader);
  const Tile* tile = world.map.FindLeaf(0, 0)->place[0].tile.load();
  world.map.Write({3, 3}, {});
  world.map.Write({4, 4}, {64, 6});
  EXPECT_NE(world.map.FindLeaf(0, 0)->place[0].tile.load(), tile);
  EXPECT_EQ(world.reclaimer.waiting(), 2u);  // the tile and the leaf
  world.reclaimer.Leave(reader);
  world.reclaimer.Collect();
  EXPECT_EQ(world.reclaimer.waiting(), 0u);
}

}  // namespace
}  // namespace pheromone::field
