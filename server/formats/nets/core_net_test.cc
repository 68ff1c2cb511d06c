#include "server/formats/nets/core_net.h"

#include <gtest/gtest.h>

#include <random>

#include "server/formats/nets/testing/naive_markings.h"
#include "server/formats/nets/testing/random_net.h"

namespace pheromone::nets {
namespace {

using petri::Net;

bool IsCore(const Net& net) {
  return std::all_of(
      net.transitions.begin(), net.transitions.end(),
      [](const petri::Transition& it) { return it.reads.empty() && it.inhibitors.empty(); });
}

// One may go as long as fewer than two are there.
TEST(CoreNet, ReplacesInhibitorsByComplements) {
  const Net net{
      .name = "gate",
      .places = {{.id = "out", .name = "Outside", .tokens = 3}, {.id = "in"}},
      .transitions = {{.id = "enter", .takes = {{0}}, .gives = {{1}}, .inhibitors = {{1, 2}}},
                      {.id = "leave", .takes = {{1}}, .gives = {{0}}}}};
  const Result<Net> core = CoreNet(net, {0, 3});
  ASSERT_TRUE(core.ok()) << core.error();
  ASSERT_EQ(core.value().places.size(), 3u);
  EXPECT_EQ(core.value().places[2], (petri::Place{.id = "in_complement", .tokens = 3}));
  EXPECT_EQ(core.value().transitions[0],
            (petri::Transition{.id = "enter", .takes = {{0}, {2, 2}}, .gives = {{1}, {2, 1}}}));
  EXPECT_EQ(core.value().transitions[1],
            (petri::Transition{.id = "leave", .takes = {{1}}, .gives = {{0}, {2}}}));
}

TEST(CoreNet, NamesThePlaceWhoseBoundIsUnknown) {
  const Net net{.name = "n",
                .places = {{.id = "a"}, {.id = "b", .tokens = 4}},
                .transitions = {{.id = "t", .inhibitors = {{1}}}}};
  EXPECT_EQ(
      CoreNet(net, {0, 0}).error(),
      "place \"b\" has an inhibitor arc and no known bound, expected a bound of 4 to 1000000000");
  EXPECT_EQ(
      CoreNet(net, {0, 3}).error(),
      "place \"b\" has an inhibitor arc and a bound of 3, expected a bound of 4 to 1000000000");
  EXPECT_TRUE(CoreNet(net, {0, 4}).ok());
}

// On nets whose number of markings is small, with the largest tokens that occur as bounds.
TEST(CoreNet, HasTheSameReachableMarkings) {
  std::mt19937 random(7);
  size_t tried = 0;
  size_t largest = 0;
  while (tried < 300) {
    const Net net = RandomNet(&random, {.places = 7, .transitions = 10, .weight = 2});
    const NaiveMarkings markings = ReachableMarkings(net, 2000);
    if (markings.size() > 2000 || IsCore(net)) {
      continue;
    }
    ++tried;
    largest = std::max(largest, markings.size());
    std::vector<uint32_t> bounds(net.places.size(), 1);
    for (const std::vector<int32_t>& marking : markings) {
      for (size_t place = 0; place < bounds.size(); ++place) {
        bounds[place] = std::max(bounds[place], static_cast<uint32_t>(marking[place]));
      }
    }
    const Result<Net> core = CoreNet(net, bounds);
    ASSERT_TRUE(core.ok()) << core.error();
    EXPECT_TRUE(IsCore(core.value()));
    NaiveMarkings restricted;
    for (std::vector<int32_t> marking : ReachableMarkings(core.value())) {
      marking.resize(net.places.size());
      restricted.insert(marking);
    }
    EXPECT_EQ(restricted, markings);
    EXPECT_EQ(ReachableMarkings(core.value()).size(), markings.size());
  }
  EXPECT_GT(largest, 100u);
}

TEST(CoreNet, TakesAndGivesBackWhatIsRead) {
  const Net net{.name = "n",
                .places = {{.id = "a", .tokens = 5}},
                .transitions = {{.id = "t", .takes = {{0, 1}}, .gives = {}, .reads = {{0, 3}}}}};
  EXPECT_EQ(WithoutReads(net).transitions[0],
            (petri::Transition{.id = "t", .takes = {{0, 3}}, .gives = {{0, 2}}}));
  EXPECT_EQ(ReachableMarkings(net), ReachableMarkings(WithoutReads(net)));
  EXPECT_EQ(ReachableMarkings(net).size(), 4u);  // 5, 4, 3, 2
}

}  // namespace
}  // namespace pheromone::nets
