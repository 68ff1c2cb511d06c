#include "client_fw/core/medium/census.h"

#include <gtest/gtest.h>

namespace pheromone {
namespace client {
namespace {

TEST(CensusTest, HasHeardNobodyAtFirst) {
  EXPECT_EQ(0, Census().robots());
}

TEST(CensusTest, CountsARobotOnceHoweverOftenItIsHeard) {
  Census census = Census();
  for (const uint8_t id : {uint8_t{7}, uint8_t{8}, uint8_t{7}, uint8_t{254}, uint8_t{8}}) {
    census.Hear(id);
  }
  EXPECT_EQ(3, census.robots());
}

TEST(CensusTest, BroadcastIsNoRobot) {
  Census census = Census();
  census.Hear(protocol::kBroadcastId);
  EXPECT_EQ(0, census.robots());
}

TEST(CensusTest, KeepsTheLastCountUntilThisOneIsHigher) {
  Census census = Census();
  census.Hear(1);
  census.Hear(2);
  census.Begin();
  EXPECT_EQ(2, census.robots());
  census.Hear(3);
  EXPECT_EQ(2, census.robots());
  census.Hear(4);
  census.Hear(5);
  EXPECT_EQ(3, census.robots());
}

TEST(CensusTest, ForgetsWhoHasGoneAfterAWholeCensus) {
  Census census = Census();
  census.Hear(1);
  census.Begin();
  census.Begin();
  EXPECT_EQ(0, census.robots());
  census.Hear(1);  // back again
  EXPECT_EQ(1, census.robots());
}

TEST(CensusTest, HearsEveryIdThereIs) {
  Census census = Census();
  int robots = 0;
  for (int id = 0; id <= UINT8_MAX; ++id) {
    census.Hear(static_cast<uint8_t>(id));
    robots += id == protocol::kBroadcastId ? 0 : 1;
  }
  EXPECT_EQ(robots, census.robots());
}

}  // namespace
}  // namespace client
}  // namespace pheromone
