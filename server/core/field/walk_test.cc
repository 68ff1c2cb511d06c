// A hundred million requests of one client: testing/walk.h.

#include "server/core/field/testing/walk.h"

#include <gtest/gtest.h>

namespace pheromone::field {
namespace {

using testing::Client;
using testing::WalkAndWatch;

constexpr int64_t kRequests = 100'000'000;

TEST(Walk, OnATrailThatEvaporatesStaysWithinTheLimit) {
  WalkAndWatch(Client::kWalks, 1, kRequests);
}

TEST(Walk, OnOneThatDoesNotFillsTheMapAndNoMore) {
  WalkAndWatch(Client::kWalks, 2, kRequests);
}

TEST(Walk, AnywhereAtRandomStaysWithinTheLimit) {
  WalkAndWatch(Client::kJumps, 1, kRequests / 1'000);
}

}  // namespace
}  // namespace pheromone::field
