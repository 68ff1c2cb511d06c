#include "client_fw/experiments/laws/law_search.h"

#include <gtest/gtest.h>

#include <vector>

namespace pheromone::swarm {
namespace {

const std::vector<SearchRange> kRanges = {{-100, 100}, {0, 50}, {7, 7}};

double Bowl(const std::vector<int>& values) {
  return (values[0] - 37) * (values[0] - 37) + 4.0 * (values[1] - 11) * (values[1] - 11);
}

TEST(LawSearch, ComesCloseToTheBottomOfABowl) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    const SearchResult result = Search(kRanges, {0, 0, 7}, 300, seed, Bowl);
    EXPECT_LE(result.best().cost, 5) << seed;
  }
}

TEST(LawSearch, SpendsItsBudgetWithinTheRangesAndBeginsAtTheStart) {
  const SearchResult result = Search(kRanges, {100, 50, 7}, 120, 1, Bowl);
  ASSERT_EQ(result.evaluations.size(), 120u);
  EXPECT_EQ(result.evaluations.front().values, (std::vector<int>{100, 50, 7}));
  for (const Evaluation& evaluation : result.evaluations) {
    for (size_t i = 0; i < kRanges.size(); ++i) {
      EXPECT_GE(evaluation.values[i], kRanges[i].least);
      EXPECT_LE(evaluation.values[i], kRanges[i].most);
    }
    EXPECT_GE(evaluation.cost, result.best().cost);
    EXPECT_EQ(evaluation.cost, Bowl(evaluation.values));
  }
}

TEST(LawSearch, OneEvaluationIsTheStart) {
  EXPECT_EQ(Search(kRanges, {1, 2, 7}, 1, 1, Bowl).evaluations.size(), 1u);
  EXPECT_EQ(Search(kRanges, {1, 2, 7}, 0, 1, Bowl).best().values, (std::vector<int>{1, 2, 7}));
}

TEST(LawSearch, TheSeedDecidesWhatIsTried) {
  const SearchResult first = Search(kRanges, {0, 0, 7}, 50, 1, Bowl);
  const SearchResult again = Search(kRanges, {0, 0, 7}, 50, 1, Bowl);
  const SearchResult other = Search(kRanges, {0, 0, 7}, 50, 2, Bowl);
  for (size_t i = 0; i < 50; ++i) {
    EXPECT_EQ(first.evaluations[i].values, again.evaluations[i].values);
  }
  EXPECT_NE(first.evaluations[1].values, other.evaluations[1].values);
}

}  // namespace
}  // namespace pheromone::swarm
