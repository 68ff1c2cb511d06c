#include "server/core/petri/flows.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "server/core/petri/testing/nets.h"

namespace pheromone::petri {
namespace {

Net RandomFlows(std::mt19937* random) {
  const auto below = [random](uint32_t bound) {
    return static_cast<uint32_t>((*random)() % bound);
  };
  Net net{.name = "random"};
  const uint32_t places = 3 + below(5);
  for (uint32_t i = 0; i < places; ++i) {
    net.places.push_back({.id = "p" + std::to_string(i), .tokens = below(2)});
  }
  const uint32_t transitions = 2 + below(4);
  for (uint32_t t = 0; t < transitions; ++t) {
    Transition transition{.id = "t" + std::to_string(t)};
    for (uint32_t place = 0; place < places; ++place) {
      const uint32_t kind = below(5);
      if (kind < 2) {
        (kind == 0 ? transition.takes : transition.gives).push_back({place, 1 + below(2)});
      }
    }
    net.transitions.push_back(transition);
  }
  return net;
}

// What transition t changes on each of these places, a row for each t.
std::vector<std::vector<int64_t>> ChangesOn(const Net& net, const std::vector<uint32_t>& support) {
  std::vector<std::vector<int64_t>> changes;
  for (const Transition& transition : net.transitions) {
    std::map<uint32_t, int64_t> change;
    for (const Arc& arc : transition.takes) {
      change[arc.place] -= arc.weight;
    }
    for (const Arc& arc : transition.gives) {
      change[arc.place] += arc.weight;
    }
    std::vector<int64_t> row;
    for (const uint32_t place : support) {
      row.push_back(change[place]);
    }
    changes.push_back(row);
  }
  return changes;
}

// Gauss-Jordan without fractions: the columns without a pivot are free.
std::vector<size_t> FreeColumns(std::vector<std::vector<int64_t>>* rows, size_t columns) {
  std::vector<size_t> free;
  size_t rank = 0;
  for (size_t column = 0; column < columns; ++column) {
    const auto pivot = std::find_if(rows->begin() + static_cast<std::ptrdiff_t>(rank), rows->end(),
                                    [&](const auto& row) { return row[column] != 0; });
    if (pivot == rows->end()) {
      free.push_back(column);
      continue;
    }
    std::swap((*rows)[rank], *pivot);
    for (size_t i = 0; i < rows->size(); ++i) {
      const int64_t mine = (*rows)[rank][column];
      const int64_t its = (*rows)[i][column];
      if (i == rank || its == 0) {
        continue;
      }
      int64_t divisor = 0;  // keeps numbers small
      for (size_t j = 0; j < columns; ++j) {
        (*rows)[i][j] = (*rows)[i][j] * mine - (*rows)[rank][j] * its;
        divisor = std::gcd(divisor, (*rows)[i][j]);
      }
      for (int64_t& value : (*rows)[i]) {
        value /= std::max(divisor, int64_t{1});
      }
    }
    ++rank;
  }
  return free;
}

// A set of places is a minimal support if the weights that no firing changes, on these places, are
// one positive vector and its multiples.
Flow MinimalFlowOn(const Net& net, const std::vector<uint32_t>& support) {
  std::vector<std::vector<int64_t>> rows = ChangesOn(net, support);
  const std::vector<size_t> free = FreeColumns(&rows, support.size());
  if (free.size() != 1) {
    return {};
  }
  int64_t scale = 1;  // the weight of the free one, so that all are whole
  for (size_t i = 0; i + 1 < support.size(); ++i) {
    const int64_t pivot =
        *std::find_if(rows[i].begin(), rows[i].end(), [](int64_t value) { return value != 0; });
    scale = std::lcm(scale, pivot);
  }
  std::vector<int64_t> weights;
  for (size_t column = 0, row = 0; column < support.size(); ++column) {
    if (column == free[0]) {
      weights.push_back(scale);
    } else {
      weights.push_back(-rows[row][free[0]] * (scale / rows[row][column]));
      ++row;
    }
  }
  int64_t divisor = 0;
  for (const int64_t weight : weights) {
    divisor = std::gcd(divisor, weight);
  }
  Flow flow;
  for (size_t i = 0; i < support.size(); ++i) {
    if (weights[i] <= 0) {
      return {};
    }
    flow.terms.push_back({support[i], weights[i] / divisor});
  }
  return flow;
}

using Weights = std::vector<std::pair<uint32_t, int64_t>>;

Weights WeightsOf(const Flow& flow) {
  Weights weights;
  for (const FlowTerm& term : flow.terms) {
    weights.emplace_back(term.index, term.weight);
  }
  return weights;
}

// All sets of places are tried.
std::multiset<Weights> MinimalFlows(const Net& net) {
  std::multiset<Weights> flows;
  for (uint32_t bits = 1; bits < 1u << net.places.size(); ++bits) {
    std::vector<uint32_t> support;
    for (uint32_t place = 0; place < net.places.size(); ++place) {
      if ((bits >> place & 1) != 0) {
        support.push_back(place);
      }
    }
    const Flow flow = MinimalFlowOn(net, support);
    if (!flow.terms.empty()) {
      flows.insert(WeightsOf(flow));
    }
  }
  return flows;
}

TEST(Flows, TheForksAndSeatsOfPhilosophersAreAllMinimalSemiflows) {
  for (int count = 2; count <= 6; ++count) {
    const Semiflows all = PlaceSemiflows(Philosophers(count));
    EXPECT_TRUE(all.complete);
    EXPECT_EQ(all.flows.size(), 2u * static_cast<unsigned>(count));
  }
}

TEST(Flows, SemiflowsAreThoseOfMinimalSupportEachOnce) {
  std::mt19937 random(31);
  size_t found = 0;
  for (int i = 0; i < 400; ++i) {
    const Net net = RandomFlows(&random);
    const Semiflows all = PlaceSemiflows(net);
    ASSERT_TRUE(all.complete);
    std::multiset<Weights> flows;
    for (const Flow& flow : all.flows) {
      flows.insert(WeightsOf(flow));
    }
    EXPECT_EQ(flows, MinimalFlows(net)) << i;
    found += flows.size();
  }
  EXPECT_GT(found, 100u);
}

}  // namespace
}  // namespace pheromone::petri
