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

Result<std::string> HandOn(const Result<std::string>& given) {
  if (!given.ok()) {
    return given.error();
  }
  return given.value() + "!";
}

TEST(Result, HandsAnErrorOfATextOnAsAnError) {
  EXPECT_EQ(HandOn(Error{"not fine"}).error(), "not fine");
  EXPECT_EQ(HandOn(std::string("fine")).value(), "fine!");
}

Result<int> Half(int value) {
  if (value % 2 != 0) {
    return Error{"odd"};
  }
  return value / 2;
}

Result<std::string> TwiceHalved(int value) {
  PHEROMONE_TRY(const int once, Half(value));
  PHEROMONE_TRY(const int twice, Half(once));
  return std::to_string(twice);
}

TEST(Try, DeclaresTheValueOrReturnsTheError) {
  EXPECT_EQ(TwiceHalved(12).value(), "3");
  EXPECT_EQ(TwiceHalved(6).error(), "odd");
}

Result<std::unique_ptr<int>> Moved(Result<std::unique_ptr<int>> given) {
  PHEROMONE_TRY(std::unique_ptr<int> taken, std::move(given));
  return taken;
}

TEST(Try, MovesTheValue) {
  EXPECT_EQ(*Moved(std::make_unique<int>(4)).value(), 4);
  EXPECT_EQ(Moved(Error{"none"}).error(), "none");
}

Status BothEven(int first, int second) {
  PHEROMONE_TRY_STATUS(Half(first));
  PHEROMONE_TRY_STATUS(Half(second));
  return Ok();
}

TEST(Try, ReturnsTheErrorOfAStatus) {
  EXPECT_EQ(BothEven(1, 2).error(), "odd");
  EXPECT_EQ(BothEven(2, 1).error(), "odd");
  EXPECT_TRUE(BothEven(4, 2).ok());
}

}  // namespace
}  // namespace pheromone
