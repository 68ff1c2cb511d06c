#include "server/core/field/diffusion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "server/base/hash.h"

namespace pheromone::field {
namespace {

__extension__ using Int128 = __int128;

constexpr uint64_t kPlenty = uint64_t{1} << 30;
constexpr uint32_t kMax = DiffusionLayer::kMaxContent;
constexpr uint32_t kQuantum = 65536;
constexpr uint32_t kThree = 3 * kQuantum;

// A layer and what it needs.
struct World {  // NOLINT(clang-analyzer-optin.performance.Padding)
  World(int32_t columns, int32_t rows, uint64_t limit_bytes = kPlenty,
        const DiffusionKernel& kernel = BestDiffusionKernel())
      : budget{limit_bytes, 0}, layer(columns, rows, &budget, &reclaimer, &pool, kernel) {}

  MemoryBudget budget;
  TilePool pool;
  Reclaimer reclaimer;
  DiffusionLayer layer;
};

DiffusionLaw Law(uint32_t exchange_q16, uint32_t keep_q32 = 0, uint32_t cutoff_q16 = 0) {
  DiffusionLaw law;
  law.exchange_q16 = exchange_q16;
  law.keep_q32 = keep_q32;
  law.cutoff_q16 = cutoff_q16;
  return law;
}

// The definition, read literally: a dense array, one edge after the other.
class Oracle {
 public:
  Oracle(int32_t columns, int32_t rows)
      : columns_(columns),
        rows_(rows),
        value_(static_cast<size_t>(columns) * static_cast<size_t>(rows)) {}

  int64_t& At(NodeIndex node) { return value_[IndexOf(node)]; }

  void Step(const DiffusionLaw& law, const ObstacleMask* obstacles) {
    const auto blocked = [&](NodeIndex n) { return obstacles != nullptr && obstacles->Blocked(n); };
    std::vector<int64_t> next = value_;
    const auto flow = [&](NodeIndex i, NodeIndex j) {
      if (j.column >= columns_ || j.row >= rows_ || blocked(i) || blocked(j)) {
        return;
      }
      const auto amount = static_cast<int64_t>(Int128{At(i) - At(j)} * law.exchange_q16 / 65536);
      next[IndexOf(i)] -= amount;
      next[IndexOf(j)] += amount;
    };
    for (int32_t row = 0; row < rows_; ++row) {
      for (int32_t column = 0; column < columns_; ++column) {
        flow({column, row}, {column + 1, row});
        flow({column, row}, {column, row + 1});
      }
    }
    for (int64_t& v : next) {
      const int64_t kept =
          law.keep_q32 == 0 ? v : static_cast<int64_t>(Int128{v} * law.keep_q32 >> 32);
      const int64_t cut = kept < law.cutoff_q16 ? kept : 0;
      evaporated += static_cast<uint64_t>(v - kept);
      cut_off += static_cast<uint64_t>(cut);
      v = kept - cut;
    }
    value_ = next;
  }

  std::map<NodeIndex, uint32_t> Contents() {
    std::map<NodeIndex, uint32_t> contents;
    for (int32_t row = 0; row < rows_; ++row) {
      for (int32_t column = 0; column < columns_; ++column) {
        if (const int64_t v = At({column, row}); v != 0) {
          contents[{column, row}] = static_cast<uint32_t>(v);
        }
      }
    }
    return contents;
  }

  uint64_t evaporated = 0;
  uint64_t cut_off = 0;

 private:
  size_t IndexOf(NodeIndex node) const {
    const int32_t index = node.row * columns_ + node.column;
    return static_cast<size_t>(index);
  }

  int32_t columns_;
  int32_t rows_;
  std::vector<int64_t> value_;
};

std::map<NodeIndex, uint32_t> ContentsOf(const DiffusionLayer& layer) {
  std::map<NodeIndex, uint32_t> contents;
  layer.ForEach([&](NodeIndex node, uint32_t content) {
    EXPECT_TRUE(contents.emplace(node, content).second);
  });
  return contents;
}

// The sum of what the nodes hold is worked out anew, not taken from the layer.
void ExpectBalanced(const DiffusionLayer& layer) {
  uint64_t sum = 0;
  layer.ForEach([&](NodeIndex, uint32_t content) { sum += content; });
  const DiffusionTotals& totals = layer.totals();
  EXPECT_EQ(totals.sum, sum);
  EXPECT_EQ(sum + totals.evaporated + totals.lost, totals.deposited);
}

class Random {
 public:
  explicit Random(uint32_t seed) : engine_(seed) {}

  uint32_t Below(uint32_t limit) { return static_cast<uint32_t>(engine_() % limit); }
  NodeIndex Node(int32_t columns, int32_t rows) {
    return {static_cast<int32_t>(Below(static_cast<uint32_t>(columns))),
            static_cast<int32_t>(Below(static_cast<uint32_t>(rows)))};
  }
  /// Of every magnitude, and those on which arithmetic breaks.
  uint32_t Content() {
    const uint32_t special[] = {1, 3, 4, 65535, 65536, kMax - 1, kMax};
    const uint32_t choice = Below(16);
    return choice < std::size(special) ? special[choice] : Below(UINT32_MAX) >> (1 + Below(31));
  }
  template <size_t kCount>
  uint32_t OneOf(const uint32_t (&numbers)[kCount]) {
    return numbers[Below(kCount)];
  }

 private:
  std::mt19937 engine_;
};

class EachKernel : public testing::TestWithParam<const DiffusionKernel*> {};

std::vector<const DiffusionKernel*> AllKernels() {
  const DiffusionKernelList list = DiffusionKernels();
  return {list.kernel, list.kernel + list.count};
}
INSTANTIATE_TEST_SUITE_P(DiffusionKernel, EachKernel, testing::ValuesIn(AllKernels()),
                         [](const auto& test) { return std::string(test.param->name); });

TEST_P(EachKernel, ComputesTheDefinitionToTheBit) {
  Random random(1);
  const uint32_t exchanges[] = {0, 1, 2, 655, 8191, 16383, 16384};
  const uint32_t keeps[] = {0, 1, 1u << 31, 4'290'672'328, UINT32_MAX};
  const uint32_t cutoffs[] = {0, 1, 2, 1000, 1u << 20, kMax, kMax + 1u, UINT32_MAX};
  for (int round = 0; round < 400; ++round) {
    // Sizes on both sides of the borders of tiles and leaves.
    const int32_t columns = round % 50 == 0 ? 150 : 1 + random.Node(40, 40).column;
    const int32_t rows = round % 50 == 0 ? 130 : 1 + random.Node(40, 40).column;
    World world(columns, rows, kPlenty, *GetParam());
    Oracle oracle(columns, rows);
    ObstacleMask obstacles(columns, rows);
    const bool walled = round % 2 == 0;
    for (uint32_t i = random.Below(200); walled && i > 0; --i) {
      obstacles.Set(random.Node(columns, rows));
    }
    const uint32_t deposits = 1 + random.Below(round % 3 == 0 ? 4000 : 20);
    for (uint32_t i = 0; i < deposits; ++i) {
      const NodeIndex node = random.Node(columns, rows);
      const uint32_t content = random.Content();
      ASSERT_TRUE(world.layer.Set(node, content));  // on a blocked node, too
      oracle.At(node) = content;
    }
    const uint64_t lost_before = world.layer.totals().lost;
    const DiffusionLaw law =
        Law(random.OneOf(exchanges), random.Below(2) == 0 ? 0 : random.OneOf(keeps),
            random.Below(2) == 0 ? 0 : random.OneOf(cutoffs));
    for (int step = 0; step < 12; ++step) {
      world.layer.Step(law, walled ? &obstacles : nullptr);
      oracle.Step(law, walled ? &obstacles : nullptr);
      ASSERT_EQ(ContentsOf(world.layer), oracle.Contents())
          << "round " << round << ", step " << step << ", " << columns << " x " << rows << ", x "
          << law.exchange_q16 << ", k " << law.keep_q32 << ", cutoff " << law.cutoff_q16;
    }
    EXPECT_EQ(world.layer.totals().evaporated, oracle.evaporated);
    EXPECT_EQ(world.layer.totals().lost - lost_before, oracle.cut_off);
    ExpectBalanced(world.layer);
  }
}

TEST_P(EachKernel, ExchangesAtTheLimitNeverLeaveTheRangeOfTheNeighbours) {
  World world(32, 32, kPlenty, *GetParam());
  for (int32_t row = 0; row < 32; ++row) {
    for (int32_t column = 0; column < 32; ++column) {
      world.layer.Set({column, row}, (column + row) % 2 == 0 ? kMax : 0);
    }
  }
  for (int step = 0; step < 50; ++step) {
    world.layer.Step(Law(16384), nullptr);
    world.layer.ForEach([](NodeIndex, uint32_t content) { ASSERT_LE(content, kMax); });
    ExpectBalanced(world.layer);
  }
}

TEST(DiffusionLayer, NothingIsCreatedOrLostInAHundredThousandSteps) {
  World world(21, 19);
  Random random(2);
  for (int i = 0; i < 40; ++i) {
    world.layer.Add(random.Node(21, 19), random.Content(), kMax);
  }
  const uint64_t sum = world.layer.totals().sum;
  for (int step = 0; step < 100'000; ++step) {
    world.layer.Step(Law(3000), nullptr);
  }
  ExpectBalanced(world.layer);
  EXPECT_EQ(world.layer.totals().sum, sum);
  EXPECT_EQ(world.layer.totals().evaporated, 0u);
}

TEST(DiffusionLayer, ItsAccountsBalanceWhileRobotsDepositAndPheromoneEvaporates) {
  World world(70, 70);
  Random random(3);
  for (int step = 0; step < 100'000; ++step) {
    if (step % 50 == 0) {
      world.layer.Add(random.Node(70, 70), random.Content(), 1u << 26);
    }
    world.layer.Step(Law(8000, 3'900'000'000, 100), nullptr);
    if (step % 1000 == 0) {
      ExpectBalanced(world.layer);
    }
  }
  EXPECT_GT(world.layer.totals().evaporated, 0u);
  EXPECT_GT(world.layer.totals().lost, 0u);
}

TEST(DiffusionLayer, ASymmetricBlobStaysSymmetric) {
  World world(33, 33);
  world.layer.Set({16, 16}, 1'000'000'007);
  for (int step = 0; step < 300; ++step) {
    world.layer.Step(Law(11'111, 4'290'000'000, 3), nullptr);
  }
  ASSERT_GT(world.layer.totals().sum, 0u);
  for (int32_t row = 0; row < 33; ++row) {
    for (int32_t column = 0; column < 33; ++column) {
      const uint32_t content = world.layer.Read({column, row});
      ASSERT_EQ(content, world.layer.Read({32 - column, row}));
      ASSERT_EQ(content, world.layer.Read({column, 32 - row}));
      ASSERT_EQ(content, world.layer.Read({row, column}));
    }
  }
}

// For the exact stencil, sum(v x^2) / sum(v) grows by 2 * exchange / 65 536 in each step. Rounding
// holds back less than one unit on each edge: of 2^31, next to nothing in these steps.
TEST(DiffusionLayer, TheVarianceOfABlobGrowsByTwiceTheExchangeInEachStep) {
  World world(201, 201);
  world.layer.Set({100, 100}, kMax);
  constexpr int kSteps = 40;
  constexpr uint32_t kExchange = 6554;
  for (int step = 0; step < kSteps; ++step) {
    world.layer.Step(Law(kExchange), nullptr);
  }
  double along_columns = 0;
  double along_rows = 0;
  world.layer.ForEach([&](NodeIndex node, uint32_t content) {
    along_columns += content * std::pow(node.column - 100, 2);
    along_rows += content * std::pow(node.row - 100, 2);
  });
  const double expected = kSteps * 2 * kExchange / 65536.0;
  EXPECT_NEAR(along_columns / kMax, expected, expected * 1e-3);
  EXPECT_NEAR(along_rows / kMax, expected, expected * 1e-3);
}

TEST(DiffusionLayer, ASealedBoxKeepsWhatIsInItAndNothingElseGetsIn) {
  World world(64, 64);
  ObstacleMask box(64, 64);
  for (int32_t i = 20; i <= 40; ++i) {
    for (const NodeIndex node : {NodeIndex{i, 20}, {i, 40}, {20, i}, {40, i}}) {
      box.Set(node);
    }
  }
  world.layer.Set({30, 30}, 1u << 30);
  world.layer.Set({5, 5}, 1u << 29);
  for (int step = 0; step < 5000; ++step) {
    world.layer.Step(Law(16'000), &box);
  }
  uint64_t inside = 0;
  world.layer.ForEach([&](NodeIndex node, uint32_t content) {
    EXPECT_FALSE(box.Blocked(node));
    const bool in = node.column > 20 && node.column < 40 && node.row > 20 && node.row < 40;
    inside += in ? content : 0;
  });
  EXPECT_EQ(inside, uint64_t{1} << 30);
  EXPECT_NE(world.layer.Read({39, 21}), 0u);  // into its corners
  EXPECT_NE(world.layer.Read({63, 63}), 0u);  // and around it
}

TEST(DiffusionLayer, WhatIsBelowTheCutOffIsLostAndCounted) {
  World world(20, 20);
  world.layer.Set({3, 3}, 999);
  world.layer.Set({15, 15}, 1000);
  world.layer.Step(Law(0, 0, 1000), nullptr);
  EXPECT_EQ(world.layer.Read({3, 3}), 0u);
  EXPECT_EQ(world.layer.Read({15, 15}), 1000u);
  EXPECT_EQ(world.layer.totals().lost, 999u);
  EXPECT_EQ(world.layer.totals().evaporated, 0u);
}

TEST(DiffusionLayer, ADepositStopsAtTheMaximumAndTheRestIsLost) {
  World world(10, 10);
  ASSERT_TRUE(world.layer.Add({1, 1}, kThree, 5 * kQuantum));
  ASSERT_TRUE(world.layer.Add({1, 1}, kThree, 5 * kQuantum));
  EXPECT_EQ(world.layer.Read({1, 1}), 5 * kQuantum);
  ASSERT_TRUE(world.layer.Add({1, 1}, kQuantum, 2 * kQuantum));  // the law has changed since
  EXPECT_EQ(world.layer.Read({1, 1}), 5 * kQuantum);
  ASSERT_TRUE(world.layer.Add({1, 1}, UINT64_MAX / 2, UINT32_MAX));
  EXPECT_EQ(world.layer.Read({1, 1}), kMax);
  ASSERT_TRUE(world.layer.Set({1, 1}, kQuantum));
  ExpectBalanced(world.layer);
}

TEST(DiffusionLayer, WithoutMemoryTheBorderIsAWallAndADepositIsRefused) {
  // Room for one tile of a map of one leaf.
  const uint64_t one_tile =
      CellMap::TopBytes(64, 64) + DiffusionLayer::kLeafBytes + DiffusionLayer::kTileBytes;
  World world(64, 64, one_tile);
  ASSERT_TRUE(world.layer.Set({8, 8}, 1u << 30));
  EXPECT_FALSE(world.layer.Set({7, 8}, 1));
  EXPECT_FALSE(world.layer.Add({7, 8}, 1, kMax));
  ExpectBalanced(world.layer);
  Oracle oracle(64, 64);
  ObstacleMask around(64, 64);
  for (int32_t row = 0; row < 64; ++row) {
    for (int32_t column = 0; column < 64; ++column) {
      around.Set({column, row}, column / 8 != 1 || row / 8 != 1);
    }
  }
  oracle.At({8, 8}) = 1u << 30;
  for (int step = 0; step < 100; ++step) {
    world.layer.Step(Law(10'000), nullptr);
    oracle.Step(Law(10'000), &around);
  }
  EXPECT_EQ(ContentsOf(world.layer), oracle.Contents());
  EXPECT_GT(world.layer.refused_tiles(), 0u);
  ExpectBalanced(world.layer);

  // When there is memory again, it goes on.
  world.budget.limit_bytes = kPlenty;
  world.layer.Step(Law(10'000), nullptr);
  EXPECT_NE(world.layer.Read({7, 8}), 0u);
}

TEST(DiffusionLayer, TheLastMemoryGoesToTheLowestTileHoweverTheMapWasFilled) {
  for (const bool backwards : {false, true}) {
    World world(300, 300);
    std::vector<NodeIndex> nodes = {{20, 20}, {20, 150}, {150, 20}, {280, 280}};
    if (backwards) {
      std::reverse(nodes.begin(), nodes.end());
    }
    for (const NodeIndex node : nodes) {
      world.layer.Set(node, 0);
      world.layer.Set({node.column / 8 * 8, node.row / 8 * 8 + 4}, kMax);  // next to the left tile
    }
    world.budget.limit_bytes = world.budget.used_bytes + DiffusionLayer::kTileBytes;
    world.layer.Step(Law(16'384), nullptr);
    EXPECT_NE(world.layer.Read({15, 20}), 0u);
    EXPECT_EQ(world.layer.refused_tiles(), 3u);
  }
}

TEST(DiffusionLayer, EveryByteIsReturnedWhenAllHasEvaporated) {
  World world(300, 300);
  EXPECT_EQ(world.budget.used_bytes, 0u);
  Random random(4);
  for (int i = 0; i < 50; ++i) {
    world.layer.Set(random.Node(300, 300), 10 * kQuantum);
  }
  EXPECT_GT(world.budget.used_bytes, 0u);
  int steps = 0;
  for (; !world.layer.empty() && steps < 1000; ++steps) {
    world.layer.Step(Law(5000, 3'800'000'000, 50), nullptr);
    ExpectBalanced(world.layer);
  }
  EXPECT_TRUE(world.layer.empty()) << steps << " steps";
  EXPECT_EQ(world.budget.used_bytes, 0u);
  EXPECT_EQ(world.layer.totals().sum, 0u);
  ASSERT_TRUE(world.layer.Set({1, 1}, 5));
  ASSERT_TRUE(world.layer.Set({1, 1}, 0));
  EXPECT_EQ(world.budget.used_bytes, 0u);
}

TEST(DiffusionLayer, ClearTakesEverythingAndCountsItAsLost) {
  World world(300, 300);
  world.layer.Set({3, 3}, 1000);
  world.layer.Set({290, 200}, 500);
  world.layer.Clear();
  EXPECT_EQ(ContentsOf(world.layer).size(), 0u);
  EXPECT_EQ(world.layer.totals().lost, 1500u);
  EXPECT_EQ(world.budget.used_bytes, 0u);
  ExpectBalanced(world.layer);
}

// With k = 1/2 exactly, k^n is exact: v / 2^n, rounded down once.
TEST(DiffusionLayer, DecayIsManyStepsOfEvaporationAtOnce) {
  World world(40, 40);
  world.layer.Set({3, 3}, 1'000'003);
  world.layer.Set({30, 30}, 2000);
  world.layer.Decay(Law(5000, 1u << 31, 100), 5);
  EXPECT_EQ(world.layer.Read({3, 3}), 1'000'003u / 32);
  EXPECT_EQ(world.layer.Read({30, 30}), 0u);  // 62 is below the cut-off
  EXPECT_EQ(world.layer.totals().lost, 62u);
  ExpectBalanced(world.layer);
  world.layer.Decay(Law(5000, UINT32_MAX), UINT64_MAX);
  EXPECT_TRUE(world.layer.empty());
  ExpectBalanced(world.layer);
}

TEST(DiffusionLayer, DecayWithoutEvaporationKeepsEverything) {
  World world(40, 40);
  world.layer.Set({3, 3}, 7);
  world.layer.Decay(Law(5000), 1'000'000'000);
  EXPECT_EQ(world.layer.Read({3, 3}), 7u);
}

TEST(DiffusionLayer, HashTellsContentsApartHoweverTheyCameAbout) {
  World direct(300, 300);
  direct.layer.Set({3, 3}, 10);
  direct.layer.Set({200, 7}, 20);
  World around(300, 300);
  around.layer.Set({200, 7}, 20);
  around.layer.Set({100, 100}, 5);
  around.layer.Set({100, 100}, 0);
  around.layer.Step(Law(0), nullptr);
  around.layer.Add({3, 3}, 10, kMax);
  EXPECT_EQ(direct.layer.Hash(), around.layer.Hash());
  EXPECT_EQ(direct.layer.Hash(),
            Hash64({uint64_t{3} << 32 | 3, 10}) + Hash64({uint64_t{7} << 32 | 200, 20}));
  around.layer.Set({3, 3}, 11);
  EXPECT_NE(direct.layer.Hash(), around.layer.Hash());
}

TEST(DiffusionLayer, ATileShowsWhatReadSays) {
  World world(60, 60);
  world.layer.Set({20, 20}, 1u << 28);
  world.layer.Step(Law(9000), nullptr);
  size_t seen = 0;
  for (int32_t row = 0; row < 60; ++row) {
    for (int32_t column = 0; column < 60; ++column) {
      const DiffusionLayer::TileView tile = world.layer.Find(column / 8, row / 8);
      const auto slot = static_cast<size_t>(row % 8 * 8 + column % 8);
      const uint32_t content = world.layer.Read({column, row});
      EXPECT_EQ((tile.occupied >> slot & 1) != 0, content != 0);
      EXPECT_EQ(tile.occupied != 0 ? tile[slot] : 0, content);
      seen += content != 0 ? 1 : 0;
    }
  }
  EXPECT_EQ(seen, 5u);
}

}  // namespace
}  // namespace pheromone::field
