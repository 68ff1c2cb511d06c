#include "server/core/field/edit_history.h"

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/core/field/field.h"
#include "server/core/field/frozen_field.h"
#include "server/core/field/testing/random_field.h"
#include "server/core/field/testing/trail_field.h"

namespace pheromone::field {
namespace {

using testing::Between;
using testing::HashFromADump;
using testing::Random;
using testing::RandomPoint;
using testing::Restored;
using testing::TrailConfig;
using testing::TrailLaw;
using Action = FieldEdit::Action;
using Shape = FieldEdit::Shape;

// 301 x 301 nodes, 22 portions; nothing evaporates.
FieldConfig LargeConfig() {
  FieldConfig config = TrailConfig();
  config.map.cell_um = 20'000;
  config.map.width_um = config.map.height_um = 6'000'000;
  config.pheromones[0].tau_ms = 0;
  return config;
}

FieldEdit EditOf(Shape shape, Action action, uint32_t level = 128) {
  FieldEdit edit;
  edit.shape = shape;
  edit.action = action;
  edit.level = level;
  edit.radius_um = 150'000;
  edit.points = {{1'000'000, 1'000'000}, {2'000'000, 1'300'000}};
  return edit;
}

std::map<NodeIndex, uint32_t> Levels(const Field& field, uint64_t now_ms, uint8_t type = 1) {
  std::map<NodeIndex, uint32_t> levels;
  field.VisitLevels(type, now_ms, [&](NodeIndex node, uint32_t level) { levels[node] = level; });
  return levels;
}

FinishedWork Complete(Field* field, uint64_t now_ms) {
  std::vector<FinishedWork> finished;
  while (field->busy()) {
    field->Advance(now_ms);
  }
  field->TakeFinished(&finished);
  EXPECT_EQ(finished.size(), 1u);
  return finished.empty() ? FinishedWork{} : finished.back();
}

FinishedWork Make(Field* field, uint64_t id, const FieldEdit& edit, uint64_t now_ms) {
  field->BeginEdit(id, edit, nullptr, now_ms, 1'000 * static_cast<int64_t>(id));
  return Complete(field, now_ms);
}

FinishedWork Reverse(Field* field, bool redo, uint64_t now_ms) {
  EXPECT_TRUE(field->CheckReverse(redo).ok());
  field->BeginReverse(900, redo, now_ms);
  return Complete(field, now_ms);
}

std::string BytesOf(const Field& field) {
  ByteWriter writer;
  field.Save(&writer);
  return writer.Take();
}

struct Kind {
  std::string name;
  Shape shape;
  Action action;
};

class EveryEdit : public ::testing::TestWithParam<Kind> {};

// Robots' trail of three quanta, one of which has evaporated at the edit, goes through the shape.
TEST_P(EveryEdit, IsUndoneAndRedone) {
  Field field(TrailConfig());
  Field without(TrailConfig());
  for (int64_t x = 500'000; x <= 2'500'000; x += 100'000) {
    ASSERT_EQ(field.Deposit(1, {x, 1'100'000}, 3, 10), DepositResult::kDone);
    ASSERT_EQ(without.Deposit(1, {x, 1'100'000}, 3, 10), DepositResult::kDone);
  }
  const auto before = Levels(field, 35'000);
  const FinishedWork made = Make(&field, 5, EditOf(GetParam().shape, GetParam().action), 35'000);
  const auto after = Levels(field, 35'000);
  ASSERT_NE(after, before);
  EXPECT_EQ(made.edit, 5u);
  EXPECT_EQ(field.history().Next(false)->info.utc_ms, 5'000);
  EXPECT_EQ(field.history().Next(false)->info.action, GetParam().action);
  size_t different = 0;
  for (int32_t column = 0; column < field.config().map.columns(); ++column) {
    for (int32_t row = 0; row < field.config().map.rows(); ++row) {
      const NodeIndex node{column, row};
      const auto level = [&](const auto& levels) {
        return levels.contains(node) ? levels.at(node) : 0;
      };
      different += level(before) != level(after) ? 1u : 0u;
    }
  }
  EXPECT_EQ(made.changed, different);

  EXPECT_EQ(Reverse(&field, false, 35'000).changed, different);
  for (const uint64_t now_ms : {35'000u, 61'000u, 200'000u}) {
    EXPECT_EQ(Levels(field, now_ms), Levels(without, now_ms)) << now_ms;
  }
  EXPECT_EQ(HashFromADump(field), field.hash());
  EXPECT_EQ(Reverse(&field, true, 35'000).changed, different);
  EXPECT_EQ(Levels(field, 35'000), after);
  EXPECT_EQ(field.CheckReverse(true).ErrorOr(""), "nothing to redo");
}

INSTANTIATE_TEST_SUITE_P(Undo, EveryEdit,
                         ::testing::Values(Kind{"Stroke", Shape::kStroke, Action::kSet},
                                           Kind{"AddedStroke", Shape::kStroke, Action::kAdd},
                                           Kind{"ErasedStroke", Shape::kStroke, Action::kErase},
                                           Kind{"Area", Shape::kRectangle, Action::kSet},
                                           Kind{"AddedArea", Shape::kRectangle, Action::kAdd},
                                           Kind{"ErasedArea", Shape::kRectangle, Action::kErase},
                                           Kind{"WholeMap", Shape::kAll, Action::kSet},
                                           Kind{"AddedWholeMap", Shape::kAll, Action::kAdd},
                                           Kind{"ErasedWholeMap", Shape::kAll, Action::kErase}),
                         [](const auto& tested) { return tested.param.name; });

TEST(Undo, TakesBackWhatAConfigurationLaidAndErased) {
  FieldConfig config = TrailConfig();
  config.paths = {{1, 2, false, {{1'000'000, 1'000'000}, {2'000'000, 1'000'000}}}};
  Field field(config);
  const auto before = Levels(field, 5);
  FieldConfig next = config;
  next.paths = {{1, 4, false, {{1'500'000, 500'000}, {1'500'000, 1'500'000}}}};
  next.initial_rasters = {{1, Shared(std::vector<InitialNode>{{{50, 50}, 64}})}};
  field.BeginReconfigure(7, std::make_shared<const FieldConfig>(next),
                         std::make_shared<const LayPlan>(PlanLaying(config, next)), 4);
  EXPECT_EQ(Complete(&field, 5).edit, 7u);
  const auto after = Levels(field, 5);
  ASSERT_NE(after, before);
  EXPECT_TRUE(field.history().Next(false)->info.is_configuration);
  Reverse(&field, false, 5);
  EXPECT_EQ(Levels(field, 5), before);
  Reverse(&field, true, 5);
  EXPECT_EQ(Levels(field, 5), after);
}

// The limit is the same on both sides: a deposit on a full node counts where it was not full.
TEST(Undo, KeepsWhatRobotsDepositedMeanwhile) {
  Field field(TrailConfig());
  const PointUm point{1'500'000, 1'150'000};
  const NodeIndex node = field.config().map.NearestNode(point);
  ASSERT_EQ(field.Deposit(1, point, 2, 0), DepositResult::kDone);
  Make(&field, 1, EditOf(Shape::kRectangle, Action::kSet, 8 * 64), 10);
  ASSERT_EQ(field.Deposit(1, point, 3, 20), DepositResult::kDone);
  EXPECT_EQ(field.LevelOf(1, node, 20), 8u * 64);
  Reverse(&field, false, 30);
  EXPECT_EQ(field.LevelOf(1, node, 30), 5u * 64);
  ASSERT_EQ(field.Deposit(1, point, 1, 40), DepositResult::kDone);
  EXPECT_EQ(field.LevelOf(1, node, 40), 6u * 64);
  // The time is that of the last deposit.
  EXPECT_EQ(field.LevelOf(1, node, 30'039), 6u * 64);
  EXPECT_EQ(field.LevelOf(1, node, 30'040), 5u * 64);
  Reverse(&field, true, 50);
  EXPECT_EQ(field.LevelOf(1, node, 50), 8u * 64);
}

// Deposits between the portions of an edit and of its undoing, and a restart after each: as if
// there had been the deposits only.
TEST(Undo, IsMadeInPortionsBetweenWhichRobotsDepositAndAServerRestarts) {
  Random random(4);
  auto field = std::make_unique<Field>(LargeConfig());
  Field without(LargeConfig());
  int portions = 0;
  const auto between = [&] {
    for (int i = 0; i < 40; ++i) {
      const PointUm point = RandomPoint(random, field->config().map);
      ASSERT_EQ(field->Deposit(1, point, 1, 5), DepositResult::kDone);
      ASSERT_EQ(without.Deposit(1, point, 1, 5), DepositResult::kDone);
    }
    field = Restored(*field);
    ++portions;
  };
  field->BeginEdit(1, EditOf(Shape::kAll, Action::kSet, 3 * 64), nullptr, 5);
  while (field->busy()) {
    ASSERT_NO_FATAL_FAILURE(between());
    field->Advance(5);
  }
  EXPECT_GE(portions, 20);
  for (const bool redo : {false, true, false}) {
    portions = 0;
    std::vector<FinishedWork> finished;
    field->TakeFinished(&finished);
    field->BeginReverse(2, redo, 5);
    size_t nodes = field->node_count();
    while (field->busy()) {
      ASSERT_EQ(field->CheckReverse(redo).ErrorOr(""),
                "the map is still being changed by an earlier request; try again in a moment");
      ASSERT_NO_FATAL_FAILURE(between());
      nodes = field->node_count();
      field->Advance(5);
      // A portion ends with a row of 16 tiles.
      EXPECT_LE(std::max(nodes, field->node_count()) - std::min(nodes, field->node_count()),
                size_t{Field::kNodesOfPortion} + 1024);
    }
    EXPECT_GE(portions, 20);
  }
  EXPECT_EQ(Levels(*field, 5), Levels(without, 5));
  EXPECT_EQ(HashFromADump(*field), field->hash());
}

// One portion does not become as many as there are pheromones with a few nodes each.
TEST(Undo, OfManyPheromonesIsMadeInPortionsToo) {
  FieldConfig config = LargeConfig();
  config.pheromones.assign(15, config.pheromones[0]);
  for (size_t i = 0; i < config.pheromones.size(); ++i) {
    config.pheromones[i].type = static_cast<uint8_t>(i + 1);
  }
  std::vector<InitialNode> nodes;
  for (int32_t place = 0; place < 3'000; ++place) {
    nodes.push_back({{place % 300, place / 300}, 64});
  }
  Field field(config);
  FieldConfig next = config;
  for (const PheromoneLaw& law : config.pheromones) {
    next.initial_rasters.push_back({law.type, Shared(std::vector(nodes))});
  }
  field.BeginReconfigure(7, std::make_shared<const FieldConfig>(next),
                         std::make_shared<const LayPlan>(PlanLaying(config, next)), 4);
  Complete(&field, 5);
  const size_t all = 15 * nodes.size();
  ASSERT_EQ(field.node_count(), all);
  constexpr size_t kMost = size_t{Field::kNodesOfPortion} + 1024;  // it ends with a row of 16 tiles
  for (const bool redo : {false, true}) {
    field.BeginReverse(8, redo, 5);
    size_t portions = 1;
    for (; field.busy(); ++portions) {
      const size_t before = field.node_count();
      field.Advance(5);
      EXPECT_LE(std::max(before, field.node_count()) - std::min(before, field.node_count()), kMost);
    }
    EXPECT_EQ(field.node_count(), redo ? all : 0);
    EXPECT_GE(portions, 2 * all / kMost);  // they are counted, too
  }
}

TEST(Undo, TakesBackTheLastEditsOneByOne) {
  Field field(TrailConfig());
  std::vector<std::map<NodeIndex, uint32_t>> maps = {Levels(field, 0)};
  constexpr size_t kMade = EditHistory::kMaxEdits + 3;
  for (uint64_t id = 1; id <= kMade; ++id) {
    FieldEdit edit = EditOf(Shape::kStroke, Action::kAdd, 10);
    edit.points[1].x += static_cast<int64_t>(id) * 100'000;
    EXPECT_EQ(Make(&field, id, edit, 0).edit, id);
    maps.push_back(Levels(field, 0));
  }
  for (size_t left = kMade; left > 3; --left) {
    Reverse(&field, false, 0);
    ASSERT_EQ(Levels(field, 0), maps[left - 1]) << left;
  }
  EXPECT_EQ(field.CheckReverse(false).ErrorOr(""),
            "nothing to undo: 3 earlier edits are forgotten; the last 32 are kept, as far as they "
            "fit into 16 MiB and until the law of their pheromone changes");
  for (size_t made = 4; made <= kMade; ++made) {
    Reverse(&field, true, 0);
    ASSERT_EQ(Levels(field, 0), maps[made]) << made;
  }
}

TEST(Undo, AnotherEditDiscardsWhatWasUndoneUnlessItChangesNothing) {
  Field field(TrailConfig());
  Make(&field, 1, EditOf(Shape::kStroke, Action::kSet), 0);
  Reverse(&field, false, 0);
  const FinishedWork nothing = Make(&field, 2, EditOf(Shape::kStroke, Action::kErase), 0);
  EXPECT_EQ(nothing.changed, 0u);
  EXPECT_EQ(nothing.edit, 0u);
  EXPECT_TRUE(field.CheckReverse(true).ok());
  EXPECT_EQ(field.CheckReverse(false).ErrorOr(""), "nothing to undo");
  Make(&field, 3, EditOf(Shape::kRectangle, Action::kSet), 0);
  EXPECT_EQ(field.CheckReverse(true).ErrorOr(""), "nothing to redo");
  Reverse(&field, false, 0);
  EXPECT_TRUE(Levels(field, 0).empty());
}

TEST(Undo, PartsOfAStrokeAreUndoneTogether) {
  Field field(TrailConfig());
  FieldEdit part = EditOf(Shape::kStroke, Action::kAdd, 20);
  EXPECT_EQ(Make(&field, 1, part, 0).edit, 1u);
  const auto first = Levels(field, 0);
  part.continues = 1;
  part.points[0] = part.points[1];
  part.points[1].y += 500'000;
  EXPECT_EQ(Make(&field, 2, part, 0).edit, 1u);
  part.points[1].x += 500'000;
  EXPECT_EQ(Make(&field, 3, part, 0).edit, 1u);
  const auto all = Levels(field, 0);
  Reverse(&field, false, 0);
  EXPECT_TRUE(Levels(field, 0).empty());
  Reverse(&field, true, 0);
  EXPECT_EQ(Levels(field, 0), all);
  // Not the last one any more.
  EXPECT_EQ(Make(&field, 4, EditOf(Shape::kRectangle, Action::kSet), 0).edit, 4u);
  EXPECT_EQ(Make(&field, 5, part, 0).edit, 5u);
}

TEST(Undo, AnEditThatIsTooLargeIsMadeAndAllIsForgotten) {
  FieldConfig config = LargeConfig();
  config.memory_bytes = 1'400'000;  // 90 601 nodes need 840 kB: more than a quarter
  Field field(config);
  EXPECT_EQ(Make(&field, 1, EditOf(Shape::kStroke, Action::kSet), 0).edit, 1u);
  const FinishedWork large = Make(&field, 2, EditOf(Shape::kAll, Action::kSet), 0);
  EXPECT_TRUE(large.outcome.ok());
  EXPECT_EQ(large.edit, 0u);
  EXPECT_EQ(field.node_count(), 301u * 301u);
  EXPECT_LE(field.history().used_bytes(), field.history().limit_bytes());
  EXPECT_NE(field.CheckReverse(false).ErrorOr("").find("2 earlier edits are forgotten"),
            std::string::npos);
  const FinishedWork erased = Make(&field, 3, EditOf(Shape::kAll, Action::kErase), 0);
  EXPECT_EQ(erased.changed, 301u * 301u);
  EXPECT_EQ(erased.edit, 0u);
  EXPECT_EQ(field.node_count(), 0u);
  EXPECT_EQ(field.history().used_bytes(), 0u);
  EXPECT_EQ(field.history().forgotten(), 3u);
  EXPECT_EQ(HashFromADump(field), field.hash());
}

// Which was counted when it began, and is forgotten as one.
TEST(Undo, AnErasureThatIsTooLargeAndContinuesAnEditIsForgottenOnce) {
  FieldConfig config = LargeConfig();
  config.memory_bytes = 1'400'000;
  Field field(config);
  ASSERT_EQ(Make(&field, 1, EditOf(Shape::kAll, Action::kSet), 0).edit, 0u);
  ASSERT_EQ(field.history().forgotten(), 1u);
  ASSERT_EQ(Make(&field, 2, EditOf(Shape::kStroke, Action::kErase), 0).edit, 2u);
  FieldEdit rest = EditOf(Shape::kAll, Action::kErase);
  rest.continues = 2;
  EXPECT_EQ(Make(&field, 3, rest, 0).edit, 0u);
  EXPECT_EQ(field.node_count(), 0u);
  EXPECT_EQ(field.history().forgotten(), 2u);
}

TEST(Undo, TheOldestAreForgottenWhenMemoryIsShort) {
  FieldConfig config = LargeConfig();
  config.memory_bytes = 4 << 20;  // the history holds one edit of the whole map, not two
  Field field(config);
  Make(&field, 1, EditOf(Shape::kAll, Action::kSet, 64), 0);
  const auto before = Levels(field, 0);
  EXPECT_EQ(Make(&field, 2, EditOf(Shape::kAll, Action::kSet, 192), 0).edit, 2u);
  EXPECT_LE(field.history().used_bytes(), field.history().limit_bytes());
  EXPECT_EQ(field.history().forgotten(), 1u);
  Reverse(&field, false, 0);
  EXPECT_EQ(Levels(field, 0), before);
  EXPECT_FALSE(field.CheckReverse(false).ok());
}

// A redo leads from the map that the edits before it left: these must stay.
TEST(Undo, OfUndoneEditsTheLastIsForgottenFirstWhenTheLimitIsLowered) {
  FieldConfig config = LargeConfig();
  Field field(config);
  Make(&field, 1, EditOf(Shape::kStroke, Action::kSet), 0);
  const auto first = Levels(field, 0);
  Make(&field, 2, EditOf(Shape::kAll, Action::kSet), 0);
  Reverse(&field, false, 0);
  Reverse(&field, false, 0);
  config.memory_bytes = 1'400'000;  // a quarter holds the first edit, not the second
  field.BeginReconfigure(3, std::make_shared<const FieldConfig>(config),
                         std::make_shared<const LayPlan>(), 4);
  Complete(&field, 5);
  EXPECT_EQ(field.history().forgotten(), 0u);  // of those that could be undone
  ASSERT_TRUE(field.CheckReverse(true).ok());
  Reverse(&field, true, 5);
  EXPECT_EQ(Levels(field, 5), first);
  EXPECT_EQ(field.CheckReverse(true).ErrorOr(""), "nothing to redo");
  EXPECT_EQ(HashFromADump(field), field.hash());
}

TEST(Undo, OfAnErasureNeedsMemoryForAllOfIt) {
  FieldConfig config = LargeConfig();
  config.pheromones.push_back(TrailLaw());
  config.pheromones.back().type = 2;
  config.pheromones.back().tau_ms = 1'000;
  config.memory_bytes = 600'000;
  Field field(config);
  const FieldEdit painted = EditOf(Shape::kRectangle, Action::kSet);
  Make(&field, 1, painted, 0);
  const auto before = Levels(field, 0);
  Make(&field, 2, EditOf(Shape::kRectangle, Action::kErase), 0);
  for (int32_t row = 0; row < 301; row += 8) {  // until the map is full
    for (int32_t column = 0; column < 301; column += 8) {
      field.Deposit(2, config.map.PositionOf({column, row}), 8, 0);
    }
  }
  const auto full = BytesOf(field).size();
  const FinishedWork refused = Reverse(&field, false, 0);
  ASSERT_FALSE(refused.outcome.ok());
  EXPECT_EQ(refused.outcome.error(),
            "there is no memory left for all of the edit; nothing was changed");
  EXPECT_TRUE(Levels(field, 0).empty());
  EXPECT_EQ(BytesOf(field).size(), full);
  EXPECT_TRUE(Reverse(&field, false, 20'000).outcome.ok());  // when type 2 has evaporated
  EXPECT_EQ(Levels(field, 20'000), before);
}

// Its first portion removes all tiles of a leaf, a later one needs the leaf again, and in between
// robots deposit wherever there is memory.
TEST(Undo, KeepsTheMemoryThatItReleasesUntilItIsComplete) {
  FieldConfig config = LargeConfig();
  config.pheromones.push_back(TrailLaw());
  config.pheromones.back().type = 2;
  config.memory_bytes = 600'000;
  Field field(config);
  const auto rows = [&](int32_t first, int32_t last, Action action) {
    FieldEdit edit = EditOf(Shape::kRectangle, action);
    edit.points = {config.map.PositionOf({0, first}), config.map.PositionOf({127, last})};
    return edit;
  };
  Make(&field, 1, rows(64, 127, Action::kSet), 0);
  const auto before = Levels(field, 0);
  ASSERT_EQ(Make(&field, 2, rows(64, 127, Action::kErase), 0).edit, 2u);
  FieldEdit rest = rows(0, 63, Action::kSet);
  rest.continues = 2;
  ASSERT_EQ(Make(&field, 3, rest, 0).edit, 2u);
  int32_t next = 0;
  const auto fill = [&] {
    DepositResult result = DepositResult::kDone;
    for (; result == DepositResult::kDone && next < 38 * 38; ++next) {
      result = field.Deposit(2, config.map.PositionOf({next % 38 * 8, next / 38 * 8}), 1, 0);
    }
    EXPECT_EQ(result, DepositResult::kMapFull);
    next = 0;
  };
  std::vector<FinishedWork> finished;
  field.BeginReverse(4, false, 0);
  int portions = 0;
  const size_t nodes = field.node_count();
  for (; field.busy(); field.Advance(0)) {
    if (portions > 0 || field.node_count() != nodes) {  // what it needs is reserved
      fill();
      ++portions;
    }
  }
  EXPECT_GE(portions, 3);
  field.TakeFinished(&finished);
  ASSERT_EQ(finished.size(), 1u);
  EXPECT_TRUE(finished[0].outcome.ok());
  EXPECT_EQ(Levels(field, 0), before);
  EXPECT_EQ(Restored(field)->used_bytes(), field.used_bytes());
}

TEST(Undo, AChangedLawForgetsTheEditsOfItsPheromoneAlone) {
  FieldConfig config = TrailConfig();
  config.pheromones.push_back(TrailLaw());
  config.pheromones.back().type = 2;
  Field field(config);
  FieldEdit other = EditOf(Shape::kStroke, Action::kSet);
  other.type = 2;
  Make(&field, 1, other, 0);
  Make(&field, 2, EditOf(Shape::kStroke, Action::kSet), 0);
  FieldConfig next = config;
  next.pheromones[0].tau_ms += 1'000;
  field.BeginReconfigure(3, std::make_shared<const FieldConfig>(next),
                         std::make_shared<const LayPlan>(), 4);
  Complete(&field, 5);
  ASSERT_NE(field.history().Next(false), nullptr);
  EXPECT_EQ(field.history().Next(false)->info.id, 1u);
  EXPECT_EQ(field.history().forgotten(), 1u);
  Reverse(&field, false, 6);
  EXPECT_TRUE(Levels(field, 6, 2).empty());
  EXPECT_FALSE(Levels(field, 6, 1).empty());
}

// What a node held before, and what was deposited since; nothing for what has flowed or evaporated.
TEST(Undo, OfAPheromoneThatDiffusesPutsBackTheContentsFromBefore) {
  FieldConfig config = TrailConfig();
  config.pheromones[0].evaporation = Evaporation::kExponential;
  config.pheromones[0].diffusion = {8'000, 1'000, 0xFF00'0000, 512};
  auto field = std::make_unique<Field>(config);
  const PointUm point{1'500'000, 1'150'000};
  const NodeIndex node = config.map.NearestNode(point);
  ASSERT_EQ(field->Deposit(1, point, 3, 0), DepositResult::kDone);
  const auto before = Levels(*field, 0);
  EXPECT_EQ(before, (std::map<NodeIndex, uint32_t>{{node, 3 * 64}}));
  for (const auto& [shape, action] :
       {std::pair(Shape::kRectangle, Action::kSet), std::pair(Shape::kAll, Action::kErase)}) {
    EXPECT_EQ(Make(field.get(), 1, EditOf(shape, action), 0).edit, 1u);
    field = Restored(*field);
    Reverse(field.get(), false, 0);
    EXPECT_EQ(Levels(*field, 0), before);
  }
  Reverse(field.get(), true, 0);
  EXPECT_TRUE(Levels(*field, 0).empty());
  ASSERT_EQ(field->Deposit(1, point, 7, 0), DepositResult::kDone);
  for (uint64_t now_ms = 1'000; now_ms <= 3'000; now_ms += 1'000) {
    field->Advance(now_ms);
  }
  EXPECT_LT(field->LevelOf(1, node, 3'000), 7u * 64);
  Reverse(field.get(), false, 3'000);
  EXPECT_EQ(field->LevelOf(1, node, 3'000), 8u * 64);  // 3 + 7, at most 8
}

// Two paths through many leaves are erased where the map has no memory to spare: it is enough to
// put them back, for the table of each type is needed once.
TEST(Undo, OfAnErasureOfPheromonesThatDiffuseNeedsTheMemoryThatItReleased) {
  FieldConfig config = LargeConfig();
  config.map.width_um = config.map.height_um = 12'000'000;  // 5 x 5 leaves
  config.pheromones[0].evaporation = Evaporation::kExponential;
  config.pheromones[0].tau_ms = 30'000;
  config.pheromones[0].diffusion = {8'000, 1'000, 0xFF00'0000, 512};
  config.pheromones.resize(3, config.pheromones[0]);
  config.pheromones[1].type = 2;
  config.pheromones[2] = TrailLaw();
  config.pheromones[2].type = 3;
  config.pheromones[2].tau_ms = 0;
  const FieldConfig without = config;
  for (const uint8_t type : {uint8_t{1}, uint8_t{2}}) {
    config.paths.push_back({type, 3, false, {{0, 6'000'000}, {12'000'000, 6'000'000}}});
  }
  FieldEdit ballast = EditOf(Shape::kAll, Action::kSet);  // a quarter holds the edit
  ballast.type = 3;
  Field measured(config);
  ASSERT_TRUE(measured.Edit(ballast, 0).ok());
  const auto before = std::pair(Levels(measured, 0, 1), Levels(measured, 0, 2));
  config.memory_bytes = measured.used_bytes();

  Field field(config);
  ASSERT_TRUE(field.Edit(ballast, 0).ok());
  FieldConfig next = without;
  next.memory_bytes = config.memory_bytes;
  field.BeginReconfigure(7, std::make_shared<const FieldConfig>(next),
                         std::make_shared<const LayPlan>(PlanLaying(config, next)), 0);
  EXPECT_EQ(Complete(&field, 1).edit, 7u);
  ASSERT_TRUE(Levels(field, 1, 1).empty() && Levels(field, 1, 2).empty());
  const FinishedWork undone = Reverse(&field, false, 1);
  EXPECT_TRUE(undone.outcome.ok()) << undone.outcome.ErrorOr("");
  EXPECT_EQ(std::pair(Levels(field, 1, 1), Levels(field, 1, 2)), before);
  EXPECT_EQ(field.used_bytes(), config.memory_bytes);
}

// A frozen copy has the edits as they were, whatever happens to them meanwhile.
TEST(Undo, AFrozenCopyHasTheEdits) {
  Random random(6);
  Field field(LargeConfig());
  Make(&field, 1, EditOf(Shape::kAll, Action::kSet, 64), 0);
  Make(&field, 2, EditOf(Shape::kStroke, Action::kErase), 0);
  Reverse(&field, false, 0);
  const std::string expected = BytesOf(field);
  const std::unique_ptr<FrozenField> frozen = field.Freeze(64 << 20);
  ASSERT_NE(frozen, nullptr);
  std::string bytes;
  ASSERT_TRUE(frozen->CopySome(&bytes));
  for (int i = 0; i < 2'000; ++i) {
    field.Deposit(1, RandomPoint(random, field.config().map), 1, 1);
  }
  Make(&field, 3, EditOf(Shape::kStroke, Action::kSet, 7), 1);  // discards edit 2
  Reverse(&field, false, 1);
  Reverse(&field, false, 1);
  while (frozen->CopySome(&bytes)) {
  }
  EXPECT_FALSE(frozen->failed());
  EXPECT_TRUE(bytes == expected);
}

}  // namespace
}  // namespace pheromone::field
