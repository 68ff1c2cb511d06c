#include "client_fw/lab/walls.h"

#include <gtest/gtest.h>

#include <random>
#include <utility>

namespace pheromone::lab {
namespace {

// Every blocked square, and its nearest point.
bool TouchesAny(const field::FieldConfig& field, double x_m, double y_m, double radius_m) {
  const double half_m = static_cast<double>(field.map.cell_um) / 2e6;
  bool touches = false;
  field.obstacles->ForEach([&](field::NodeIndex node) {
    const field::PointUm at = field.map.PositionOf(node);
    const double dx = std::max(0.0, std::abs(x_m - static_cast<double>(at.x) / 1e6) - half_m);
    const double dy = std::max(0.0, std::abs(y_m - static_cast<double>(at.y) / 1e6) - half_m);
    touches = touches || std::hypot(dx, dy) <= radius_m;
  });
  return touches;
}

TEST(Walls, ADiscTouchesThemWhereLookingAtEverySquareSaysSo) {
  std::mt19937_64 random(3);
  const auto uniform = [&random](double least, double most) {
    return least + (most - least) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  int touched = 0;
  for (int world = 0; world < 20; ++world) {
    field::FieldConfig field;
    field.map = {.origin = {-1'000'000, 300'000},
                 .width_um = 4'012'345,
                 .height_um = 3'000'000,
                 .cell_um = 20'000 + static_cast<int64_t>(random() % 200'000)};
    field::ObstacleMask mask(field.map.columns(), field.map.rows());
    for (int i = 0; i < 6; ++i) {
      mask.Set({static_cast<int32_t>(random() % static_cast<uint64_t>(mask.columns())),
                static_cast<int32_t>(random() % static_cast<uint64_t>(mask.rows()))});
    }
    field.obstacles = field::Shared(std::move(mask));
    const Walls walls(field, 0.3);
    for (int i = 0; i < 200; ++i) {
      const double x = uniform(-1, 3.01);
      const double y = uniform(0.3, 3.3);
      const double radius = uniform(0, 0.3);
      ASSERT_EQ(walls.Touches(x, y, radius), TouchesAny(field, x, y, radius));
      touched += walls.Touches(x, y, radius) ? 1 : 0;
    }
  }
  EXPECT_GT(touched, 100);
}

TEST(Walls, TheMapEndsAtItsEdge) {
  field::FieldConfig field;
  field.map = {.origin = {0, 0}, .width_um = 4'000'000, .height_um = 3'000'000, .cell_um = 100'000};
  const Walls walls(field, 0.1);
  EXPECT_TRUE(walls.IsOnMap(0, 3));
  EXPECT_TRUE(walls.IsOnMap(4, 0));
  EXPECT_FALSE(walls.IsOnMap(4.000001, 1));
  EXPECT_FALSE(walls.IsOnMap(1, -0.000001));
  EXPECT_FALSE(walls.Touches(0, 0, 0.1));
}

}  // namespace
}  // namespace pheromone::lab
