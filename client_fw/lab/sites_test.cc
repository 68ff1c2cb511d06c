#include "client_fw/lab/sites.h"

#include <gtest/gtest.h>

namespace pheromone::lab {
namespace {

// A nest, and food with two loads that gets one more every 10 s.
Sites NestAndFood() {
  const SiteConfig configs[] = {
      {{.x_m = 0, .y_m = 0, .radius_m = 1, .amount = 0, .quality = 1, .is_food = 0}, 0},
      {{.x_m = 5, .y_m = 0, .radius_m = 1, .amount = 2, .quality = 3, .is_food = 1}, 10'000}};
  return Sites(configs);
}

TEST(Sites, LoadsArePickedUpInTheOrderOfTheRobotsAsLongAsThereAreSome) {
  Sites sites = NestAndFood();
  Robots robots(4, 0, false);
  robots.site = {2, 1, 2, 2};
  robots.want_load = {1, 1, 1, 1};
  sites.HandleLoads(0, &robots);
  EXPECT_EQ(robots.load, (std::vector<uint8_t>{2, 0, 2, 0}));
  EXPECT_EQ(sites.all()[1].amount, 0);
  sites.Refill(9'999);
  sites.HandleLoads(9'999, &robots);
  EXPECT_EQ(robots.load[3], 0);
  sites.Refill(10'000);
  sites.HandleLoads(10'000, &robots);
  EXPECT_EQ(robots.load[3], 2);
  sites.Refill(60'000);  // no more than at first
  EXPECT_EQ(sites.all()[1].amount, 2);
}

TEST(Sites, ALoadIsDeliveredAtANestAndLostElsewhere) {
  Sites sites = NestAndFood();
  sites.SetLeastWay(1, 0, 3.0);
  Robots robots(3, 0, false);
  robots.site = {2, 2, 2};
  robots.want_load = {1, 1, 0};
  robots.way_m = {10, 20, 0};
  sites.HandleLoads(1'000, &robots);
  robots.site = {1, 0, 1};
  robots.want_load = {-1, -1, -1};
  robots.way_m = {14, 29, 0};
  sites.HandleLoads(31'000, &robots);
  EXPECT_EQ(robots.load, (std::vector<uint8_t>{0, 0, 0}));
  EXPECT_EQ(sites.trips().delivered, 1u);
  EXPECT_EQ(sites.trips().lost, 1u);
  EXPECT_EQ(sites.trips().duration_ms, 30'000u);
  EXPECT_EQ(sites.trips().way_m, 4.0);
  EXPECT_EQ(sites.trips().least_way_m, 3.0);
  EXPECT_EQ(sites.trips().quality, 3.0);
  EXPECT_EQ(sites.all()[0].amount, 1);
}

TEST(Sites, AFailedRobotKeepsWhatItHas) {
  Sites sites = NestAndFood();
  Robots robots(1, 0, false);
  robots.site = {1};
  robots.load = {2};
  robots.want_load = {-1};
  robots.failed = {1};
  sites.HandleLoads(0, &robots);
  EXPECT_EQ(robots.load[0], 2);
}

}  // namespace
}  // namespace pheromone::lab
