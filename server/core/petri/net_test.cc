#include "server/core/petri/net.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace pheromone::petri {
namespace {

using testing::HasSubstr;

// Two may want the same thing; `watch` reads, `rest` needs it to be free of waiters.
Net Mutex() {
  return {.name = "mutex",
          .places = {{.id = "free", .tokens = 1}, {.id = "idle", .tokens = 2}, {.id = "busy"}},
          .transitions = {{.id = "enter", .takes = {{0}, {1}}, .gives = {{2}}},
                          {.id = "leave", .takes = {{2}}, .gives = {{0}, {1}}},
                          {.id = "watch", .takes = {{1, 2}}, .gives = {{1, 2}}, .reads = {{0}}},
                          {.id = "rest", .takes = {{1}}, .inhibitors = {{2}}}}};
}

TEST(Net, FiresWhatIsEnabled) {
  const Net net = Mutex();
  const Marking first = InitialMarking(net);
  EXPECT_TRUE(IsEnabled(net, 0, first));
  EXPECT_FALSE(IsEnabled(net, 1, first));
  EXPECT_TRUE(IsEnabled(net, 2, first));
  EXPECT_TRUE(IsEnabled(net, 3, first));
  const Marking entered = Fire(net, 0, first);
  EXPECT_EQ(entered, (Marking(3) << 0, 1, 1).finished());
  EXPECT_FALSE(IsEnabled(net, 0, entered));  // no token
  EXPECT_FALSE(IsEnabled(net, 2, entered));  // one token instead of two, and nothing to read
  EXPECT_FALSE(IsEnabled(net, 3, entered));  // inhibited
}

// The state equation M' = M + A'u, Ferreira et al. 2018, eq. (1).
TEST(Net, TheIncidenceMatrixAddsUpAnyFirings) {
  const Net net = Mutex();
  const IncidenceMatrix incidence = IncidenceOf(net);
  EXPECT_EQ(incidence,
            (IncidenceMatrix(4, 3) << -1, -1, 1, 1, 1, -1, 0, 0, 0, 0, -1, 0).finished());
  std::mt19937 random(1);
  Marking marking = InitialMarking(net);
  Marking firings = Marking::Zero(4);
  int fired = 0;
  while (fired < 50) {
    const size_t transition = random() % 3;
    if (IsEnabled(net, transition, marking)) {
      marking = Fire(net, transition, marking);
      ++firings[static_cast<Eigen::Index>(transition)];
      ++fired;
    }
  }
  EXPECT_EQ(InitialMarking(net) + incidence.transpose() * firings, marking);
}

TEST(Net, FindsPlacesAndTransitionsById) {
  const Net net = Mutex();
  EXPECT_EQ(PlaceOf(net, "busy"), 2u);
  EXPECT_EQ(PlaceOf(net, "enter"), 3u);
  EXPECT_EQ(TransitionOf(net, "rest"), 3u);
  EXPECT_EQ(TransitionOf(net, "busy"), 4u);
}

TEST(CheckNet, SaysWhatIsWrong) {
  EXPECT_TRUE(CheckNet(Mutex()).ok());
  const auto error = [](const auto& change) {
    Net net = Mutex();
    change(&net);
    const Status status = CheckNet(net);
    return status.ErrorOr("");
  };
  EXPECT_EQ(error([](Net* net) { net->places[1].id = "free"; }),
            "net \"mutex\": the ID \"free\" is given twice");
  EXPECT_EQ(error([](Net* net) { net->transitions[1].id = "free"; }),
            "net \"mutex\": the ID \"free\" is given twice");
  EXPECT_EQ(error([](Net* net) { net->places[1].id = ""; }), "net \"mutex\": a place has no ID");
  EXPECT_EQ(error([](Net* net) { net->places[0].tokens = 2'000'000'000; }),
            "net \"mutex\": place \"free\" has 2000000000 tokens, expected 1000000000 at most");
  EXPECT_EQ(error([](Net* net) { net->transitions[0].takes[0].place = 3; }),
            "net \"mutex\": transition \"enter\" takes from place number 3, but the net has 3");
  EXPECT_THAT(error([](Net* net) { net->transitions[1].gives[1].place = 0; }),
              HasSubstr("\"leave\" gives to \"free\" twice"));
  EXPECT_EQ(
      error([](Net* net) { net->transitions[3].inhibitors[0].weight = 0; }),
      "net \"mutex\": transition \"rest\" is inhibited by \"busy\" with the weight 0, expected "
      "1 to 1000000000");
}

}  // namespace
}  // namespace pheromone::petri
