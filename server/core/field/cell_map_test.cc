#include "server/core/field/cell_map.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>
#include <string>

#include "server/core/field/frozen_cells.h"

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

// --- Clear.

// Fills a map as a random one is filled; some nodes go again.
void Scatter(CellMap* map, uint64_t seed) {
  std::mt19937_64 random(seed);
  for (int i = 0; i < 3'000; ++i) {
    const NodeIndex node{static_cast<int32_t>(random() % kColumns),
                         static_cast<int32_t>(random() % kRows)};
    map->Write(node, {static_cast<uint32_t>(random() % 4), random() & kTimeMask});
  }
}

void ForgetEach(CellMap* map) {
  map->ForEach([map](NodeIndex node, NodeState) { map->Write(node, {}); });
}

std::string Saved(const CellMap& map) {
  ByteWriter writer;
  map.Save(&writer);
  return writer.Take();
}

TEST(CellMap, ClearLeavesWhatForgettingEachNodeLeaves) {
  World cleared(64 << 20);
  World forgotten(64 << 20);
  for (uint64_t seed = 1; seed < 5; ++seed) {
    Scatter(&cleared.map, seed);
    Scatter(&forgotten.map, seed);
    ASSERT_EQ(cleared.budget.used_bytes, forgotten.budget.used_bytes);
    cleared.map.Clear();
    ForgetEach(&forgotten.map);
    EXPECT_EQ(cleared.budget.used_bytes, forgotten.budget.used_bytes);
    EXPECT_EQ(cleared.budget.used_bytes, BytesOf(0, 0));
    EXPECT_EQ(cleared.map.node_count(), 0u);
    EXPECT_EQ(cleared.map.tile_count(), 0u);
    EXPECT_EQ(cleared.map.tiles_in_leaf(0), 0u);
    EXPECT_EQ(cleared.map.Read({3, 3}), NodeState{});
    EXPECT_EQ(Saved(cleared.map), Saved(forgotten.map));
    EXPECT_TRUE(cleared.map.Write({3, 3}, {}));
    cleared.map.Clear();  // of nothing
  }
  EXPECT_EQ(cleared.budget.used_bytes, BytesOf(0, 0));
}

TEST(CellMap, WhatWasClearedIsGivenBackInPortions) {
  World world(64 << 20);
  for (int32_t column = 0; column < kColumns; column += kTileSide) {
    for (int32_t row = 0; row < kRows; row += kTileSide) {
      world.map.Write({column, row}, {64, 0});
    }
  }
  const auto tiles = static_cast<int>(world.map.tile_count());
  world.map.Clear();
  int portions = 0;
  for (; world.pool.has_garbage(); ++portions) {
    world.pool.ReleaseSome(100);
  }
  EXPECT_GE(portions, tiles / 100);
  EXPECT_LE(portions, tiles / 100 + 100);
}

// So memory that is taken again comes from what was given up, and both together do not grow.
TEST(CellMap, TakingATileReleasesTwoOfWhatWasCleared) {
  World world(64 << 20);
  constexpr int32_t kTiles = 16 * 16;
  for (int32_t i = 0; i < kTiles; ++i) {
    world.map.Write({i % 16 * kTileSide, i / 16 * kTileSide}, {64, 0});
  }
  world.map.Clear();
  ASSERT_TRUE(world.pool.has_garbage());
  int32_t taken = 0;
  for (; world.pool.has_garbage() && taken < kTiles; ++taken) {
    world.map.Write({taken % 16 * kTileSide, taken / 16 * kTileSide}, {64, 0});
  }
  EXPECT_LE(taken, kTiles / 2);
}

TEST(CellMap, WhatWasClearedStaysForAReaderThatFoundItBefore) {
  World world(64 << 20);
  world.map.Write({3, 3}, {64, 5});
  const int reader = world.reclaimer.Register();
  world.reclaimer.Enter(reader);
  const CellMap::Leaf* leaf = world.map.FindLeaf(0, 0);
  world.map.Clear();
  EXPECT_EQ(world.map.FindLeaf(0, 0), nullptr);
  world.map.Write({3, 3}, {64, 6});
  world.pool.ReleaseSome(1'000);
  EXPECT_EQ(UnpackNode(leaf->place[0].tile.load()->word[27].load()), (NodeState{64, 5}));
  EXPECT_FALSE(world.pool.has_garbage());
  world.reclaimer.Leave(reader);
  world.reclaimer.Collect();
  EXPECT_TRUE(world.pool.has_garbage());
  world.pool.ReleaseSome(1'000);
  EXPECT_FALSE(world.pool.has_garbage());
}

// A copy reads on in what was cleared, and what it has copied is released before it ends.
TEST(CellMap, WhatWasClearedStaysForACopyUntilItIsCopied) {
  World world(64 << 20);
  Scatter(&world.map, 9);
  const std::string expected = Saved(world.map);
  KeptBytes kept{{1 << 20, 0}};
  std::unique_ptr<FrozenCells> frozen = world.map.Freeze(&kept);
  world.map.Clear();
  EXPECT_EQ(world.pool.chunks(), 1u);
  std::string copied;
  frozen->CopySome(1, &copied);
  world.pool.ReleaseSome(100'000);
  EXPECT_TRUE(world.pool.has_garbage());
  Scatter(&world.map, 10);
  while (!frozen->done()) {
    frozen->CopySome(1, &copied);
    world.pool.ReleaseSome(100'000);
  }
  EXPECT_EQ(copied, expected);
  EXPECT_FALSE(kept.failed);
  EXPECT_EQ(kept.budget.used_bytes, 0u);
  world.pool.ReleaseSome(100'000);
  EXPECT_FALSE(world.pool.has_garbage());
  // And a copy that is given up is in nobody's way.
  frozen = world.map.Freeze(&kept);
  world.map.Clear();
  frozen.reset();
  world.pool.ReleaseSome(100'000);
  EXPECT_FALSE(world.pool.has_garbage());
}

}  // namespace
}  // namespace pheromone::field
