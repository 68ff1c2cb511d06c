// The bench of Ferreira et al. 2018 (deploy/examples/nets) through the checker, against counts of
// an independent model, a naive search, Spin and 4ti2.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "proto_tests/petri/contest_nets.h"
#include "server/core/petri/check.h"
#include "server/formats/nets/pnml.h"
#include "server/formats/nets/system_file.h"

namespace pheromone::nets {
namespace {

using petri::CheckReport;
using petri::Finding;
using petri::Verdict;

petri::Net Bench(const std::string& name, int64_t robots) {
  Result<petri::Net> net =
      LoadSystem(PHEROMONE_SOURCE_DIR "/deploy/examples/nets/" + name, {{"robots", robots}});
  EXPECT_TRUE(net.ok()) << net.error();
  return net.ok() ? std::move(net).value() : petri::Net{};
}

CheckReport Checked(const petri::Net& net, const petri::CheckOptions& options) {
  Result<CheckReport> report = petri::Check(net, options);
  EXPECT_TRUE(report.ok()) << report.error();
  return report.ok() ? std::move(report).value() : CheckReport{};
}

const Finding& ClaimOf(const CheckReport& report, const std::string& id) {
  const auto found = std::find_if(report.claims.begin(), report.claims.end(),
                                  [&](const auto& claim) { return claim.property.id == id; });
  EXPECT_NE(found, report.claims.end()) << id;
  return found->finding;
}

void ExpectAllProved(const CheckReport& report) {
  EXPECT_EQ(report.deadlock_free.verdict, Verdict::kProved);
  EXPECT_EQ(report.quasi_live.verdict, Verdict::kProved);
  for (const petri::CheckedClaim& claim : report.claims) {
    EXPECT_EQ(claim.finding.verdict, Verdict::kProved) << claim.property.id;
  }
}

// Each of them is enabled when its turn comes.
void Fire(const petri::Net& net, const std::vector<uint32_t>& transitions,
          petri::Marking* marking) {
  for (const uint32_t transition : transitions) {
    ASSERT_TRUE(petri::IsEnabled(net, transition, *marking)) << net.transitions[transition].id;
    *marking = petri::Fire(net, transition, *marking);
  }
}

TEST(BenchNets, HaveTheMarkingsOfAnIndependentModel) {
  const CheckReport two = Checked(Bench("motion.toml", 2), {});
  EXPECT_EQ(two.explored.states, 179'664u);
  EXPECT_EQ(two.live.verdict, Verdict::kProved);
  EXPECT_EQ(two.reversible.verdict, Verdict::kProved);
  EXPECT_EQ(two.components, 1u);
  ExpectAllProved(two);
  EXPECT_EQ(Checked(Bench("motion.toml", 3), {.recurrence = false}).explored.states, 1'360'960u);
}

TEST(BenchNets, KanbanHasItsPublishedMarkings) {
  const CheckReport report = Checked(ContestNet("kanban", 4), {});
  EXPECT_EQ(report.explored.states, 454'475u);
  EXPECT_EQ(report.live.verdict, Verdict::kProved);
  EXPECT_EQ(Checked(ContestNet("kanban", 5), {.recurrence = false}).explored.states, 2'546'432u);
}

TEST(BenchNets, AreProvedForTwoToSixRobots) {
  for (int64_t robots = 2; robots <= 6; ++robots) {
    SCOPED_TRACE(robots);
    const CheckReport report = Checked(Bench("motion.toml", robots), {.reduce = true});
    ExpectAllProved(report);
    EXPECT_EQ(report.live.verdict, Verdict::kProved);
    EXPECT_EQ(report.reversible.verdict, Verdict::kProved);
  }
  for (int64_t robots = 2; robots <= 3; ++robots) {
    SCOPED_TRACE(robots);
    ExpectAllProved(Checked(Bench("pheromone.toml", robots), {.reduce = true}));
  }
}

// What the invariant does not name, such as the nest, may have any number of tokens.
TEST(BenchNets, ExcludeAnyNumberOfRobotsByAnInvariant) {
  for (const char* const name : {"motion.toml", "pheromone.toml"}) {
    petri::CheckOptions options;
    options.limits.max_states = 1;
    const petri::Net net = Bench(name, 1000);
    const CheckReport report = Checked(net, options);
    for (const char* const id : {"one_robot_at_P", "one_robot_at_source"}) {
      const Finding& finding = ClaimOf(report, id);
      EXPECT_EQ(finding.verdict, Verdict::kProved);
      EXPECT_EQ(finding.method, Finding::Method::kStructural);
      EXPECT_NE(finding.because.find("P-invariant"), std::string::npos);
      EXPECT_NE(finding.because.find("Free"), std::string::npos) << finding.because;
      EXPECT_EQ(finding.because.find("+ nest"), std::string::npos) << finding.because;
    }
  }
  // Rank 50 of 71 places, and 59 of 83; so many minimal semiflows 4ti2 has.
  const CheckReport motion = Checked(Bench("motion.toml", 2), {.recurrence = false});
  EXPECT_EQ(motion.invariants.flows.size(), 21u);
  EXPECT_EQ(motion.place_semiflows.flows.size(), 52u);
  petri::CheckOptions structure_only;
  structure_only.limits.max_states = 1;
  const CheckReport pheromone = Checked(Bench("pheromone.toml", 2), structure_only);
  EXPECT_EQ(pheromone.invariants.flows.size(), 24u);
  EXPECT_EQ(pheromone.place_semiflows.flows.size(), 55u);
}

TEST(BenchNets, BreakWhereThePaperIsTakenLiterally) {
  const auto check = [](const std::string& name, int64_t robots, bool reduce) {
    petri::CheckOptions options;
    options.reduce = reduce;
    options.limits.max_states = 300'000;
    return Checked(Bench("broken/" + name, robots), options);
  };
  const auto length = [](const Finding& finding) {
    return finding.verdict == Verdict::kRefuted ? static_cast<int>(finding.trace->size()) : -1;
  };
  EXPECT_EQ(length(check("red_by_timer.toml", 1, false).deadlock_free), 5);
  EXPECT_EQ(length(check("green_before_busy.toml", 1, false).deadlock_free), 25);
  EXPECT_EQ(length(ClaimOf(check("green_before_busy.toml", 2, false), "one_robot_at_P")), 11);
  EXPECT_EQ(length(check("copies_of_free.toml", 1, false).deadlock_free), 28);
  EXPECT_EQ(length(ClaimOf(check("copies_of_free.toml", 2, false), "one_robot_at_P")), 28);
  EXPECT_EQ(length(ClaimOf(check("stale_green.toml", 2, false), "one_robot_at_P")), 8);
  EXPECT_EQ(length(ClaimOf(check("exit_senses_again.toml", 2, false), "one_robot_at_P")), 29);
  EXPECT_EQ(length(check("presence_stays.toml", 1, false).deadlock_free), 29);
  EXPECT_EQ(length(check("stop_in_area.toml", 1, false).deadlock_free), 7);
  EXPECT_EQ(length(check("stop_in_queue.toml", 2, false).deadlock_free), 2);
  EXPECT_EQ(check("stop_parked.toml", 2, true).deadlock_free.verdict, Verdict::kProved);
  EXPECT_EQ(length(ClaimOf(check("one_field.toml", 1, false), "what_is_read_is_advice")), 31);
  const Finding starves =
      ClaimOf(check("static_priority.toml", 3, true), "Semaphore1.S2_overtaken_once");
  EXPECT_EQ(starves.because, "without bound");
  const petri::Net unfair = Bench("broken/static_priority.toml", 3);
  petri::Marking marking = petri::InitialMarking(unfair);
  Fire(unfair, *starves.trace, &marking);
  const petri::Marking before = marking;
  Fire(unfair, starves.cycle, &marking);
  EXPECT_EQ(marking, before);
  EXPECT_FALSE(starves.cycle.empty());
  EXPECT_EQ(check("reader_ready_self_loop.toml", 1, false).safe.verdict, Verdict::kRefuted);
}

TEST(BenchNets, DeadlockWhenTheirLanesAreTooShort) {
  const auto deadlock = [](int64_t robots) {
    petri::CheckOptions options;
    options.reduce = true;
    options.recurrence = false;
    return Checked(Bench("broken/finite_lanes.toml", robots), options).deadlock_free.verdict;
  };
  EXPECT_EQ(deadlock(5), Verdict::kProved);
  EXPECT_EQ(deadlock(6), Verdict::kRefuted);
}

// Through PNML of the standard, without inhibitor and read arcs, nothing is lost.
TEST(BenchNets, SurviveTheStandard) {
  const petri::Net net = Bench("motion.toml", 2);
  const Result<petri::Net> read = ParsePnml("motion.pnml", ToPnml(net));
  ASSERT_TRUE(read.ok()) << read.error();
  EXPECT_EQ(read.value(), net);
}

}  // namespace
}  // namespace pheromone::nets
