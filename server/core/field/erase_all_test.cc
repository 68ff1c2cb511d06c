// Erasing a whole map costs the same however much is on it, and leaves what erasing each node
// leaves.

#include <gtest/gtest.h>

#include <string>

#include "server/core/field/field.h"
#include "server/core/field/testing/random_field.h"
#include "server/core/field/testing/trail_field.h"

namespace pheromone::field {
namespace {

using testing::OneIn;
using testing::Random;
using testing::RandomPoint;
using testing::TrailConfig;
using testing::TrailLaw;

// Four leaves; type 1 evaporates, type 2 stays, type 3 diffuses.
FieldConfig Config() {
  FieldConfig config = TrailConfig();
  config.map.width_um = 25'000'000;
  config.map.height_um = 20'000'000;
  for (uint8_t type = 2; type <= 3; ++type) {
    config.pheromones.push_back(TrailLaw());
    config.pheromones.back().type = type;
  }
  config.pheromones[1].tau_ms = 0;
  config.pheromones[2].evaporation = Evaporation::kExponential;
  config.pheromones[2].diffusion = {8'000, 1'000, 0xFF00'0000, 512};
  return config;
}

FieldEdit Erase(uint8_t type, const MapGeometry& map, bool at_once) {
  FieldEdit edit;
  edit.type = type;
  edit.action = FieldEdit::Action::kErase;
  edit.shape = at_once ? FieldEdit::Shape::kAll : FieldEdit::Shape::kRectangle;
  edit.points = {map.origin, {map.origin.x + map.width_um, map.origin.y + map.height_um}};
  return edit;
}

std::string Saved(const Field& field) {
  ByteWriter writer;
  field.Save(&writer);
  return writer.Take();
}

TEST(EraseAll, LeavesWhatErasingEachNodeLeaves) {
  Random random(3);
  Field at_once(Config());
  Field each(Config());
  uint64_t now_ms = 0;
  for (int i = 0; i < 20'000; ++i) {
    now_ms += random() % 20;
    const auto type = static_cast<uint8_t>(1 + random() % 3);
    // Steps of what diffuses count from when its first node is written, be it by an erasure.
    if (type != 3 && OneIn(random, 1'000)) {
      ASSERT_TRUE(at_once.Edit(Erase(type, at_once.config().map, true), now_ms).ok());
      ASSERT_TRUE(each.Edit(Erase(type, each.config().map, false), now_ms).ok());
      ASSERT_EQ(Saved(at_once), Saved(each));
      ASSERT_EQ(at_once.node_count(), each.node_count());
      ASSERT_EQ(at_once.tile_count(), each.tile_count());
    } else if (OneIn(random, 50)) {
      at_once.Advance(now_ms);
      each.Advance(now_ms);
    } else if (OneIn(random, 10)) {
      at_once.ReleaseMemory();  // which changes nothing
    } else {
      const PointUm point = RandomPoint(random, at_once.config().map);
      ASSERT_EQ(at_once.Deposit(type, point, 2, now_ms), each.Deposit(type, point, 2, now_ms));
    }
    if (i % 100 == 0) {
      ASSERT_EQ(at_once.hash(), each.hash()) << i;
    }
    ASSERT_EQ(at_once.used_bytes(), each.used_bytes()) << i;
    ASSERT_EQ(at_once.NextDeadline(), each.NextDeadline()) << i;
  }
  EXPECT_EQ(Saved(at_once), Saved(each));
}

TEST(EraseAll, ItsMemoryIsGivenBackInPortions) {
  Random random(4);
  Field field(Config());
  for (int i = 0; i < 10'000; ++i) {
    field.Deposit(static_cast<uint8_t>(1 + i % 3), RandomPoint(random, field.config().map), 2, 0);
  }
  EXPECT_FALSE(field.has_garbage());
  EXPECT_FALSE(field.ReleaseMemory());
  for (uint8_t type = 1; type <= 3; ++type) {
    ASSERT_TRUE(field.Edit(Erase(type, field.config().map, true), 0).ok());
  }
  EXPECT_TRUE(field.has_garbage());
  const uint64_t hash = field.hash();
  int portions = 1;
  while (field.ReleaseMemory()) {
    ASSERT_LT(++portions, 100);
  }
  EXPECT_FALSE(field.has_garbage());
  EXPECT_EQ(field.hash(), hash);
}

}  // namespace
}  // namespace pheromone::field
