// More changes, leaders and crashes together than replica_test.cc has.

#include <gtest/gtest.h>

#include "client_fw/verify/replica_world.h"
#include "client_fw/verify/testing/proofs.h"

namespace pheromone::verify {
namespace {

void ExpectProvedAtLength(const ReplicaLimits& limits) {
  ExpectProof(ExploreReplicas(limits, 10'000'000));
}

TEST(Log, OfThreeLeadersWithTwoChanges) {
  ExpectProvedAtLength({.changes = 2, .asks = 3, .unknowns = 1, .doubles = 1});
}

// The second and the third change may be in one group, within which a journal may end.
TEST(Log, OfGroupsOfTwo) {
  ExpectProvedAtLength({.changes = 3, .asks = 2, .unknowns = 1, .doubles = 1});
  ExpectProvedAtLength({.changes = 3, .asks = 2, .unknowns = 0, .crashes = 1, .doubles = 1});
}

TEST(Log, ThroughLossesAndACrash) {
  ExpectProvedAtLength({.changes = 2, .asks = 2, .unknowns = 1, .crashes = 1, .doubles = 1});
  ExpectProvedAtLength({.changes = 1, .asks = 3, .unknowns = 1, .crashes = 1, .doubles = 1});
}

TEST(Log, ThroughTwoCrashes) {
  ExpectProvedAtLength({.changes = 1, .asks = 2, .unknowns = 1, .crashes = 2, .doubles = 1});
}

}  // namespace
}  // namespace pheromone::verify
