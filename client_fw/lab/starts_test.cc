#include "client_fw/lab/starts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

namespace pheromone::lab {
namespace {

TEST(StartPlacer, FillsAnAreaWithoutOverlapsUntilThereIsNoRoom) {
  field::FieldConfig field;
  field.map = {
      .origin = {0, 0}, .width_um = 10'000'000, .height_um = 10'000'000, .cell_um = 100'000};
  field::ObstacleMask wall(field.map.columns(), field.map.rows());
  field::BlockRectangle(field.map, {3'000'000, 0}, {3'200'000, 9'000'000}, &wall);
  field.obstacles = field::Shared(std::move(wall));
  StartPlacer placer(field, 0.3, 9);
  std::vector<sim::PlanePose> found = {{2, 2, 0}};
  placer.Take(found[0], 0.3);
  for (auto start = placer.Find({1, 1, 5, 5}, 0.2); start; start = placer.Find({1, 1, 5, 5}, 0.2)) {
    found.push_back(*start);
  }
  // 16 m2 without the wall, and discs of 0.126 m2 dropped at random fill half of it.
  EXPECT_GT(found.size(), 40u);
  EXPECT_LT(found.size(), 90u);
  for (size_t a = 0; a < found.size(); ++a) {
    ASSERT_TRUE(a == 0 || found[a].x_m <= 2.75 || found[a].x_m >= 3.45) << found[a].x_m;
    ASSERT_TRUE(found[a].x_m >= 1 && found[a].x_m <= 5 && found[a].y_m >= 1 && found[a].y_m <= 5);
    for (size_t b = 0; b < a; ++b) {
      ASSERT_GE(std::hypot(found[a].x_m - found[b].x_m, found[a].y_m - found[b].y_m),
                b == 0 ? 0.5 : 0.4);
    }
  }
}

}  // namespace
}  // namespace pheromone::lab
