// The memory limit means what the process takes: of the system, not of a budget of our own.

#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>

#include "server/core/field/field.h"
#include "server/core/field/testing/trail_field.h"

namespace pheromone::field {
namespace {

using testing::TrailConfig;
using testing::TrailLaw;

constexpr uint64_t kMiB = 1 << 20;
constexpr uint64_t kLimit = 256 * kMiB;
// Pages of the heap, a chunk of each kind that is kept.
constexpr uint64_t kSmall = 16 * kMiB;

uint64_t ResidentBytes() {
  std::ifstream file("/proc/self/statm");
  uint64_t all = 0;
  uint64_t resident = 0;
  file >> all >> resident;
  return resident * 4096;
}

// 20 000 x 20 000 nodes, two types.
FieldConfig Config() {
  FieldConfig config = TrailConfig();
  config.map.cell_um = 10'000;
  config.map.width_um = 200'000'000;
  config.map.height_um = 200'000'000;
  config.pheromones[0].tau_ms = 0;
  config.pheromones.push_back(TrailLaw());
  config.pheromones[1].type = 2;
  config.pheromones[1].tau_ms = 0;
  config.memory_bytes = kLimit;
  return config;
}

// Deposits at each `step`-th node until there is no memory.
void Fill(Field* field, int64_t step) {
  const MapGeometry& map = field->config().map;
  for (int64_t y = 0; y <= map.height_um; y += step * map.cell_um) {
    for (int64_t x = 0; x <= map.width_um; x += step * map.cell_um) {
      const auto type = static_cast<uint8_t>(1 + x / map.cell_um / kTileSide % 2);
      if (field->Deposit(type, {x, y}, 1, 0) == DepositResult::kMapFull) {
        return;
      }
    }
  }
  FAIL() << "the map was expected to fill up";
}

void EraseAll(Field* field) {
  for (uint8_t type = 1; type <= 2; ++type) {
    FieldEdit edit;
    edit.type = type;
    edit.shape = FieldEdit::Shape::kAll;
    edit.action = FieldEdit::Action::kErase;
    ASSERT_TRUE(field->Edit(edit, 0).ok());
  }
}

TEST(ResidentMemory, StaysWithinTheLimitAndComesBack) {
  const uint64_t start = ResidentBytes();
  for (const int64_t step : {1, 8, 30}) {  // all nodes; one of each tile; seldom a whole leaf
    Field field(Config());
    for (int round = 0; round < 3; ++round) {
      Fill(&field, step);
      EXPECT_GT(field.used_bytes(), kLimit * 99 / 100);
      EXPECT_LE(ResidentBytes(), start + kLimit * 11 / 10 + kSmall);
      EraseAll(&field);
      // In the second round nobody releases what was erased before it is filled again.
      while (round != 1 && field.ReleaseMemory()) {
      }
      if (round != 1) {
        EXPECT_LE(ResidentBytes(), start + kSmall);
      }
    }
  }
  EXPECT_LE(ResidentBytes(), start + kSmall);
}

}  // namespace
}  // namespace pheromone::field
