// Tiles tell when they changed, and can be visited by area.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/core/field/cell_map.h"
#include "server/core/field/field.h"
#include "server/core/field/testing/random_field.h"
#include "server/core/field/testing/trail_field.h"

namespace pheromone::field {
namespace {

using testing::Between;
using testing::OneIn;
using testing::Random;
using testing::TrailConfig;
using testing::TrailLaw;

constexpr int32_t kColumns = 300;  // three leaves of 128 nodes a side, the last one cut off
constexpr int32_t kRows = 200;
constexpr NodeArea kAll{{0, 0}, {kColumns, kRows}};

struct World {
  MemoryBudget budget{64 << 20, 0};
  TilePool pool;
  Reclaimer reclaimer;
  CellMap map{kColumns, kRows, &budget, &reclaimer, &pool};
};

NodeArea RandomArea(Random& random) {
  const auto between = [&](int32_t size) {
    const auto a = static_cast<int32_t>(Between(random, 0, size));
    const auto b = static_cast<int32_t>(Between(random, 0, size));
    return std::pair(std::min(a, b), std::max(a, b));
  };
  const auto [left, right] = between(kColumns);
  const auto [bottom, top] = between(kRows);
  return {{left, bottom}, {right, top}};
}

NodeIndex TileOf(NodeIndex node) {
  return {node.column / kTileSide, node.row / kTileSide};
}

uint64_t NumberOf(const CellMap& map) {
  return map.VisitChanged(kAll, UINT64_MAX, [](const NodeArea&) {}).number;
}

// What changed, as anybody would keep it: the number of the last change of each
// node.
struct Naive {
  std::map<NodeIndex, uint64_t> changed;
  std::map<NodeIndex, uint64_t> written;  // of each tile, also where nothing was different
  std::map<NodeIndex, std::set<NodeIndex>> nodes_of_tile;
  uint64_t all = 1;
};

// Clustered, so that tiles and leaves fill and empty all the time.
NodeIndex RandomNode(Random& random) {
  const auto around = [&](int32_t size) {
    const auto middle = static_cast<int32_t>(Between(random, 0, 3)) * size / 4 + size / 8;
    return std::min(size - 1, middle + static_cast<int32_t>(Between(random, 0, 5)));
  };
  return {around(kColumns), around(kRows)};
}

void Change(Random& random, CellMap* map, Naive* naive) {
  const NodeIndex node = RandomNode(random);
  std::set<NodeIndex>& nodes = naive->nodes_of_tile[TileOf(node)];
  if (map->tile_count() != 0 && OneIn(random, 2'000)) {
    map->Clear();
    naive->all = NumberOf(*map);
    naive->nodes_of_tile.clear();
  } else if (OneIn(random, 3)) {
    map->Forget(node);  // as a sweep does: no change
    nodes.erase(node);
  } else {
    const auto level = static_cast<uint32_t>(Between(random, 0, 1));
    const bool is_change = level != 0 || nodes.contains(node);
    const bool has_tile = !nodes.empty();
    ASSERT_TRUE(map->Write(node, {level, 7}));
    if (is_change) {
      naive->changed[node] = NumberOf(*map);
    }
    if (level != 0 || has_tile) {
      naive->written[TileOf(node)] = NumberOf(*map);
    }
    level != 0 ? (void)nodes.insert(node) : (void)nodes.erase(node);
  }
}

void Check(const CellMap& map, const Naive& naive, const NodeArea& area, uint64_t since) {
  const auto index = [](NodeIndex node) {
    return static_cast<size_t>(node.row) * kColumns + static_cast<size_t>(node.column);
  };
  std::vector<bool> told(size_t{kColumns} * kRows);
  const CellMap::Changes changes = map.VisitChanged(area, since, [&](const NodeArea& part) {
    ASSERT_FALSE(part.empty());
    ASSERT_EQ(part, part.Within(area));
    for (int32_t row = part.begin.row; row < part.end.row; ++row) {
      for (int32_t column = part.begin.column; column < part.end.column; ++column) {
        ASSERT_FALSE(told[index({column, row})]) << "twice";
        told[index({column, row})] = true;
      }
    }
  });
  ASSERT_EQ(changes.all, naive.all > since || since > changes.number);
  for (const auto& [node, number] : naive.changed) {
    if (area.Contains(node) && number > since) {
      ASSERT_TRUE(told[index(node)]) << node.column << " " << node.row;
    }
  }
  // Where there is something, nothing is told in vain.
  for (const auto& [tile, nodes] : naive.nodes_of_tile) {
    for (const NodeIndex node : nodes) {
      if (!changes.all && told[index(node)]) {
        ASSERT_GT(naive.written.at(tile), since) << node.column << " " << node.row;
      }
    }
  }
}

TEST(Changes, AreThoseThatAnOrdinaryListOfLastWritesHas) {
  Random random(5);
  World world;
  Naive naive;
  for (int i = 0; i < 30'000; ++i) {
    ASSERT_NO_FATAL_FAILURE(Change(random, &world.map, &naive));
    if (OneIn(random, 20)) {
      const uint64_t number = NumberOf(world.map);
      const auto back = static_cast<uint64_t>(Between(random, 0, OneIn(random, 4) ? 5'000 : 30));
      const NodeArea area = OneIn(random, 2) ? kAll : RandomArea(random);
      ASSERT_NO_FATAL_FAILURE(Check(world.map, naive, area, number - std::min(number, back)));
    }
    world.reclaimer.Collect();
  }
  Check(world.map, naive, kAll, 0);
  Check(world.map, naive, kAll, UINT64_MAX);  // a number of somebody else's
}

TEST(Changes, OfNothingAreNoneAndWhatIsForgottenIsNone) {
  World world;
  const uint64_t before = NumberOf(world.map);
  int told = 0;
  const auto count = [&](const NodeArea&) { ++told; };
  EXPECT_TRUE(world.map.VisitChanged(kAll, 0, count).all);
  EXPECT_EQ(std::exchange(told, 0), 1);
  world.map.Forget({5, 5});
  world.map.Write({5, 5}, {0, 0});
  EXPECT_EQ(NumberOf(world.map), before);
  world.map.Write({5, 5}, {1, 0});
  const uint64_t written = NumberOf(world.map);
  EXPECT_GT(written, before);
  world.map.Forget({5, 5});  // and with it its tile and its leaf
  EXPECT_EQ(world.map.VisitChanged(kAll, written, count).number, written);
  EXPECT_EQ(told, 0);
  world.map.VisitChanged(kAll, before, count);  // who has not seen that it was written hears of it
  EXPECT_GE(told, 1);
}

TEST(Areas, AreVisitedWithAllTheirNodesAndNoOthers) {
  Random random(6);
  World world;
  for (int i = 0; i < 3'000; ++i) {
    const NodeIndex node{static_cast<int32_t>(Between(random, 0, kColumns - 1)),
                         static_cast<int32_t>(Between(random, 0, kRows - 1))};
    world.map.Write(node, {static_cast<uint32_t>(i + 1), 0});
  }
  using Nodes = std::map<NodeIndex, uint32_t>;
  for (int i = 0; i < 300; ++i) {
    const NodeArea area = i == 0 ? kAll : RandomArea(random);
    Nodes expected;
    world.map.ForEach([&](NodeIndex node, NodeState state) {
      const bool inside = node.column >= area.begin.column && node.column < area.end.column &&
                          node.row >= area.begin.row && node.row < area.end.row;
      if (inside) {
        expected[node] = state.level;
      }
    });
    Nodes seen;
    world.map.ForEachIn(area, [&](NodeIndex node, NodeState state) {
      EXPECT_TRUE(seen.emplace(node, state.level).second);
    });
    ASSERT_EQ(seen, expected);
  }
}

// --- Of a field, through a reader.

// Two types that stay, one that evaporates, one that diffuses.
FieldConfig MixedConfig() {
  FieldConfig config = TrailConfig();
  config.pheromones.clear();
  for (uint8_t type = 1; type <= 4; ++type) {
    PheromoneLaw law = TrailLaw();
    law.type = type;
    law.name = "type " + std::to_string(type);
    law.tau_ms = type == 3 ? 1'000 : 0;
    config.pheromones.push_back(law);
  }
  config.pheromones[3].diffusion = {.exchange_q16 = 10'000, .step_ms = 100};
  return config;
}

constexpr NodeArea kMap{{0, 0}, {101, 101}};

class FieldChanges : public ::testing::Test {
 protected:
  // What has changed since the last look at a type.
  std::vector<NodeArea> Look(uint8_t type, const NodeArea& area = kMap) {
    std::vector<NodeArea> parts;
    last_ = reader_.VisitChanged(type, area, since_[type],
                                 [&](const NodeArea& part) { parts.push_back(part); });
    since_[type] = last_.number;
    return parts;
  }
  bool LookAtAll(uint8_t type) {
    Look(type);
    return last_.all;
  }

  Field field_{MixedConfig()};
  const FieldReader reader_{field_};
  std::map<uint8_t, uint64_t> since_;
  CellMap::Changes last_;
};

TEST_F(FieldChanges, ADepositChangesItsTileAndNoOtherType) {
  EXPECT_TRUE(LookAtAll(1));  // the first look
  EXPECT_TRUE(LookAtAll(2));
  EXPECT_TRUE(Look(1).empty());
  EXPECT_EQ(field_.Deposit(1, {5'000'000, 5'200'000}, 1, 0), DepositResult::kDone);
  EXPECT_EQ(Look(1), (std::vector<NodeArea>{{{48, 48}, {56, 56}}}));
  EXPECT_FALSE(last_.all);
  EXPECT_TRUE(Look(1).empty());
  EXPECT_TRUE(Look(2).empty());
  EXPECT_EQ(field_.Deposit(1, {10'000'000, 0}, 1, 0), DepositResult::kDone);
  EXPECT_TRUE(Look(1, {{0, 1}, {101, 101}}).size() == 1);  // the tile goes beyond the area
  EXPECT_EQ(field_.Deposit(1, {10'000'000, 0}, 1, 0), DepositResult::kDone);
  // An area may be larger than the map.
  EXPECT_EQ(Look(1, {{-5, -5}, {900, 900}}), (std::vector<NodeArea>{{{96, 0}, {101, 8}}}));
  EXPECT_TRUE(Look(1, {{7, 7}, {7, 9}}).empty());
}

TEST_F(FieldChanges, EvaporationAndItsSweepChangeNothing) {
  LookAtAll(3);
  ASSERT_EQ(field_.Deposit(3, {5'000'000, 5'200'000}, 1, 0), DepositResult::kDone);
  EXPECT_EQ(Look(3).size(), 1u);
  ASSERT_EQ(field_.LevelOf(3, {50, 52}, 100'000), 0u);
  for (uint64_t now_ms = 100'000; field_.node_count() != 0; now_ms += 1'000) {
    ASSERT_LT(now_ms, 200'000u);
    field_.Advance(now_ms);
  }
  EXPECT_TRUE(Look(3).empty());
}

TEST_F(FieldChanges, AnErasureIsToldOfAlsoWhereNothingIsLeft) {
  ASSERT_EQ(field_.Deposit(1, {5'000'000, 5'200'000}, 1, 0), DepositResult::kDone);
  LookAtAll(1);
  FieldEdit edit;
  edit.action = FieldEdit::Action::kErase;
  edit.points = {{4'900'000, 5'100'000}, {5'100'000, 5'300'000}};
  ASSERT_TRUE(field_.Edit(edit, 0).ok());
  ASSERT_EQ(field_.tile_count(), 0u);
  const std::vector<NodeArea> parts = Look(1);
  EXPECT_FALSE(last_.all);
  EXPECT_TRUE(std::any_of(parts.begin(), parts.end(), [](const NodeArea& it) {
    return it.Contains({50, 52});
  }));
  EXPECT_TRUE(Look(1).empty());
}

TEST_F(FieldChanges, ToEraseAllChangesAllOfThatType) {
  LookAtAll(1);
  LookAtAll(2);
  LookAtAll(4);
  FieldEdit edit;
  edit.action = FieldEdit::Action::kErase;
  edit.shape = FieldEdit::Shape::kAll;
  for (const uint8_t type : std::vector<uint8_t>{1, 4}) {
    edit.type = type;
    ASSERT_EQ(field_.Deposit(type, {5'000'000, 5'200'000}, 1, 0), DepositResult::kDone);
    Look(type);
    ASSERT_TRUE(field_.Edit(edit, 0).ok());
    EXPECT_TRUE(LookAtAll(type));
    EXPECT_FALSE(LookAtAll(type));
  }
  EXPECT_FALSE(LookAtAll(2));
}

TEST_F(FieldChanges, EachStepOfWhatDiffusesChangesAllOfIt) {
  LookAtAll(4);
  ASSERT_EQ(field_.Deposit(4, {5'000'000, 5'200'000}, 8, 0), DepositResult::kDone);
  EXPECT_TRUE(LookAtAll(4));
  EXPECT_FALSE(LookAtAll(4));
  field_.Advance(100);
  EXPECT_TRUE(LookAtAll(4));
  field_.Advance(150);  // no step is due
  EXPECT_FALSE(LookAtAll(4));
}

TEST_F(FieldChanges, AConfigurationChangesAll) {
  LookAtAll(1);
  LookAtAll(2);
  FieldConfig next = MixedConfig();
  next.pheromones[0].tau_ms = 5'000;
  field_.Reconfigure(next, 0);
  EXPECT_TRUE(LookAtAll(1));
  EXPECT_TRUE(LookAtAll(2));
  EXPECT_FALSE(LookAtAll(2));
}

TEST_F(FieldChanges, OfATypeThatCannotBeThereAreNone) {
  EXPECT_TRUE(Look(0).empty());
  EXPECT_TRUE(Look(255).empty());
  EXPECT_EQ(last_.number, 0u);
}

TEST_F(FieldChanges, AnAreaHasItsLevelsAlsoOfWhatDiffuses) {
  Random random(3);
  for (int i = 0; i < 2'000; ++i) {
    const auto type = static_cast<uint8_t>(Between(random, 1, 4));
    field_.Deposit(type, testing::RandomPoint(random, field_.config().map), 2, 500);
  }
  field_.Advance(700);
  using Levels = std::map<NodeIndex, uint32_t>;
  for (int i = 0; i < 40; ++i) {
    NodeArea area = RandomArea(random);
    area.begin.column -= 50;  // some beyond the map's edges
    for (uint8_t type = 0; type <= 5; ++type) {
      Levels expected;
      Levels seen;
      reader_.VisitLevels(type, 800, [&](NodeIndex node, uint32_t level) {
        if (node.column >= area.begin.column && node.column < area.end.column &&
            node.row >= area.begin.row && node.row < area.end.row) {
          expected[node] = level;
        }
      });
      reader_.VisitLevels(type, area, 800, [&](NodeIndex node, uint32_t level) {
        EXPECT_TRUE(seen.emplace(node, level).second);
      });
      ASSERT_EQ(seen, expected) << int{type};
    }
  }
}

}  // namespace
}  // namespace pheromone::field
