#include "server/base/hash.h"

#include <gtest/gtest.h>

#include <set>

namespace pheromone {
namespace {

// The published reference outputs of SplitMix64 with seed 1234567: its n-th output is the finaliser
// of seed + n * 0x9E3779B97F4A7C15, that is, our step with hash = seed + (n - 1) * golden, word 0.
TEST(HashStep, EqualsThePublishedSequenceOfSplitMix64) {
  const uint64_t golden = 0x9E3779B97F4A7C15u;
  EXPECT_EQ(HashStep(1234567u + 0 * golden, 0), 6457827717110365317u);
  EXPECT_EQ(HashStep(1234567u + 1 * golden, 0), 3203168211198807973u);
  EXPECT_EQ(HashStep(1234567u + 2 * golden, 0), 9817491932198370423u);
}

TEST(Hash64, DependsOnEachWordAndOnTheirOrder) {
  const std::set<uint64_t> hashes = {Hash64({1, 2, 3}), Hash64({1, 3, 2}), Hash64({1, 2}),
                                     Hash64({1, 2, 3, 0}), Hash64({0, 1, 2, 3})};
  EXPECT_EQ(hashes.size(), 5u);
}

TEST(HashText, TellsTextsApart) {
  const std::set<uint64_t> hashes = {HashText(""), HashText("a"), HashText("b"), HashText("ab"),
                                     HashText(std::string_view("a\0", 2))};
  EXPECT_EQ(hashes.size(), 5u);
}

}  // namespace
}  // namespace pheromone
