// A month on a map: testing/life.h.

#include <gtest/gtest.h>

#include "server/core/field/testing/life.h"

namespace pheromone::field {
namespace {

TEST(Month, OfTrailsLeavesWhatIsAliveAndItsMemory) {
  EXPECT_GE(testing::LiveFor(30 * uint64_t{86'400'000}, 30).percent(), 90);
}

}  // namespace
}  // namespace pheromone::field
