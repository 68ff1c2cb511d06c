#include "server/core/field/work.h"

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <vector>

#include "server/core/field/field.h"
#include "server/core/field/testing/random_field.h"
#include "server/core/field/testing/trail_field.h"

namespace pheromone::field {
namespace {

using testing::Between;
using testing::HashFromADump;
using testing::OneIn;
using testing::Random;
using testing::RandomPoint;
using testing::Restored;
using testing::TrailConfig;
using testing::TrailLaw;

constexpr int kMaxPortions = 10'000;

// Large enough for edits of several portions.
FieldConfig WideConfig() {
  FieldConfig config = TrailConfig();
  config.map.cell_um = 20'000;
  config.map.width_um = config.map.height_um = 6'000'000;  // 301 x 301 nodes
  config.pheromones = {TrailLaw()};
  config.pheromones[0].tau_ms = 0;
  config.memory_bytes = 64 << 20;
  return config;
}

FieldEdit Everything(FieldEdit::Action action, uint32_t level) {
  FieldEdit edit;
  edit.shape = FieldEdit::Shape::kAll;
  edit.action = action;
  edit.level = level;
  return edit;
}

// Goes on to the end; what became of the edit `id`.
Status End(Field* field, uint64_t id, uint64_t now_ms) {
  std::vector<FinishedWork> finished;
  for (int portion = 0; portion < kMaxPortions; ++portion) {
    field->TakeFinished(&finished);
    for (const FinishedWork& it : finished) {
      if (it.id == id) {
        return it.outcome;
      }
    }
    field->Advance(now_ms);
  }
  return Error{"it does not end"};
}

std::map<NodeIndex, uint32_t> LevelsOf(const Field& field, uint64_t now_ms) {
  std::map<NodeIndex, uint32_t> levels;
  field.VisitLevels(1, now_ms, [&](NodeIndex node, uint32_t level) { levels[node] = level; });
  return levels;
}

TEST(Work, NoPortionTouchesMoreNodesThanItMay) {
  Field field(WideConfig());
  field.BeginEdit(1, Everything(FieldEdit::Action::kSet, 64), nullptr, 5);
  size_t nodes = field.node_count();
  EXPECT_EQ(nodes, size_t{Field::kNodesOfPortion});
  int portions = 1;
  for (; field.busy() && portions < kMaxPortions; ++portions) {
    field.Advance(5);
    EXPECT_LE(field.node_count() - nodes, size_t{Field::kNodesOfPortion});
    nodes = field.node_count();
  }
  EXPECT_EQ(nodes, 301u * 301u);
  EXPECT_EQ(portions, (301 * 301 + Field::kNodesOfPortion - 1) / Field::kNodesOfPortion);
  EXPECT_EQ(HashFromADump(field), field.hash());
}

// Random edits, in portions and at once, with deposits between the portions where the edit does not
// reach: the same map in the end.
TEST(Work, LeavesTheMapThatTheSameEditAtOnceLeaves) {
  Random random(3);
  int long_ones = 0;
  for (int round = 0; round < 12; ++round) {
    FieldConfig config = WideConfig();
    ObstacleMask walls(config.map.columns(), config.map.rows());
    walls.BlockRow(60, 20, 90);
    config.obstacles = Shared(std::move(walls));
    Field parts(config);
    Field whole(config);
    for (uint64_t id = 1; id <= 4; ++id) {
      FieldEdit edit;
      edit.shape = static_cast<FieldEdit::Shape>(random() % 3);
      edit.action = static_cast<FieldEdit::Action>(random() % 3);
      edit.level = static_cast<uint32_t>(Between(random, 0, 500));
      edit.radius_um = Between(random, 0, 1'500'000);
      edit.points = {RandomPoint(random, config.map), RandomPoint(random, config.map)};
      parts.BeginEdit(id, edit, nullptr, id);
      long_ones += parts.busy() ? 1 : 0;
      ASSERT_TRUE(End(&parts, id, id).ok());
      ASSERT_TRUE(whole.Edit(edit, id).ok());
      ASSERT_EQ(LevelsOf(parts, id), LevelsOf(whole, id)) << "round " << round;
      ASSERT_EQ(parts.used_bytes(), whole.used_bytes());
      ASSERT_EQ(HashFromADump(parts), parts.hash());
    }
    ASSERT_FALSE(parts.busy());
  }
  EXPECT_GE(long_ones, 12);
}

TEST(Work, AnEditWithoutMemoryForAllOfItChangesNothing) {
  FieldConfig config = WideConfig();
  config.memory_bytes = 100 * CellMap::kTileBytes;
  Field field(config);
  ASSERT_EQ(field.Deposit(1, {1'000'000, 1'000'000}, 1, 1), DepositResult::kDone);
  const auto before = LevelsOf(field, 1);
  const uint64_t used = field.used_bytes();
  field.BeginEdit(1, Everything(FieldEdit::Action::kSet, 64), nullptr, 1);
  const Status outcome = End(&field, 1, 1);
  ASSERT_FALSE(outcome.ok());
  EXPECT_NE(outcome.error().find("memory"), std::string::npos);
  EXPECT_EQ(LevelsOf(field, 1), before);
  EXPECT_EQ(field.used_bytes(), used);
}

// What an edit has reserved cannot be taken by robots while it is under way.
TEST(Work, DepositsBetweenPortionsCannotTakeTheMemoryOfAnEdit) {
  FieldConfig config = WideConfig();
  FieldEdit lower_half = Everything(FieldEdit::Action::kSet, 64);
  lower_half.shape = FieldEdit::Shape::kRectangle;
  lower_half.points = {{0, 0}, {6'000'000, 2'900'000}};
  {
    Field measure(config);
    measure.BeginEdit(1, lower_half, nullptr, 1);
    ASSERT_TRUE(End(&measure, 1, 1).ok());
    config.memory_bytes = measure.used_bytes() + 3 * CellMap::kTileBytes;
  }
  Random random(5);
  Field field(config);
  field.BeginEdit(1, lower_half, nullptr, 1);
  ASSERT_TRUE(field.busy());
  int full = 0;
  for (int i = 0; i < 200; ++i) {
    PointUm point = RandomPoint(random, config.map);
    point.y = 3'200'000 + point.y % 2'500'000;
    full += field.Deposit(1, point, 1, 1) == DepositResult::kMapFull ? 1 : 0;
  }
  EXPECT_GE(full, 100);
  EXPECT_TRUE(End(&field, 1, 1).ok());
  EXPECT_LE(field.used_bytes(), config.memory_bytes);
  for (int32_t row = 0; row <= 145; row += 29) {
    EXPECT_EQ(field.LevelOf(1, {300, row}, 1), 64u);
  }
}

// An edit so large that its tiles are counted in two portions, of a map without any room, of which
// the part that is counted first has evaporated.
TEST(Work, DepositsWhileAnEditIsCountedTakeNoTileThatItCountsOn) {
  FieldConfig config = TrailConfig();
  config.map.cell_um = 10'000;
  config.map.width_um = config.map.height_um = 15'000'000;  // 188 x 188 tiles
  config.pheromones.push_back(TrailLaw());
  config.pheromones[1].type = 2;
  Field field(config);
  const FieldEdit all = Everything(FieldEdit::Action::kSet, 8 * kLevelsPerQuantum);
  ASSERT_TRUE(field.Edit(all, 1).ok());
  FieldEdit corner = Everything(FieldEdit::Action::kSet, 1);  // of its first leaf
  corner.shape = FieldEdit::Shape::kRectangle;
  corner.points = {{0, 0}, {1'270'000, 1'270'000}};
  ASSERT_TRUE(field.Edit(corner, 1).ok());
  config.memory_bytes = field.used_bytes();
  field.Reconfigure(config, 1);
  constexpr uint64_t kLaterMs = 60'000;  // when the corner has evaporated
  ASSERT_EQ(field.LevelOf(1, {5, 5}, kLaterMs), 0u);
  ASSERT_NE(field.LevelOf(1, {500, 500}, kLaterMs), 0u);
  field.BeginEdit(1, all, nullptr, kLaterMs);
  ASSERT_TRUE(field.busy());
  EXPECT_EQ(field.Deposit(2, {7'000'000, 7'000'000}, 1, kLaterMs), DepositResult::kMapFull);
  EXPECT_TRUE(End(&field, 1, kLaterMs).ok());
  EXPECT_EQ(field.LevelOf(1, {5, 5}, kLaterMs), 8 * kLevelsPerQuantum);
  EXPECT_EQ(HashFromADump(field), field.hash());
}

TEST(Work, OneEditWaitsForTheOther) {
  Field field(WideConfig());
  field.BeginEdit(1, Everything(FieldEdit::Action::kSet, 64), nullptr, 1);
  field.BeginEdit(2, Everything(FieldEdit::Action::kErase, 0), nullptr, 1);
  field.BeginEdit(3, Everything(FieldEdit::Action::kAdd, 128), nullptr, 1);
  EXPECT_TRUE(End(&field, 3, 1).ok());
  EXPECT_EQ(field.node_count(), 301u * 301u);
  EXPECT_EQ(field.LevelOf(1, {7, 7}, 1), 128u);
}

TEST(Work, PathsThatComeAndGoAreLaidInPortions) {
  FieldConfig config = WideConfig();
  Field field(config);
  FieldConfig next = config;
  for (int64_t row = 1; row < 40; ++row) {
    next.paths.push_back({1, 2, false, {{0, row * 100'000}, {6'000'000, row * 100'000}}});
  }
  const auto plan = std::make_shared<const LayPlan>(PlanLaying(config, next));
  EXPECT_EQ(plan->size(), 39u * 301u);
  field.BeginReconfigure(1, std::make_shared<const FieldConfig>(next), plan, 1);
  EXPECT_TRUE(field.busy());
  EXPECT_TRUE(End(&field, 1, 2).ok());
  EXPECT_EQ(field.node_count(), 39u * 301u);
  EXPECT_EQ(field.LevelOf(1, {300, 195}, 2), 128u);
  const auto back = std::make_shared<const LayPlan>(PlanLaying(next, config));
  field.BeginReconfigure(2, std::make_shared<const FieldConfig>(config), back, 3);
  EXPECT_TRUE(End(&field, 2, 4).ok());
  EXPECT_EQ(field.node_count(), 0u);
}

TEST(Work, AFieldRestoredInTheMiddleGoesOnTheSame) {
  Field field(WideConfig());
  FieldEdit stroke = Everything(FieldEdit::Action::kAdd, 32);
  stroke.shape = FieldEdit::Shape::kStroke;
  stroke.radius_um = 800'000;
  stroke.points = {{500'000, 500'000}, {5'000'000, 3'000'000}, {500'000, 5'500'000}};
  field.BeginEdit(1, stroke, nullptr, 1);
  field.BeginEdit(2, Everything(FieldEdit::Action::kSet, 64), nullptr, 1);
  for (int portion = 0; field.busy() && portion < kMaxPortions; ++portion) {
    const auto restored = Restored(field);
    ASSERT_NE(restored, nullptr);
    ASSERT_EQ(restored->hash(), field.hash());
    ASSERT_EQ(restored->used_bytes(), field.used_bytes());
    field.Advance(9);
    restored->Advance(9);
    ASSERT_EQ(restored->hash(), field.hash());
    ASSERT_EQ(restored->used_bytes(), field.used_bytes());
  }
  EXPECT_FALSE(field.busy());
}

// The table of a map that was erased stays in the budget, whether it is there or, after a restart,
// not yet again: an edit that fits exactly fits in both.
TEST(Work, AnEditOfAnErasedMapFitsAfterARestartToo) {
  FieldConfig config = WideConfig();
  config.memory_bytes = testing::BytesOf(config.map, 1, 1);
  Field field(config);
  ASSERT_EQ(field.Deposit(1, {1'000'000, 1'000'000}, 1, 1), DepositResult::kDone);
  field.BeginEdit(1, Everything(FieldEdit::Action::kErase, 0), nullptr, 1);
  ASSERT_TRUE(End(&field, 1, 1).ok());
  const auto restored = Restored(field);
  ASSERT_NE(restored, nullptr);
  FieldEdit dot = Everything(FieldEdit::Action::kSet, 64);
  dot.shape = FieldEdit::Shape::kStroke;
  dot.points = {{1'000'000, 1'000'000}};
  for (Field* it : {&field, restored.get()}) {
    it->BeginEdit(2, dot, nullptr, 2);
    EXPECT_TRUE(End(it, 2, 2).ok());
    EXPECT_EQ(it->used_bytes(), config.memory_bytes);
  }
}

}  // namespace
}  // namespace pheromone::field
