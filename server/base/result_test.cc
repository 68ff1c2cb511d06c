#include "server/base/result.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace pheromone {
namespace {

TEST(Result, HoldsAValue) {
  const Result<int> result = 7;
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result.value(), 7);
}

TEST(Result, HoldsAnError) {
  const Result<int> result = Error{"line 3: expected a number"};
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error(), "line 3: expected a number");
}

TEST(Result, TellsAStringFromAnError) {
  const Result<std::string> good = std::string("fine");
  const Result<std::string> bad = Error{"not fine"};
  EXPECT_TRUE(good.ok());
  EXPECT_FALSE(bad.ok());
}

TEST(Result, GivesAwayWhatCannotBeCopied) {
  Result<std::unique_ptr<int>> result = std::make_unique<int>(3);
  const std::unique_ptr<int> taken = std::move(result).value();
  EXPECT_EQ(*taken, 3);
}

TEST(Status, IsGoodOrAnError) {
  EXPECT_TRUE(Ok().ok());
  EXPECT_FALSE(Status(Error{"no"}).ok());
}

}  // namespace
}  // namespace pheromone
