// Changes of the map by hand, as events.

#include <gtest/gtest.h>

#include "server/core/engine/engine.h"
#include "server/core/engine/testing/bench.h"

namespace pheromone::engine {
namespace {

using field::FieldEdit;
using testing::Bench;

FieldEdit Square(uint8_t type, uint32_t level) {
  FieldEdit edit;
  edit.type = type;
  edit.level = level;
  edit.points = {{1'000'000, 1'000'000}, {1'400'000, 1'300'000}};
  return edit;
}

EngineConfig ConfigWithBlend() {
  EngineConfig config = testing::SmallConfig();
  field::PheromoneLaw blend;
  blend.type = 3;
  blend.name = "both";
  blend.blend = {{1, 1000}, {2, 1000}};
  config.field.pheromones.push_back(blend);
  return config;
}

// The outcome of a bench's only edit, after making all of its portions.
Status OutcomeOf(const FieldEdit& edit, Bench* bench) {
  bench->Apply(FieldEdited{edit});
  const uint64_t id = bench->sequence;
  constexpr int kMaxPortions = 1000;
  for (int portions = 0; portions < kMaxPortions; ++portions) {
    for (const field::FinishedWork& it : bench->engine.finished()) {
      if (it.id == id) {
        return it.outcome;
      }
    }
    bench->Apply(Advance{});
  }
  return Error{"it did not come to an end"};
}

TEST(Edit, FillsASquareNodeByNode) {
  Bench bench;
  EXPECT_TRUE(OutcomeOf(Square(1, 128), &bench).ok());
  const field::Field& field = bench.engine.field();
  EXPECT_EQ(field.node_count(), 5u * 4u);
  for (int32_t column = 9; column <= 15; ++column) {
    for (int32_t row = 9; row <= 14; ++row) {
      const bool inside = column >= 10 && column <= 14 && row >= 10 && row <= 13;
      EXPECT_EQ(field.LevelOf(1, {column, row}, bench.now_ms), inside ? 128u : 0u);
    }
  }
}

TEST(Edit, WhatIsFilledEvaporatesLikeADeposit) {
  Bench bench;
  bench.Apply(FieldEdited{Square(1, 2 * field::kLevelsPerQuantum)});
  bench.now_ms += 60'000;  // two quanta, one less every 30 s
  EXPECT_EQ(bench.engine.field().LevelOf(1, {10, 10}, bench.now_ms), 0u);
  const auto is_due = [&bench] {
    return bench.engine.NextDeadline().value_or(UINT64_MAX) <= bench.now_ms;
  };
  for (int step = 0; is_due(); ++step) {
    ASSERT_LT(step, 100);
    bench.Apply(Advance{});
  }
  EXPECT_EQ(bench.engine.field().node_count(), 0u);
}

TEST(Edit, SaysBeforehandWhatCannotBeDone) {
  const Bench bench(ConfigWithBlend());
  const auto error = [&bench](const FieldEdit& edit) {
    const Status status = bench.engine.CheckEdit(edit);
    return status.ErrorOr("nothing");
  };
  EXPECT_EQ(error(Square(1, 64)), "nothing");
  EXPECT_EQ(error(Square(4, 64)), "pheromone type 4 is not configured");
  EXPECT_EQ(error(Square(200, 64)), "pheromone type 200 is not configured");
  EXPECT_NE(error(Square(3, 64)).find("blend"), std::string::npos);
  EXPECT_EQ(error(Square(1, 8 * 64)), "nothing");
  EXPECT_NE(error(Square(1, 8 * 64 + 1)).find("512/64 quanta, not 513/64"), std::string::npos);
  FieldEdit erase = Square(1, UINT32_MAX);
  erase.action = FieldEdit::Action::kErase;
  EXPECT_EQ(error(erase), "nothing");  // whatever its level says
  FieldEdit pointless = Square(1, 64);
  pointless.points.clear();
  EXPECT_NE(error(pointless), "nothing");
  pointless.shape = FieldEdit::Shape::kStroke;
  EXPECT_NE(error(pointless), "nothing");
  FieldEdit unknown = Square(1, 64);
  unknown.shape = static_cast<FieldEdit::Shape>(9);
  EXPECT_NE(error(unknown).find("unknown shape"), std::string::npos);
  unknown = Square(1, 64);
  unknown.action = static_cast<FieldEdit::Action>(9);
  EXPECT_NE(error(unknown).find("unknown shape or action"), std::string::npos);
}

TEST(Edit, FarPointsAndLongStrokesAreRefusedAndNotComputed) {
  const Bench bench;
  FieldEdit edit = Square(1, 64);
  edit.points[1] = {INT64_MAX, INT64_MIN};
  EXPECT_FALSE(bench.engine.CheckEdit(edit).ok());
  edit.shape = FieldEdit::Shape::kStroke;
  edit.points = {{0, 0}, {2'000'000'000, 5}};
  EXPECT_TRUE(bench.engine.CheckEdit(edit).ok());
  edit.radius_um = 1;
  EXPECT_FALSE(bench.engine.CheckEdit(edit).ok());
  edit.radius_um = INT64_MAX;
  EXPECT_FALSE(bench.engine.CheckEdit(edit).ok());
  for (const int64_t negative : {int64_t{-1}, INT64_MIN}) {
    edit.radius_um = negative;
    EXPECT_NE(bench.engine.CheckEdit(edit).error().find("expected 0 or more"), std::string::npos);
  }
  edit.radius_um = 0;
  edit.points.assign(1025, {0, 0});
  EXPECT_FALSE(bench.engine.CheckEdit(edit).ok());
}

TEST(Edit, OfMoreThanThereIsMemoryForChangesNothingAndSaysSo) {
  EngineConfig config = testing::SmallConfig();
  config.field.memory_bytes = 40'000;
  Bench bench(config);
  bench.Handle(testing::Hello(1, 1));
  bench.Handle(testing::Deposit(1, 1, 1200, 1200, 2, 2));
  FieldEdit everywhere = Square(2, 64);
  everywhere.shape = FieldEdit::Shape::kAll;
  ASSERT_TRUE(bench.engine.CheckEdit(everywhere).ok());
  const Status outcome = OutcomeOf(everywhere, &bench);
  ASSERT_FALSE(outcome.ok());
  EXPECT_NE(outcome.error().find("memory"), std::string::npos);
  EXPECT_EQ(bench.engine.field().node_count(), 1u);
  EXPECT_EQ(bench.engine.field().LevelOf(2, {12, 12}, bench.now_ms), 128u);
  EXPECT_TRUE(OutcomeOf(Square(2, 64), &bench).ok());
}

}  // namespace
}  // namespace pheromone::engine
