#include "server/field/cell_map.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace pheromone::field {
namespace {

PheromoneLaw Evaporating() {
  PheromoneLaw law;
  law.tau_ms = 1000;
  law.max_count = 100;
  return law;
}

TEST(CountAt, FallsByOneEachTau) {
  const PheromoneLaw law = Evaporating();
  const NodeState node{5, 10'000};
  EXPECT_EQ(CountAt(law, node, 10'000), 5);
  EXPECT_EQ(CountAt(law, node, 10'999), 5);
  EXPECT_EQ(CountAt(law, node, 11'000), 4);
  EXPECT_EQ(CountAt(law, node, 14'999), 1);
  EXPECT_EQ(CountAt(law, node, 15'000), 0);
}

TEST(CountAt, NeverTurnsNegativeHoweverLongItTakes) {
  EXPECT_EQ(CountAt(Evaporating(), {5, 0}, UINT64_MAX), 0);
}

TEST(CountAt, ATimeBeforeTheDepositChangesNothing) {
  EXPECT_EQ(CountAt(Evaporating(), {5, 10'000}, 0), 5);
}

TEST(CountAt, WithoutTauNothingEvaporates) {
  PheromoneLaw law = Evaporating();
  law.tau_ms = 0;
  EXPECT_EQ(CountAt(law, {5, 0}, UINT64_MAX), 5);
}

TEST(AfterDeposit, AddsToWhatIsLeftAndRestartsTheClock) {
  const NodeState next = AfterDeposit(Evaporating(), {5, 0}, 2, 3'500);
  EXPECT_EQ(next.count, 4);
  EXPECT_EQ(next.time_ms, 3'500u);
}

TEST(AfterDeposit, OnALongDeadTrailCountsInFull) {
  EXPECT_EQ(AfterDeposit(Evaporating(), {5, 0}, 2, 1'000'000).count, 2);
}

TEST(AfterDeposit, StopsAtTheMaximum) {
  EXPECT_EQ(AfterDeposit(Evaporating(), {99, 0}, 255, 0).count, 100);
}

TEST(AfterDeposit, ATrailRenewedFasterThanTauNeverFades) {
  NodeState node{3, 0};
  for (uint64_t now = 999; now < 1'000'000; now += 999) {
    node = AfterDeposit(Evaporating(), node, 0, now);
  }
  EXPECT_EQ(node.count, 3);
}

TEST(CellMap, RemembersWhatAnOrdinaryMapRemembers) {
  std::mt19937 random(1);
  TileBudget budget{10'000, 0};
  CellMap map(&budget);
  std::map<NodeIndex, uint16_t> expected;
  for (int i = 0; i < 20'000; ++i) {
    const NodeIndex node{static_cast<int32_t>(random() % 100),
                         static_cast<int32_t>(random() % 100)};
    const auto count = static_cast<uint16_t>(random() % 3);
    ASSERT_TRUE(map.Write(node, {count, random()}));
    if (count == 0) {
      expected.erase(node);
    } else {
      expected[node] = count;
    }
  }
  std::map<NodeIndex, uint16_t> seen;
  map.ForEach([&](NodeIndex node, NodeState state) {
    EXPECT_TRUE(seen.emplace(node, state.count).second);
  });
  EXPECT_EQ(seen, expected);
  EXPECT_EQ(map.node_count(), expected.size());

  const NodeIndex low{13, 7};
  const NodeIndex high{64, 71};
  std::map<NodeIndex, uint16_t> seen_in;
  map.ForEachIn(low, high, [&](NodeIndex node, NodeState state) { seen_in[node] = state.count; });
  std::erase_if(expected, [&](const auto& entry) {
    const NodeIndex node = entry.first;
    return node.column < low.column || node.column > high.column || node.row < low.row ||
           node.row > high.row;
  });
  EXPECT_EQ(seen_in, expected);
}

TEST(CellMap, RefusesAnotherTileBeyondTheBudgetAndKeepsTheRest) {
  TileBudget budget{2, 0};
  CellMap map(&budget);
  EXPECT_TRUE(map.Write({0, 0}, {1, 0}));
  EXPECT_TRUE(map.Write({8, 0}, {1, 0}));
  EXPECT_FALSE(map.Write({16, 0}, {1, 0}));
  EXPECT_TRUE(map.Write({7, 7}, {1, 0}));
  EXPECT_EQ(map.Read({16, 0}).count, 0);
  EXPECT_EQ(map.Read({8, 0}).count, 1);
}

TEST(CellMap, GivesBackTheTileOfItsLastNode) {
  TileBudget budget{1, 0};
  CellMap map(&budget);
  ASSERT_TRUE(map.Write({3, 3}, {1, 0}));
  ASSERT_TRUE(map.Write({3, 3}, {0, 0}));
  EXPECT_EQ(budget.used, 0u);
  EXPECT_TRUE(map.Write({100, 100}, {1, 0}));
}

}  // namespace
}  // namespace pheromone::field
