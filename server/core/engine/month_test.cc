// Long times: memory follows the live nodes, and the deadlines cover all work.

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <tuple>

#include "server/base/hash.h"
#include "server/core/engine/engine.h"
#include "server/core/engine/testing/bench.h"

namespace pheromone::engine {
namespace {

using testing::Bench;
using testing::Deposit;
using testing::Hello;

constexpr uint64_t kHourMs = 3'600'000;
constexpr uint64_t kDayMs = 24 * kHourMs;

// Trails that evaporate in minutes, in hours by half-lives, and never, on 30 m x 30 m.
EngineConfig MonthConfig() {
  EngineConfig config = testing::SmallConfig();
  config.field.map.width_um = 30'000'000;
  config.field.map.height_um = 30'000'000;
  field::PheromoneLaw half = testing::Law(3, 1'800'000);
  half.evaporation = field::Evaporation::kExponential;
  field::PheromoneLaw linear = testing::Law(4, 600'000);
  linear.evaporation = field::Evaporation::kLinear;
  config.field.pheromones.push_back(half);
  config.field.pheromones.push_back(linear);
  return config;
}

// The memory of the tiles of all nodes that are not empty at `now_ms`.
uint64_t BytesOfLiving(const field::Field& field, uint64_t now_ms) {
  std::set<std::tuple<uint8_t, int32_t, int32_t>> tiles;
  std::set<std::tuple<uint8_t, int32_t, int32_t>> leaves;
  for (const field::PheromoneLaw& law : field.config().pheromones) {
    field.VisitLevels(law.type, now_ms, [&](field::NodeIndex node, uint32_t) {
      tiles.emplace(law.type, node.column / field::kTileSide, node.row / field::kTileSide);
      constexpr int32_t kNodes = field::kTileSide * field::kLeafSide;
      leaves.emplace(law.type, node.column / kNodes, node.row / kNodes);
    });
  }
  return tiles.size() * field::CellMap::kTileBytes + leaves.size() * field::CellMap::kLeafBytes;
}

uint64_t TopBytes(const field::Field& field) {
  const field::MapGeometry& map = field.config().map;
  return field.config().pheromones.size() * field::CellMap::TopBytes(map.columns(), map.rows());
}

uint64_t HashOfDump(const field::Field& field) {
  const field::SweepState& sweep = field.sweep();
  uint64_t sum = Hash64({'W', sweep.type, static_cast<uint64_t>(sweep.leaf), sweep.earliest_ms,
                         sweep.cycle_ms, sweep.next_ms});
  field.ForEach([&](uint8_t type, field::NodeIndex node, field::NodeState state) {
    sum += field::Field::NodeHash(*field.FindLaw(type), node, state);
  });
  return sum;
}

// Does what a timer does: at every deadline until `until_ms`, one Advance.
uint64_t AdvanceUntil(Bench* bench, uint64_t until_ms) {
  constexpr uint64_t kMaxSteps = 1'000'000;
  uint64_t steps = 0;
  for (auto due = bench->engine.NextDeadline(); due && *due <= until_ms;
       due = bench->engine.NextDeadline()) {
    if (steps == kMaxSteps) {
      ADD_FAILURE() << "something is still due after " << steps << " steps";
      break;
    }
    bench->now_ms = std::max(bench->now_ms, *due);
    bench->Apply(Advance{});
    ++steps;
  }
  bench->now_ms = until_ms;
  return steps;
}

TEST(Month, MemoryReturnsToWhatLivesAndAReplayEndsInTheSameState) {
  Bench bench(MonthConfig());
  bench.Handle(Hello(1, 1));
  std::mt19937 random(30);
  uint64_t most_bytes = 0;
  uint64_t advances = 0;
  uint8_t seq = 0;
  for (int day = 0; day < 30; ++day) {
    // An hour of work on a random route, then the robots rest.
    const uint64_t morning_ms = bench.now_ms;
    int32_t x = static_cast<int32_t>(random() % 30'000);
    int32_t y = static_cast<int32_t>(random() % 30'000);
    while (bench.now_ms < morning_ms + kHourMs) {
      advances += AdvanceUntil(&bench, bench.now_ms + random() % 20'000);
      x = std::clamp<int32_t>(x + static_cast<int32_t>(random() % 600) - 300, 0, 30'000);
      y = std::clamp<int32_t>(y + static_cast<int32_t>(random() % 600) - 300, 0, 30'000);
      const auto kind = static_cast<uint32_t>(random() % 100);
      const auto type = static_cast<uint8_t>(kind == 0 ? 2 : kind % 3 == 0 ? 1 : 3 + kind % 2);
      ASSERT_EQ(
          bench.HandleForReason(Deposit(1, ++seq, static_cast<int16_t>(x), static_cast<int16_t>(y),
                                        static_cast<uint8_t>(1 + random() % 4), type)),
          protocol::Reason::kNone);
    }
    const field::Field& field = bench.engine.field();
    most_bytes = std::max(most_bytes, field.used_bytes());
    ASSERT_EQ(HashOfDump(field), field.hash());
    advances += AdvanceUntil(&bench, morning_ms + kDayMs);
    // By night everything has evaporated, and its memory is released.
    ASSERT_EQ(field.used_bytes(), BytesOfLiving(field, bench.now_ms) + TopBytes(field)) << day;
    field.ForEach([&](uint8_t type, field::NodeIndex, field::NodeState) { ASSERT_EQ(type, 2); });
    ASSERT_FALSE(bench.engine.NextDeadline().has_value()) << "nothing left to wait for";
    ASSERT_EQ(HashOfDump(field), field.hash());
  }
  const field::Field& field = bench.engine.field();
  EXPECT_LT(field.used_bytes(), most_bytes);
  EXPECT_GT(field.node_count(), 0u);
  EXPECT_GT(advances, 1'000u);

  Engine replayed;
  uint64_t sequence = 0;
  std::vector<Outgoing> out;
  for (const auto& [now_ms, event] : bench.log) {
    ++sequence;
    replayed.Apply(sequence, {now_ms, static_cast<int64_t>(sequence)}, event, &out);
  }
  EXPECT_EQ(replayed.StateHash(), bench.engine.StateHash());
  EXPECT_EQ(replayed.field().used_bytes(), field.used_bytes());
}

// Each Advance is one bounded step, but the deadlines go on until all is done.
TEST(Month, WhatDiedInOneNightIsGivenBackInBoundedSteps) {
  EngineConfig config = testing::SmallConfig();
  config.field.map.width_um = 300'000'000;
  config.field.map.height_um = 300'000'000;
  config.field.memory_bytes = 64 << 20;
  Bench bench(config);
  // A node in each of three times as many tiles as one step looks at.
  constexpr int32_t kSide = 158;
  static_assert(kSide * kSide > 3 * field::Field::kTilesAtOnce);
  bench.Handle(Hello(1, 1));
  uint8_t seq = 0;
  for (int32_t row = 0; row < kSide; ++row) {
    for (int32_t column = 0; column < kSide; ++column) {
      const auto trace = testing::MessageOf(
          protocol::TraceRequest{1, 1, true, ++seq, {column * 800, row * 800, 0}});
      ASSERT_EQ(bench.HandleForReason(trace), protocol::Reason::kNone);
    }
  }
  bench.now_ms += kDayMs;
  int steps = 0;
  while (bench.engine.NextDeadline()) {
    const size_t before = bench.engine.field().tile_count();
    bench.now_ms = std::max(bench.now_ms, *bench.engine.NextDeadline());
    bench.Apply(Advance{});
    const size_t given_back = before - bench.engine.field().tile_count();
    EXPECT_LE(given_back, size_t{field::Field::kTilesAtOnce} + 256);  // the last leaf is whole
    ASSERT_LT(++steps, 100);
  }
  EXPECT_GE(steps, 3);
  EXPECT_EQ(bench.engine.field().tile_count(), 0u);
}

}  // namespace
}  // namespace pheromone::engine
