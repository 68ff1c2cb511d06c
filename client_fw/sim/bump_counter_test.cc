#include "client_fw/sim/bump_counter.h"

#include <gtest/gtest.h>

namespace pheromone::sim {
namespace {

TEST(BumpCounter, PushingAgainstAWallIsOneBump) {
  BumpCounter bumps;
  bumps.Look(false, {});
  EXPECT_EQ(0u, bumps.count());
  for (int ms = 0; ms < 1000; ++ms) {
    bumps.Look(ms % 3 != 0, {1 + ms * 1e-6, 0, 0});  // creeps a millimetre in a second
  }
  EXPECT_EQ(1u, bumps.count());
}

TEST(BumpCounter, AStallAtAnotherPlaceIsAnotherBump) {
  BumpCounter bumps;
  bumps.Look(true, {1, 1, 0});
  bumps.Look(false, {1.5, 1, 0});
  bumps.Look(true, {1, 1.021, 0});
  EXPECT_EQ(2u, bumps.count());
}

}  // namespace
}  // namespace pheromone::sim
