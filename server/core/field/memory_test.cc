#include "server/core/field/memory.h"

#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <vector>

namespace pheromone::field {
namespace {

TEST(MemoryBudget, TakesAllOrNothing) {
  MemoryBudget budget{100, 0};
  EXPECT_TRUE(budget.Take(60));
  EXPECT_FALSE(budget.Take(41));
  EXPECT_EQ(budget.used_bytes, 60u);
  EXPECT_TRUE(budget.Take(40));
  budget.Give(100);
  EXPECT_EQ(budget.used_bytes, 0u);
}

// A limit that was lowered below what is in use refuses until enough came back.
TEST(MemoryBudget, StaysFullUnderALowerLimit) {
  MemoryBudget budget{100, 0};
  EXPECT_TRUE(budget.Take(80));
  budget.limit_bytes = 50;
  EXPECT_FALSE(budget.Take(1));
  budget.Give(40);
  EXPECT_TRUE(budget.Take(10));
}

// Numbers of what was freed, in order.
class Freed {
 public:
  void Retire(Reclaimer& reclaimer, int number) {
    reclaimer.Retire([this, number] { numbers_.push_back(number); });
  }
  const std::vector<int>& numbers() const { return numbers_; }

 private:
  std::vector<int> numbers_;
};

TEST(Reclaimer, FreesAtOnceWhenNobodyLooks) {
  Freed freed;
  Reclaimer reclaimer;
  const int reader = reclaimer.Register();
  freed.Retire(reclaimer, 1);
  EXPECT_EQ(freed.numbers(), std::vector{1});
  reclaimer.Enter(reader);
  reclaimer.Leave(reader);
  freed.Retire(reclaimer, 2);
  EXPECT_EQ(freed.numbers(), (std::vector{1, 2}));
  EXPECT_EQ(reclaimer.waiting(), 0u);
}

TEST(Reclaimer, KeepsWhatAReaderMayHold) {
  Freed freed;
  Reclaimer reclaimer;
  const int reader = reclaimer.Register();
  reclaimer.Enter(reader);
  freed.Retire(reclaimer, 1);
  freed.Retire(reclaimer, 2);
  EXPECT_TRUE(freed.numbers().empty());
  EXPECT_EQ(reclaimer.waiting(), 2u);
  reclaimer.Leave(reader);
  reclaimer.Collect();
  EXPECT_EQ(freed.numbers(), (std::vector{1, 2}));
}

TEST(Reclaimer, AReaderThatCameLaterDoesNotHoldBackWhatWasGone) {
  Freed freed;
  Reclaimer reclaimer;
  const int early = reclaimer.Register();
  const int late = reclaimer.Register();
  reclaimer.Enter(early);
  freed.Retire(reclaimer, 1);
  reclaimer.Enter(late);
  freed.Retire(reclaimer, 2);
  reclaimer.Leave(early);
  reclaimer.Collect();
  EXPECT_EQ(freed.numbers(), std::vector{1});
  reclaimer.Leave(late);
  reclaimer.Collect();
  EXPECT_EQ(freed.numbers(), (std::vector{1, 2}));
}

TEST(Reclaimer, AReaderThatGoesAwayInTheMiddleHoldsNothingBack) {
  Freed freed;
  Reclaimer reclaimer;
  const int reader = reclaimer.Register();
  reclaimer.Enter(reader);
  freed.Retire(reclaimer, 1);
  reclaimer.Unregister(reader);
  reclaimer.Collect();
  EXPECT_EQ(freed.numbers(), std::vector{1});
}

TEST(Reclaimer, HasPlacesForSoManyReadersAndGivesThemAgain) {
  Reclaimer reclaimer;
  std::set<int> readers;
  for (size_t i = 0; i < Reclaimer::kReaders; ++i) {
    const int reader = reclaimer.Register();
    ASSERT_GE(reader, 0);
    ASSERT_TRUE(readers.insert(reader).second);
  }
  EXPECT_LT(reclaimer.Register(), 0);
  reclaimer.Unregister(17);
  EXPECT_EQ(reclaimer.Register(), 17);
}

TEST(Reclaimer, FreesEverythingAtItsEnd) {
  Freed freed;
  {
    Reclaimer reclaimer;
    reclaimer.Enter(reclaimer.Register());
    freed.Retire(reclaimer, 1);
    freed.Retire(reclaimer, 2);
  }
  EXPECT_EQ(freed.numbers(), (std::vector{1, 2}));
}

}  // namespace
}  // namespace pheromone::field
