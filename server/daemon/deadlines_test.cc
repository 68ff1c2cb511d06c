// Calls that are made later: each once, none too early, and at the end none is forgotten.

#include "server/daemon/deadlines.h"

#include <gtest/gtest.h>

#include <functional>
#include <future>
#include <memory>
#include <vector>

namespace pheromone::daemon {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;

TEST(DeadlinesTest, CallsAreMadeInTheOrderOfTheirTimesAndNotBefore) {
  std::vector<int> order;   // of the deadlines' thread, until the promise
  std::promise<void> over;  // outlives the thread: set_value is at work when a waiter returns
  Deadlines deadlines;
  const auto begin = std::chrono::steady_clock::now();
  deadlines.After(milliseconds(30), [&](bool stopped) {
    EXPECT_FALSE(stopped);
    EXPECT_GE(std::chrono::steady_clock::now() - begin, milliseconds(30));
    order.push_back(30);
    over.set_value();
  });
  deadlines.After(milliseconds(20), [&](bool) { order.push_back(20); });
  deadlines.After(milliseconds(0), [&](bool) { order.push_back(0); });
  over.get_future().wait();
  EXPECT_EQ(order, (std::vector<int>{0, 20, 30}));
}

TEST(DeadlinesTest, WhatIsCancelledIsNotCalledAndLetsGoOfWhatItHolds) {
  Deadlines deadlines;
  const auto held = std::make_shared<int>(0);
  int calls = 0;
  const auto id = deadlines.After(hours(1), [held, &calls](bool) { ++calls; });
  EXPECT_EQ(held.use_count(), 2);
  deadlines.Cancel(id);
  EXPECT_EQ(held.use_count(), 1);
  deadlines.Cancel(id);
  deadlines.Stop();
  EXPECT_EQ(calls, 0);
}

TEST(DeadlinesTest, StopMakesTheCallsThatRemainAndThenAllAreMadeAtOnce) {
  Deadlines deadlines;
  std::vector<int> calls;
  deadlines.After(hours(2), [&](bool stopped) { calls.push_back(stopped ? 2 : 0); });
  deadlines.After(hours(1), [&](bool stopped) { calls.push_back(stopped ? 1 : 0); });
  deadlines.Stop();
  EXPECT_EQ(calls, (std::vector<int>{1, 2}));
  deadlines.After(hours(3), [&](bool stopped) { calls.push_back(stopped ? 3 : 0); });
  EXPECT_EQ(calls, (std::vector<int>{1, 2, 3}));
}

TEST(DeadlinesTest, ACallMayAskForAnother) {
  std::promise<void> over;
  Deadlines deadlines;
  int left = 5;
  std::function<void(bool)> again = [&](bool) {
    if (--left == 0) {
      over.set_value();
    } else {
      deadlines.After(milliseconds(1), again);
    }
  };
  deadlines.After(milliseconds(1), again);
  over.get_future().wait();
  deadlines.Stop();
  EXPECT_EQ(left, 0);
}

}  // namespace
}  // namespace pheromone::daemon
