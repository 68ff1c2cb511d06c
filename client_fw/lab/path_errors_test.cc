#include "client_fw/lab/path_errors.h"

#include <gtest/gtest.h>

#include "client_fw/lab/testing/worlds.h"

namespace pheromone::lab {
namespace {

// Two paths along y; a robot 0.3 m beside the first one, and one 0.1 m beside the second.
TEST(PathErrors, AreTheDistancesFromTheNearestPathOnceASecond) {
  WorldConfig config = testing::SmallWorld();
  for (const int64_t x_um : {2'000'000, 6'000'000}) {
    field::Path path;
    path.type = 2;
    path.points = {{x_um, 1'000'000}, {x_um, 9'000'000}};
    config.field.paths.push_back(path);
  }
  config.groups = {testing::Alone({2.3, 5, 0})};
  config.groups[0].starts.push_back({5.9, 5, 0});
  config.measure_from_ms = 3'000;
  const auto world = testing::Made(std::move(config));
  for (int step = 0; step < 50; ++step) {
    ASSERT_TRUE(world->Step().ok());
  }
  EXPECT_EQ(world->tally().path_errors.samples, 2u * 7);
  EXPECT_NEAR(world->tally().path_errors.mean_m(), 0.2, 1e-6);
}

}  // namespace
}  // namespace pheromone::lab
