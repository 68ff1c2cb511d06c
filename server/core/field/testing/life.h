// Robots leave trails on a map for a long time, and nothing else happens but what Field asks for by
// NextDeadline: what is alive must always be what the oracle says, and memory must follow it.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <set>
#include <tuple>
#include <vector>

#include "server/core/field/field.h"
#include "server/core/field/testing/naive_field.h"
#include "server/core/field/testing/random_field.h"

namespace pheromone::field::testing {

/// 240 x 160 cells in four leaves; trails that live for minutes, hours and a day, by three laws.
inline FieldConfig LifeConfig() {
  FieldConfig config;
  config.map = {.origin = {-3'000'000, 1'000'000},
                .width_um = 24'000'000,
                .height_um = 16'000'000,
                .cell_um = 100'000};
  config.antennas.distance_um = 300'000;
  config.memory_bytes = 64 << 20;
  constexpr int64_t kMinute = 60'000;
  struct Kind {
    Evaporation evaporation;
    int64_t tau_ms;
  };
  uint8_t type = 0;
  for (const Kind kind :
       {Kind{Evaporation::kCounter, 2 * kMinute}, Kind{Evaporation::kLinear, 60 * kMinute},
        Kind{Evaporation::kExponential, 90 * kMinute}}) {
    PheromoneLaw law;
    law.type = ++type;
    law.core_um = 200'000;
    law.sigma_um = 600'000;
    law.evaporation = kind.evaporation;
    law.tau_ms = kind.tau_ms;
    law.quantum_micro = 10'000;
    law.max_count = 20;
    law.directional = false;
    config.pheromones.push_back(law);
  }
  return config;
}

/// The memory and the tiles of a field on which only what is alive was deposited. The top tables
/// stay once they are made.
struct Footprint {
  uint64_t bytes = 0;
  size_t tiles = 0;
};
inline Footprint FootprintOfTheLiving(const FieldConfig& config, const NaiveField& naive,
                                      uint64_t now_ms) {
  std::set<std::tuple<uint8_t, int32_t, int32_t>> tiles;
  std::set<std::tuple<uint8_t, int32_t, int32_t>> leaves;
  for (const PheromoneLaw& law : config.pheromones) {
    for (int32_t row = 0; row < config.map.rows(); ++row) {
      for (int32_t column = 0; column < config.map.columns(); ++column) {
        if (naive.LevelOf(law.type, {column, row}, now_ms) != 0) {
          tiles.emplace(law.type, column / 8, row / 8);
          leaves.emplace(law.type, column / 128, row / 128);
        }
      }
    }
  }
  return {tiles.size() * CellMap::kTileBytes + leaves.size() * CellMap::kLeafBytes +
              config.pheromones.size() * CellMap::TopBytes(config.map.columns(), config.map.rows()),
          tiles.size()};
}

/// Makes what is due up to `now_ms`, at the times that the field asks for.
inline void AdvanceTo(Field& field, uint64_t now_ms) {
  while (field.NextDeadline().has_value() && *field.NextDeadline() <= now_ms) {
    const uint64_t due_ms = *field.NextDeadline();
    field.Advance(due_ms);
    ASSERT_TRUE(!field.NextDeadline().has_value() || *field.NextDeadline() > due_ms);
  }
}

/// Lives for so long, with a deposit every 20 s on average, in strolls as robots make them.
inline Tally LiveFor(uint64_t duration_ms, uint64_t seed) {
  Random random(seed);
  const FieldConfig config = LifeConfig();
  Field field(config);
  Field unwatched(config);  // the same, but nobody ever senses anything on it
  NaiveField naive(config);
  Tally tally;
  PointUm robot = config.map.origin;
  uint64_t now_ms = 0;
  for (int i = 0; now_ms < duration_ms && !::testing::Test::HasFailure(); ++i) {
    now_ms += static_cast<uint64_t>(OneIn(random, 2'000) ? Between(random, 0, 200'000'000)
                                                         : Between(random, 0, 40'000));
    AdvanceTo(field, now_ms);
    AdvanceTo(unwatched, now_ms);
    robot = OneIn(random, 50) ? RandomPoint(random, config.map)
                              : PointUm{robot.x + Between(random, -150'000, 150'000),
                                        robot.y + Between(random, -150'000, 150'000)};
    if (!config.map.Contains(robot)) {
      robot = RandomPoint(random, config.map);
    }
    const auto type = static_cast<uint8_t>(Between(random, 1, 3));
    const auto quanta = static_cast<uint16_t>(Between(random, 1, 8));
    EXPECT_EQ(field.Deposit(type, robot, quanta, now_ms), DepositResult::kDone);
    EXPECT_EQ(unwatched.Deposit(type, robot, quanta, now_ms), DepositResult::kDone);
    naive.Deposit(type, robot, quanta, now_ms);
    const PoseUm pose{robot, static_cast<uint16_t>(random())};
    const Intensities p = field.Sense(type, pose, now_ms).value_or(Intensities{});
    if (i % 16 == 0) {
      const Intensities expected = naive.Sense(type, pose, now_ms);
      EXPECT_LE(std::abs(p.left - expected.left), type == 3 ? 1 : 0);
      EXPECT_LE(std::abs(p.right - expected.right), type == 3 ? 1 : 0);
      tally.Add(p);
    }
    if (i % 256 == 0) {
      EXPECT_EQ(field.hash(), unwatched.hash());
      EXPECT_EQ(field.hash(), HashFromADump(field));
      // All that was dead a moment ago has been swept: a round and its interval later.
      const uint64_t settled_ms = now_ms + 2 * Field::kSweepIntervalMs;
      AdvanceTo(field, settled_ms);
      AdvanceTo(unwatched, settled_ms);
      const Footprint then = FootprintOfTheLiving(config, naive, now_ms);
      const Footprint later = FootprintOfTheLiving(config, naive, settled_ms);
      if (field.used_bytes() > 0 && i > 256) {
        EXPECT_LE(field.used_bytes(), then.bytes);
        EXPECT_GE(field.used_bytes(), later.bytes);
        EXPECT_LE(field.tile_count(), then.tiles);
        EXPECT_GE(field.tile_count(), later.tiles);
      }
      now_ms = settled_ms;
    }
  }
  // And when all is over, everything comes back.
  AdvanceTo(field, now_ms + 100 * uint64_t{24} * 3'600'000);
  EXPECT_EQ(field.node_count(), 0u);
  EXPECT_EQ(field.used_bytes(), FootprintOfTheLiving(config, NaiveField(config), 0).bytes);
  EXPECT_FALSE(field.NextDeadline().has_value());
  ::testing::Test::RecordProperty("cases", tally.cases);
  ::testing::Test::RecordProperty("telling", tally.telling);
  return tally;
}

}  // namespace pheromone::field::testing
