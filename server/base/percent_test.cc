#include "server/base/percent.h"

#include <gtest/gtest.h>

namespace pheromone {
namespace {

TEST(PercentTest, EncodingHasOneFormOnly) {
  EXPECT_EQ(PercentEncode("00:11/a b"), "00%3A11%2Fa%20b");
  EXPECT_EQ(PercentEncode(".."), "%2E%2E");
  EXPECT_EQ(PercentDecode("00%3A11%2Fa%20b"), "00:11/a b");
  for (const char* const wrong : {"%3a", "%41", "%", "%4", "a b", "a/b"}) {
    EXPECT_EQ(PercentDecode(wrong), std::nullopt) << wrong;
  }
}

}  // namespace
}  // namespace pheromone
