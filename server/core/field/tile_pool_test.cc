#include "server/core/field/tile_pool.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <random>
#include <set>
#include <vector>

namespace pheromone::field {
namespace {

constexpr size_t kTilesOfAChunk = TilePool::kTilesPerChunk;

bool IsZero(const Tile& tile) {
  for (const auto& word : tile.word) {
    if (word.load() != 0) {
      return false;
    }
  }
  return true;
}

void Scribble(Tile* tile, uint64_t what) {
  for (auto& word : tile->word) {
    word.store(what);
  }
}

bool Holds(const Tile& tile, uint64_t what) {
  for (const auto& word : tile.word) {
    if (word.load() != what) {
      return false;
    }
  }
  return true;
}

TEST(TilePool, HandsOutTilesOfZerosOnCacheLinesOfTheirOwn) {
  TilePool pool;
  Tile* first = pool.Take();
  EXPECT_EQ(reinterpret_cast<uintptr_t>(first) % 64, 0u);
  EXPECT_TRUE(IsZero(*first));
  Scribble(first, UINT64_MAX);
  pool.Give(first);
  Tile* again = pool.Take();
  EXPECT_TRUE(IsZero(*again));
  pool.Give(again);
}

TEST(TilePool, FillsAChunkBeforeItTakesAnother) {
  TilePool pool;
  EXPECT_EQ(pool.chunks(), 0u);
  std::vector<Tile*> tiles;
  for (size_t i = 0; i < kTilesOfAChunk; ++i) {
    tiles.push_back(pool.Take());
    EXPECT_EQ(pool.chunks(), 1u);
  }
  tiles.push_back(pool.Take());
  EXPECT_EQ(pool.chunks(), 2u);
  for (Tile* tile : tiles) {
    pool.Give(tile);
  }
}

TEST(TilePool, GivesChunksBackButForOne) {
  TilePool pool;
  std::vector<Tile*> tiles;
  for (size_t i = 0; i < 10 * kTilesOfAChunk; ++i) {
    tiles.push_back(pool.Take());
  }
  EXPECT_EQ(pool.chunks(), 10u);
  for (Tile* tile : tiles) {
    pool.Give(tile);
  }
  EXPECT_EQ(pool.chunks(), 1u);
}

// Chunks fill up and empty in every order: no tile is given twice, none is overwritten.
TEST(TilePool, KeepsTilesApart) {
  std::mt19937 random(6);
  TilePool pool;
  std::map<Tile*, uint64_t> held;
  std::vector<Tile*> order;
  uint64_t next = 1;
  for (int i = 0; i < 300'000; ++i) {
    // Fill and empty by turns, up to some three chunks.
    const bool filling = i / 30'000 % 2 == 0;
    if (order.empty() || random() % 10 < (filling ? 7u : 3u)) {
      Tile* tile = pool.Take();
      ASSERT_TRUE(IsZero(*tile));
      ASSERT_TRUE(held.emplace(tile, next).second);
      order.push_back(tile);
      Scribble(tile, next++);
    } else {
      std::swap(order[random() % order.size()], order.back());
      Tile* tile = order.back();
      order.pop_back();
      ASSERT_TRUE(Holds(*tile, held.at(tile)));
      held.erase(tile);
      pool.Give(tile);
    }
    ASSERT_LE(held.size(), pool.chunks() * kTilesOfAChunk);
  }
  for (Tile* tile : order) {
    pool.Give(tile);
  }
  EXPECT_EQ(pool.chunks(), 1u);
}

}  // namespace
}  // namespace pheromone::field
