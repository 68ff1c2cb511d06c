#include "server/core/petri/check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "server/core/petri/testing/naive.h"
#include "server/core/petri/testing/nets.h"

namespace pheromone::petri {
namespace {

using testing::ElementsAre;

CheckReport Checked(const Net& net, const CheckOptions& options = {}) {
  Result<CheckReport> report = Check(net, options);
  EXPECT_TRUE(report.ok()) << report.error();
  return report.ok() ? std::move(report).value() : CheckReport{};
}

// The markings along a trace, each transition of which is enabled.
Marking After(const Net& net, const std::vector<uint32_t>& trace) {
  Marking marking = InitialMarking(net);
  for (const uint32_t transition : trace) {
    EXPECT_TRUE(IsEnabled(net, transition, marking)) << net.transitions[transition].id;
    marking = Fire(net, transition, marking);
  }
  return marking;
}

bool IsDead(const Net& net, const Marking& marking) {
  for (size_t t = 0; t < net.transitions.size(); ++t) {
    if (IsEnabled(net, t, marking)) {
      return false;
    }
  }
  return true;
}

TEST(Check, CountsTheMarkingsOfKanban) {
  // Ciardo, Tilgner 1996; the Model Checking Contest has the same.
  const uint64_t published[] = {160, 4'600, 58'400};
  for (uint32_t kanbans = 1; kanbans <= 3; ++kanbans) {
    const CheckReport report = Checked(Kanban(kanbans), {.recurrence = kanbans < 3});
    EXPECT_EQ(report.explored.states, published[kanbans - 1]);
    EXPECT_EQ(report.deadlock_free.verdict, Verdict::kProved);
    EXPECT_EQ(report.safe.verdict, kanbans == 1 ? Verdict::kProved : Verdict::kRefuted);
    EXPECT_EQ(report.bounded.method, Finding::Method::kStructural);
    EXPECT_EQ(report.bounds, std::vector<uint64_t>(16, kanbans));
  }
  EXPECT_EQ(Checked(Kanban(2)).reversible.verdict, Verdict::kProved);
  EXPECT_EQ(Checked(Kanban(2)).live.verdict, Verdict::kProved);
}

TEST(Check, PhilosophersDeadlockWhenEachHasOneFork) {
  for (int count = 2; count <= 6; ++count) {
    const Net net = Philosophers(count);
    for (const bool reduce : {false, true}) {
      const CheckReport report = Checked(net, {.reduce = reduce});
      ASSERT_EQ(report.deadlock_free.verdict, Verdict::kRefuted);
      EXPECT_EQ(report.deadlock_free.trace->size(), static_cast<size_t>(count));
      EXPECT_TRUE(IsDead(net, After(net, *report.deadlock_free.trace)));
      EXPECT_EQ(report.safe.method, Finding::Method::kStructural);
      EXPECT_EQ(report.reversible.verdict, Verdict::kRefuted);
      EXPECT_EQ(report.live.verdict, Verdict::kRefuted);
      EXPECT_EQ(report.not_live.size(), net.transitions.size());
    }
  }
}

// What may be fired first need not be fired at all: the trace that is told is the shortest without
// it.
TEST(Check, TracesOfAReducedSearchAreShortestToo) {
  Net net{.name = "n",
          .places = {{.id = "early", .tokens = 1},
                     {.id = "earlier"},
                     {.id = "earliest"},
                     {.id = "ready", .tokens = 1},
                     {.id = "done"}}};
  net.transitions = {
      {.id = "first", .takes = ArcsOf(net, {"early"}), .gives = ArcsOf(net, {"earlier"})},
      {.id = "second", .takes = ArcsOf(net, {"earlier"}), .gives = ArcsOf(net, {"earliest"})},
      {.id = "work", .takes = ArcsOf(net, {"ready"}), .gives = ArcsOf(net, {"done"})}};
  net.claims = {{"idle", "never done = 1"}};
  const CheckReport report = Checked(net, {.reduce = true});
  EXPECT_EQ(report.eager.size(), 2u);
  const Finding& finding = report.claims[0].finding;
  EXPECT_EQ(finding.verdict, Verdict::kRefuted);
  EXPECT_TRUE(finding.is_shortest);
  EXPECT_EQ(finding.trace, (std::vector<uint32_t>{2}));
}

TEST(Check, ProvesAndRefutesClaims) {
  Net net = Philosophers(4);
  net.claims = {{"neighbours", "never eats0 = 1 and eats1 = 1"},
                {"by invariant", "always eats0 + eats1 <= 1"},
                {"fork", "always fork1 + waits1 + eats1 + eats0 = 1"},
                {"opposite", "never eats0 + eats2 > 1"},
                {"both eat", "reachable eats1 + eats3 = 2"},
                {"all eat", "reachable eats0 + eats1 + eats2 + eats3 > 2"},
                {"eats again", "live puts_back2"}};
  const CheckReport report = Checked(net);
  const auto& claims = report.claims;
  EXPECT_EQ(claims[0].finding.verdict, Verdict::kProved);
  EXPECT_EQ(claims[0].finding.method, Finding::Method::kExhaustive);
  EXPECT_EQ(claims[1].finding.verdict, Verdict::kProved);
  EXPECT_EQ(claims[1].finding.method, Finding::Method::kStructural);
  EXPECT_EQ(claims[1].finding.because, "P-invariant eats0 + waits1 + eats1 + fork1 = 1");
  EXPECT_EQ(claims[2].finding.method, Finding::Method::kStructural);
  EXPECT_EQ(claims[2].finding.because, "no transition changes the sum");
  EXPECT_EQ(claims[3].finding.verdict, Verdict::kRefuted);
  EXPECT_EQ(claims[3].finding.trace->size(), 4u);
  const Marking met = After(net, *claims[3].finding.trace);
  EXPECT_EQ(met[static_cast<Eigen::Index>(PlaceOf(net, "eats0"))] +
                met[static_cast<Eigen::Index>(PlaceOf(net, "eats2"))],
            2);
  EXPECT_EQ(claims[4].finding.verdict, Verdict::kProved);
  EXPECT_EQ(claims[4].finding.trace->size(), 4u);
  EXPECT_EQ(claims[5].finding.verdict, Verdict::kRefuted);
  EXPECT_EQ(claims[6].finding.verdict, Verdict::kRefuted);
  EXPECT_TRUE(IsDead(net, After(net, *claims[6].finding.trace)));
}

// Two take turns at one place, or either may be served again and again.
Net Server(bool by_turns) {
  Net net{.name = "server",
          .places = {{.id = "free", .tokens = 1}, {.id = "turn0", .tokens = 1}, {.id = "turn1"}}};
  for (const char* const of : {"0", "1"}) {
    const std::string i(of);
    const std::string other = i == "0" ? "1" : "0";
    net.places.push_back({.id = "idle" + i, .tokens = 1});
    net.places.push_back({.id = "asks" + i});
    net.places.push_back({.id = "has" + i});
    net.transitions.push_back(
        {.id = "ask" + i, .takes = ArcsOf(net, {"idle" + i}), .gives = ArcsOf(net, {"asks" + i})});
    net.transitions.push_back({.id = "grant" + i,
                               .takes = ArcsOf(net, {"asks" + i, "free"}),
                               .gives = ArcsOf(net, {"has" + i})});
    if (by_turns) {
      net.transitions.back().takes.push_back(ArcOf(net, "turn" + i));
      net.transitions.back().gives.push_back(ArcOf(net, "turn" + other));
    }
    net.transitions.push_back({.id = "leave" + i,
                               .takes = ArcsOf(net, {"has" + i}),
                               .gives = ArcsOf(net, {"idle" + i, "free"})});
  }
  return net;
}

TEST(Check, BoundsHowOftenOneIsOvertaken) {
  Net fair = Server(true);
  fair.claims = {{"once", "overtaken at most 1 by grant1 while asks0 = 1"},
                 {"never", "overtaken at most 0 by grant1 while asks0 = 1"}};
  const CheckReport by_turns = Checked(fair);
  EXPECT_EQ(by_turns.claims[0].finding.verdict, Verdict::kProved);
  EXPECT_EQ(by_turns.claims[0].finding.because, "at most 1");
  ASSERT_EQ(by_turns.claims[1].finding.verdict, Verdict::kRefuted);
  EXPECT_EQ(fair.transitions[by_turns.claims[1].finding.trace->back()].id, "grant1");
  After(fair, *by_turns.claims[1].finding.trace);

  Net unfair = Server(false);
  unfair.claims = {{"often", "overtaken at most 1000 by grant1 while asks0 = 1"}};
  const CheckReport without = Checked(unfair);
  const Finding& finding = without.claims[0].finding;
  ASSERT_EQ(finding.verdict, Verdict::kRefuted);
  EXPECT_EQ(finding.because, "without bound");
  const Marking before = After(unfair, *finding.trace);
  std::vector<uint32_t> once_round = *finding.trace;
  once_round.insert(once_round.end(), finding.cycle.begin(), finding.cycle.end());
  EXPECT_EQ(After(unfair, once_round), before);
  EXPECT_EQ(before[static_cast<Eigen::Index>(PlaceOf(unfair, "asks0"))], 1);
  EXPECT_THAT(finding.cycle, testing::Contains(TransitionOf(unfair, "grant1")));
}

TEST(Check, FindsThatANetIsUnbounded) {
  Net net{.name = "source",
          .places = {{.id = "a", .tokens = 1}, {.id = "b"}, {.id = "c"}},
          .transitions = {{.id = "go", .takes = {{0}}, .gives = {{1}}},
                          {.id = "make", .takes = {{1}}, .gives = {{0}, {2}}}}};
  const CheckReport report = Checked(net);
  ASSERT_EQ(report.bounded.verdict, Verdict::kRefuted);
  EXPECT_EQ(report.safe.verdict, Verdict::kRefuted);
  EXPECT_EQ(report.deadlock_free.verdict, Verdict::kUnknown);
  EXPECT_EQ(report.deadlock_free.because, "the net is unbounded");
  const Marking before = After(net, *report.bounded.trace);
  std::vector<uint32_t> once_round = *report.bounded.trace;
  once_round.insert(once_round.end(), report.bounded.cycle.begin(), report.bounded.cycle.end());
  const Marking growth = After(net, once_round) - before;
  EXPECT_GE(growth.minCoeff(), 0);
  EXPECT_GT(growth[2], 0);

  // An inhibitor arc ends it at 100: no invariant says so.
  net.transitions[0].inhibitors = {{2, 100}};
  const CheckReport bounded = Checked(net);
  EXPECT_EQ(bounded.bounded.verdict, Verdict::kProved);
  EXPECT_EQ(bounded.bounded.method, Finding::Method::kExhaustive);
  EXPECT_EQ(bounded.bounds[2], 100u);
  EXPECT_EQ(bounded.explored.states, 201u);
}

TEST(Check, EndsAsUnknownWhenMemoryDoesNotSuffice) {
  CheckOptions options;
  options.limits.max_bytes = 1 << 20;
  const CheckReport report = Checked(Kanban(5), options);
  EXPECT_EQ(report.explored.end, Explored::End::kMemory);
  EXPECT_LE(report.explored.bytes, options.limits.max_bytes);
  EXPECT_EQ(report.deadlock_free.verdict, Verdict::kUnknown);
  EXPECT_EQ(report.deadlock_free.because, "out of the memory that was granted");
  EXPECT_EQ(report.live.verdict, Verdict::kUnknown);
  EXPECT_EQ(report.bounded.verdict, Verdict::kProved);  // by structure
  EXPECT_EQ(report.safe.verdict, Verdict::kRefuted);    // by one marking
}

TEST(Check, CanBeInterrupted) {
  uint64_t told = 0;
  const CheckReport report = Checked(Kanban(4), {.progress = [&](uint64_t states, uint64_t) {
                                       told = states;
                                       return false;
                                     }});
  EXPECT_GT(told, 0u);
  EXPECT_EQ(report.deadlock_free.because, "interrupted");
}

TEST(Check, AnEmptyNetIsDead) {
  const CheckReport report = Checked({.name = "nothing"});
  EXPECT_EQ(report.explored.states, 1u);
  EXPECT_EQ(report.deadlock_free.verdict, Verdict::kRefuted);
  EXPECT_THAT(*report.deadlock_free.trace, ElementsAre());
}

TEST(Check, RefusesWhatIsNotANet) {
  Net net = Philosophers(2);
  net.claims = {{"odd", "always eats9 = 1"}};
  EXPECT_EQ(
      Check(net, {}).error(),
      "net \"philosophers-2\": claim \"odd\", column 8: found \"eats9\", expected the ID of a "
      "place");
  net.transitions[0].takes[0].place = 99;
  EXPECT_FALSE(Check(net, {}).ok());
  const Net large{.name = "large", .places = std::vector<Place>(20'000)};
  EXPECT_FALSE(Check(large, {}).ok());
}

// Places without an order, each with a life of its own: 2^3000 markings.
TEST(Check, GivesUpWhatIsTooLargeToPack) {
  Net net{.name = "wide"};
  for (uint32_t i = 0; i < 3000; ++i) {
    net.places.push_back({.id = "p" + std::to_string(i), .tokens = 1});
    net.places.push_back({.id = "q" + std::to_string(i)});
    net.transitions.push_back(
        {.id = "t" + std::to_string(i), .takes = {{2 * i}}, .gives = {{2 * i + 1}}});
  }
  EXPECT_EQ(Check(net, {}).error(),
            "net \"wide\": a marking needs 3000 bits, expected 2048 at most");
  net.transitions.resize(1000);
  net.places.resize(2000);
  CheckOptions options;
  options.limits.max_states = 1000;
  const CheckReport report = Checked(net, options);
  EXPECT_EQ(report.key_bytes, 125u);
  EXPECT_EQ(report.safe.method, Finding::Method::kStructural);
}

// --- Against a naive search, on random nets

std::vector<Arc> SomeArcs(std::mt19937* random, size_t places, int one_in) {
  std::vector<Arc> arcs;
  for (uint32_t place = 0; place < places; ++place) {
    if ((*random)() % static_cast<uint32_t>(one_in) == 0) {
      arcs.push_back({place, 1 + ((*random)() % 8 == 0 ? 1U : 0U)});
    }
  }
  return arcs;
}

Net RandomNet(std::mt19937* random) {
  Net net{.name = "random"};
  const size_t places = 3 + (*random)() % 5;
  for (size_t i = 0; i < places; ++i) {
    net.places.push_back(
        {.id = "p" + std::to_string(i), .tokens = static_cast<uint32_t>((*random)() % 3)});
  }
  const size_t transitions = 3 + (*random)() % 6;
  for (size_t i = 0; i < transitions; ++i) {
    net.transitions.push_back({.id = "t" + std::to_string(i),
                               .takes = SomeArcs(random, places, 4),
                               .gives = SomeArcs(random, places, 5),
                               .reads = SomeArcs(random, places, 15),
                               .inhibitors = SomeArcs(random, places, 15)});
  }
  net.claims = {{"0", "never p0 + p1 > 2"},
                {"1", "always p0 <= p2 or p1 != 1"},
                {"2", "reachable p2 = 2 and p0 = 0"},
                {"3", "live t0"}};
  return net;
}

void ExpectSame(const NaiveGraph& naive, const Net& net, const CheckReport& report, bool reduced) {
  if (!reduced) {
    EXPECT_EQ(report.explored.states, naive.markings.size());
    EXPECT_EQ(report.explored.transitions, naive.edge_count());
    for (size_t place = 0; place < net.places.size(); ++place) {
      int32_t most = 0;
      for (const Marking& marking : naive.markings) {
        most = std::max(most, marking[static_cast<Eigen::Index>(place)]);
      }
      EXPECT_EQ(report.bounds[place], static_cast<uint64_t>(most));
    }
  } else {
    EXPECT_LE(report.explored.states, naive.markings.size());
  }
  const auto tokens = [&](size_t state, int place) { return naive.markings[state][place]; };
  const auto expect = [&](const Finding& finding, Verdict if_found,
                          const std::optional<size_t>& depth) {
    const Verdict other = if_found == Verdict::kRefuted ? Verdict::kProved : Verdict::kRefuted;
    EXPECT_EQ(finding.verdict, depth ? if_found : other);
    if (depth && finding.verdict == if_found) {
      EXPECT_EQ(finding.trace->size(), *depth);
    }
  };
  expect(report.deadlock_free, Verdict::kRefuted,
         naive.DepthOf([&](size_t state) { return naive.edges[state].empty(); }));
  expect(report.safe, Verdict::kRefuted,
         naive.DepthOf([&](size_t state) { return naive.markings[state].maxCoeff() > 1; }));
  expect(report.claims[0].finding, Verdict::kRefuted,
         naive.DepthOf([&](size_t s) { return tokens(s, 0) + tokens(s, 1) > 2; }));
  expect(report.claims[1].finding, Verdict::kRefuted, naive.DepthOf([&](size_t s) {
    return !(tokens(s, 0) <= tokens(s, 2) || tokens(s, 1) != 1);
  }));
  expect(report.claims[2].finding, Verdict::kProved,
         naive.DepthOf([&](size_t s) { return tokens(s, 2) == 2 && tokens(s, 0) == 0; }));
  const auto is_live = [&](size_t transition) {
    return naive.AlwaysAgain([&](size_t state) {
      return std::any_of(naive.edges[state].begin(), naive.edges[state].end(),
                         [&](const auto& edge) { return edge.transition == transition; });
    });
  };
  EXPECT_EQ(report.claims[3].finding.verdict == Verdict::kProved, is_live(0));
  const bool is_reversible = naive.AlwaysAgain([](size_t state) { return state == 0; });
  if (!reduced || report.reversible.verdict != Verdict::kUnknown) {
    EXPECT_EQ(report.reversible.verdict == Verdict::kProved, is_reversible);
  }
  for (uint32_t t = 0; t < net.transitions.size(); ++t) {
    const bool dies =
        std::find(report.not_live.begin(), report.not_live.end(), t) != report.not_live.end();
    EXPECT_EQ(dies, !is_live(t)) << t;
  }
}

// Some go round, and hand each other things through channels that hold one.
Net RandomMachines(std::mt19937* random) {
  Net net{.name = "machines"};
  const uint32_t channels = 2;
  for (uint32_t i = 0; i < channels; ++i) {
    net.places.push_back({.id = "p" + std::to_string(2 * i), .tokens = 1});  // empty
    net.places.push_back({.id = "p" + std::to_string(2 * i + 1)});           // full
  }
  for (uint32_t machine = 0; machine < 3; ++machine) {
    const auto first = static_cast<uint32_t>(net.places.size());
    const auto steps = static_cast<uint32_t>(2 + (*random)() % 3);
    for (uint32_t step = 0; step < steps; ++step) {
      net.places.push_back(
          {.id = "p" + std::to_string(first + step), .tokens = step == 0 ? 1U : 0U});
      Transition& it = net.transitions.emplace_back(
          Transition{.id = "t" + std::to_string(net.transitions.size())});
      it.takes = {{first + step}};
      it.gives = {{first + (step + 1) % steps}};
      const auto channel = static_cast<uint32_t>((*random)() % (3 * channels));
      if (channel < channels) {
        const uint32_t from = (*random)() % 2 == 0 ? 0 : 1;
        it.takes.push_back({2 * channel + from});
        it.gives.push_back({2 * channel + 1 - from});
      } else if ((*random)() % 8 == 0) {
        it.inhibitors = {{2 * (channel % channels)}};
      }
    }
  }
  net.claims = {{"0", "never p0 + p1 > 2"},
                {"1", "always p0 <= p2 or p1 != 1"},
                {"2", "reachable p2 = 2 and p0 = 0"},
                {"3", "live t0"}};
  return net;
}

void ExpectAgreement(const Net& net, int* compared, int* reduced) {
  const NaiveGraph naive(net, 400);
  CheckOptions options;
  options.limits.max_states = 5000;
  const CheckReport report = Checked(net, options);
  if (!naive.complete) {
    return;
  }
  ASSERT_EQ(report.explored.end, Explored::End::kComplete);
  ++*compared;
  ExpectSame(naive, net, report, false);
  options.reduce = true;
  const CheckReport less = Checked(net, options);
  *reduced += less.explored.states < naive.markings.size() ? 1 : 0;
  ExpectSame(naive, net, less, true);
}

TEST(Check, AgreesWithANaiveSearchOfRandomNets) {
  std::mt19937 random(20181);
  int compared = 0;
  int reduced = 0;
  for (int run = 0; run < 1500 && !HasFailure(); ++run) {
    SCOPED_TRACE(run);
    ExpectAgreement(RandomNet(&random), &compared, &reduced);
  }
  EXPECT_GT(compared, 500);
}

TEST(Check, AgreesWithANaiveSearchWhereOrderMattersLess) {
  std::mt19937 random(20182);
  int compared = 0;
  int reduced = 0;
  for (int run = 0; run < 400 && !HasFailure(); ++run) {
    SCOPED_TRACE(run);
    ExpectAgreement(RandomMachines(&random), &compared, &reduced);
  }
  EXPECT_EQ(compared, 400);
  EXPECT_GT(reduced, 150);
}

}  // namespace
}  // namespace pheromone::petri
