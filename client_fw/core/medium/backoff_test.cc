#include "client_fw/core/medium/backoff.h"

#include <gtest/gtest.h>

#include <vector>

namespace pheromone {
namespace client {
namespace {

std::vector<int> Draws(Random random, int count) {
  std::vector<int> draws(static_cast<size_t>(count));
  for (int& draw : draws) {
    draw = random.Below(64);
  }
  return draws;
}

TEST(ContentionWindowTest, DoublesOnAMissUpToEightSlotsAndTwoForEachOther) {
  ContentionWindow window;
  EXPECT_EQ(8, window.slots());
  for (const int expected : {16, 32, 64, 72, 72}) {
    window.OnMiss(32);
    EXPECT_EQ(expected, window.slots());
  }
}

TEST(ContentionWindowTest, ShrinksAtOnceWhenOthersHaveGone) {
  ContentionWindow window;
  for (int i = 0; i < 4; ++i) {
    window.OnMiss(32);
  }
  for (const uint8_t others : {uint8_t{10}, uint8_t{3}, uint8_t{0}}) {
    window.OnMiss(others);
    EXPECT_EQ(8 + 2 * others, window.slots());
  }
}

TEST(ContentionWindowTest, ShrinksByAnEighthDownTo8) {
  ContentionWindow window;
  for (int i = 0; i < 3; ++i) {
    window.OnMiss(32);
  }
  // x - floor(x / 8), never under 8.
  for (const int expected :
       {56, 49, 43, 38, 34, 30, 27, 24, 21, 19, 17, 15, 14, 13, 12, 11, 10, 9, 8, 8}) {
    window.OnSuccess();
    EXPECT_EQ(expected, window.slots());
  }
}

TEST(RandomTest, SameSeedSameSequence) {
  EXPECT_EQ(Draws(Random(7, 3), 100), Draws(Random(7, 3), 100));
}

TEST(RandomTest, NeighboursAndNextBootDiffer) {
  EXPECT_NE(Draws(Random(7, 3), 8), Draws(Random(8, 3), 8));
  EXPECT_NE(Draws(Random(7, 3), 8), Draws(Random(7, 4), 8));
}

// Two robots that draw the same delay collide, and draw again: if that kept them together, they
// would collide for ever. Among all boots of all other robots are those that begin as this one.
TEST(RandomTest, NoTwoRobotsStayTogether) {
  constexpr int kTogether = 12;  // by chance once in 8^12
  for (int id = 2; id <= 254; ++id) {
    for (int boot = 0; boot < 65536; ++boot) {
      Random one(1, 7);
      Random other(static_cast<uint8_t>(id), static_cast<uint16_t>(boot));
      int together = 0;
      while (together < kTogether && one.Below(8) == other.Below(8)) {
        ++together;
      }
      ASSERT_LT(together, kTogether) << "ID " << id << ", boot " << boot;
    }
  }
}

TEST(RandomTest, StaysBelowTheBoundAndReachesEveryValue) {
  Random random(1, 1);
  std::vector<int> seen(8);
  for (int i = 0; i < 8000; ++i) {
    const uint16_t value = random.Below(8);
    ASSERT_LT(value, 8);
    ++seen[value];
  }
  for (const int count : seen) {
    EXPECT_NEAR(1000, count, 150);  // five standard deviations
  }
}

TEST(RandomTest, FirstDrawsOfASwarmAreSpread) {
  std::vector<int> seen(8);
  for (int id = 1; id <= 254; ++id) {
    ++seen[Random(static_cast<uint8_t>(id), 1).Below(8)];
  }
  for (const int count : seen) {
    EXPECT_GT(count, 15);
    EXPECT_LT(count, 50);
  }
}

TEST(RandomTest, BelowZeroIsZero) {
  EXPECT_EQ(0, Random(1, 1).Below(0));
}

TEST(ContentionWindowTest, StopsGrowingWhereItsTypeEnds) {
  for (const uint8_t others : {uint8_t{123}, uint8_t{127}, uint8_t{200}, uint8_t{254}}) {
    ContentionWindow window;
    for (int i = 0; i < 10; ++i) {
      const uint8_t before = window.slots();
      window.OnMiss(others);
      EXPECT_GE(window.slots(), before);
    }
    EXPECT_EQ(kMaxWindow, window.slots());
  }
}

}  // namespace
}  // namespace client
}  // namespace pheromone
