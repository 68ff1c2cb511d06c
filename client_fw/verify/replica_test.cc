// What a cluster acknowledges is kept, once and in order: proved for small counters over the real
// Replica of each daemon.

#include <gtest/gtest.h>

#include <string>

#include "client_fw/verify/replica_world.h"
#include "client_fw/verify/testing/proofs.h"

namespace pheromone::verify {
namespace {

void ExpectProved(const ReplicaLimits& limits) {
  ExpectProof(ExploreReplicas(limits));
}

void ExpectRefuted(const ReplicaLimits& limits, const std::string& wrong) {
  ExpectRefutation(ExploreReplicas(limits), wrong);
}

// Any request may also arrive twice; all pages and answers may be late.
TEST(Log, OfOneLeaderAfterTheOther) {
  ExpectProved({.changes = 2, .asks = 2, .unknowns = 1, .doubles = 1});
}

TEST(Log, OfThreeLeaders) {
  ExpectProved({.changes = 1, .asks = 3, .unknowns = 1, .doubles = 1});
}

TEST(Log, ThroughRepeatedLosses) {
  ExpectProved({.changes = 2, .asks = 2, .unknowns = 2, .doubles = 1});
}

TEST(Log, ThroughACrash) {
  ExpectProved({.changes = 2, .asks = 2, .unknowns = 0, .crashes = 1, .doubles = 1});
  ExpectProved({.changes = 1, .asks = 2, .unknowns = 1, .crashes = 1, .doubles = 1});
}

TEST(Log, ThroughHandingOver) {
  ExpectProved({.changes = 2, .asks = 2, .unknowns = 0, .step_downs = 1, .doubles = 1});
}

// What a process takes for its own term may then be that of the process before: a leader's state
// may lack what was acknowledged, but nothing is lost.
TEST(Log, WithAFirstPageFromThePast) {
  ReplicaLimits limits{
      .changes = 1, .asks = 2, .unknowns = 1, .crashes = 1, .stale_reads = 1, .doubles = 1};
  ExpectRefuted(limits,
                "change 0 was acknowledged and is not in the state of a, which leads later");
  limits.only_the_log = true;
  ExpectProved(limits);
}

// If the first page is not from the past, the comparison of the term is enough.
TEST(Log, WithoutTheComparisonOfThePlace) {
  ExpectProved({.changes = 2,
                .asks = 2,
                .unknowns = 0,
                .crashes = 1,
                .doubles = 1,
                .log = LogMutant::kNoPlaceCompare});
}

TEST(LogMutant, ReplacesWhatIsAtThePlace) {
  ExpectRefuted({.changes = 2,
                 .asks = 2,
                 .unknowns = 0,
                 .crashes = 1,
                 .stale_reads = 1,
                 .only_the_log = true,
                 .log = LogMutant::kNoPlaceCompare},
                "b was given what is not the log");
}

TEST(LogMutant, AcceptsFormerLeaders) {
  ExpectRefuted({.changes = 1, .asks = 2, .unknowns = 0, .log = LogMutant::kNoTermCompare},
                "change 0 was acknowledged and is not in the state of b, which leads later");
}

// As an engine does that reads in portions and tells with each who leads.
TEST(LogMutant, TellsTheLeaderBeforeTheGroups) {
  ExpectRefuted({.changes = 2, .asks = 2, .unknowns = 0, .log = LogMutant::kTellsLeaderFirst},
                "change 1 was acknowledged and is not in the state of b, which leads later");
}

TEST(DaemonMutant, AcknowledgesBeforeTheLogDoes) {
  ExpectRefuted({.changes = 1, .asks = 2, .unknowns = 0, .daemon = DaemonMutant::kReleasesEarly},
                "change 0 was acknowledged and is not in the log");
}

TEST(DaemonMutant, RepeatsAGroupAtAnotherPlace) {
  ExpectRefuted({.changes = 1, .asks = 1, .unknowns = 1, .daemon = DaemonMutant::kResendsElsewhere},
                "change 0 is in the log 2 times");
}

TEST(DaemonMutant, GoesOnAfterItWasDeposed) {
  ExpectRefuted({.changes = 1, .asks = 2, .unknowns = 0, .daemon = DaemonMutant::kContinues},
                "a has uncommitted events in its state and does not lead");
}

}  // namespace
}  // namespace pheromone::verify
