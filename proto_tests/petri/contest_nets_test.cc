// That make_nets.py makes the nets of the Model Checking Contest: they have as many reachable
// markings as published.

#include "proto_tests/petri/contest_nets.h"

#include <gtest/gtest.h>

#include <sstream>

#include "server/formats/nets/testing/naive_markings.h"

namespace pheromone::nets {
namespace {

TEST(ContestNets, HaveAsManyMarkingsAsPublished) {
  constexpr size_t kLargest = 100'000;  // for a naive search
  std::istringstream rows(MakeNets("--counts"));
  std::string name;
  int size = 0;
  size_t count = 0;
  int tried = 0;
  while (rows >> name >> size >> count) {
    if (count <= kLargest) {
      EXPECT_EQ(ReachableMarkings(ContestNet(name, size)).size(), count) << name << size;
      ++tried;
    }
  }
  EXPECT_EQ(tried, 11);
}

}  // namespace
}  // namespace pheromone::nets
