#include "client_fw/attach/rate_search.h"

#include <gtest/gtest.h>

#include <vector>

namespace pheromone::attach {
namespace {

std::vector<uint32_t> Tried(RateSearch* search, int64_t from_ms, int64_t to_ms) {
  std::vector<uint32_t> tried;
  for (int64_t ms = from_ms; ms <= to_ms; ++ms) {
    if (const uint32_t rate = search->Next(true, ms)) {
      tried.push_back(rate);
    }
  }
  return tried;
}

TEST(RateSearchTest, TriesEachRateOnceAndBeginsAgainWithTheFirst) {
  RateSearch search(9600);
  EXPECT_EQ(search.rate(), 9600u);
  EXPECT_EQ(Tried(&search, 0, 6 * RateSearch::kTryMs),
            (std::vector<uint32_t>{38'400, 19'200, 115'200, 57'600, 9600, 38'400}));
}

TEST(RateSearchTest, TheRateThatWasGivenNeedNotBeOneOfARIAs) {
  RateSearch search(230'400);
  EXPECT_EQ(Tried(&search, 0, 6 * RateSearch::kTryMs),
            (std::vector<uint32_t>{9600, 38'400, 19'200, 115'200, 57'600, 230'400}));
}

TEST(RateSearchTest, StaysAtTheRateAtWhichTheRobotAnswers) {
  RateSearch search(9600);
  ASSERT_EQ(Tried(&search, 0, RateSearch::kTryMs), (std::vector<uint32_t>{38'400}));
  for (int64_t ms = RateSearch::kTryMs; ms < 100'000; ms += 10) {
    EXPECT_EQ(search.Next(false, ms), 0u);
  }
  EXPECT_EQ(search.rate(), 38'400u);
  // It was switched off: its time begins now.
  EXPECT_EQ(Tried(&search, 100'000, 100'000 + RateSearch::kTryMs), (std::vector<uint32_t>{19'200}));
}

}  // namespace
}  // namespace pheromone::attach
