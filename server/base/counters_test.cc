#include "server/base/counters.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace pheromone {
namespace {

struct Inner {
  uint64_t a = 0;
  uint64_t b = 0;
};

struct Counters : Inner {
  uint64_t c = 0;
  Inner more;
};

TEST(CountersTest, EachIsAddedAndSubtractedByItself) {
  const Counters x{{1, 20}, 300, {4'000, UINT64_MAX}};
  const Counters y{{5, 60}, 700, {8'000, 1}};
  const Counters sum = SumOf(x, y);
  EXPECT_EQ(sum.a, 6u);
  EXPECT_EQ(sum.b, 80u);
  EXPECT_EQ(sum.c, 1'000u);
  EXPECT_EQ(sum.more.a, 12'000u);
  EXPECT_EQ(sum.more.b, 0u) << "it wraps";
  const Counters difference = DifferenceOf(sum, x);
  EXPECT_EQ(difference.a, 5u);
  EXPECT_EQ(difference.b, 60u);
  EXPECT_EQ(difference.c, 700u);
  EXPECT_EQ(difference.more.a, 8'000u);
  EXPECT_EQ(difference.more.b, 1u);
}

}  // namespace
}  // namespace pheromone
