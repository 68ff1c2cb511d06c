// A subscriber gets notices in order; a slow one loses the oldest, learns how many, and delays
// nobody.

#include "server/operators/control/notices.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace pheromone::control {
namespace {

Notice Link(const std::string& name, bool is_up, const std::string& text = {}) {
  return {.topic = Notice::Topic::kLink, .is_on = is_up, .subject = name, .text = text};
}

std::vector<std::string> TextsOf(const Subscription::Taken& taken) {
  std::vector<std::string> texts;
  for (const Notice& it : taken.notices) {
    texts.push_back(it.text);
  }
  return texts;
}

using Texts = std::vector<std::string>;

TEST(Notices, ComeToAllWhoListenWholeAndInOrder) {
  NoticeBoard board;
  board.Publish(Link("a", true, "before anybody listened"));
  const auto first = board.Subscribe({});
  board.Publish(Link("a", false, "1"));
  const auto second = board.Subscribe({});
  board.Publish(Link("b", true, "2"));
  const Subscription::Taken taken = first->Take();
  EXPECT_EQ(taken.notices, (std::vector{Link("a", false, "1"), Link("b", true, "2")}));
  EXPECT_EQ(taken.dropped, 0u);
  EXPECT_EQ(TextsOf(second->Take()), Texts{"2"});
  EXPECT_TRUE(first->Take().notices.empty());
}

TEST(Notices, OfWhichTooManyWaitLoseTheOldestAndSayHowMany) {
  NoticeBoard board;
  const auto slow = board.Subscribe({.max_waiting = 3});
  const auto other = board.Subscribe({.max_waiting = 10});
  for (const char* text : {"1", "2", "3", "4", "5"}) {
    board.Publish(Link("a", true, text));
  }
  Subscription::Taken taken = slow->Take();
  EXPECT_EQ(TextsOf(taken), (Texts{"3", "4", "5"}));
  EXPECT_EQ(taken.dropped, 2u);
  board.Publish(Link("a", true, "6"));
  taken = slow->Take();
  EXPECT_EQ(TextsOf(taken), Texts{"6"});
  EXPECT_EQ(taken.dropped, 0u);  // reported once
  taken = other->Take();
  EXPECT_EQ(taken.notices.size(), 6u);
  EXPECT_EQ(taken.dropped, 0u);
}

TEST(Notices, WakeOnceUntilTheyAreTaken) {
  NoticeBoard board;
  int woken = 0;
  auto listener = board.Subscribe({.max_waiting = 2, .wake = [&] { ++woken; }});
  EXPECT_EQ(woken, 0);
  for (int i = 0; i < 5; ++i) {
    board.Publish(Link("a", true));
  }
  EXPECT_EQ(woken, 1);
  listener->Take();
  EXPECT_EQ(woken, 1);
  board.Publish(Link("a", true));
  EXPECT_EQ(woken, 2);
  listener.reset();
  board.Publish(Link("a", true));
  EXPECT_EQ(woken, 2);
}

TEST(Notices, OfABoardThatIsGoneCanStillBeTaken) {
  auto board = std::make_unique<NoticeBoard>();
  const auto listener = board->Subscribe({});
  board->Publish(Link("a", true, "1"));
  board.reset();
  EXPECT_EQ(TextsOf(listener->Take()), Texts{"1"});
}

// Publishers, temporary subscribers, and one that takes whenever it is woken: every notice was
// either taken or counted, and each publisher's came in order.
TEST(Notices, AreTakenOrCountedWhateverHappensAtOnce) {
  constexpr int kTellers = 2;
  constexpr int kEach = 5'000;
  NoticeBoard board;
  std::atomic<int> calls{0};
  const auto steady = board.Subscribe({.max_waiting = 16, .wake = [&] { ++calls; }});
  std::atomic<int> telling{kTellers};
  std::vector<std::thread> threads;
  for (int teller = 0; teller < kTellers; ++teller) {
    threads.emplace_back([&, teller] {
      for (int i = 0; i < kEach; ++i) {
        board.Publish(Link(std::to_string(teller), true, std::to_string(i)));
      }
      --telling;
    });
  }
  threads.emplace_back([&] {
    while (telling != 0) {
      std::atomic<int> woken{0};
      auto passing = board.Subscribe({.max_waiting = 1, .wake = [&] { ++woken; }});
      passing->Take();
    }
  });
  uint64_t taken_count = 0;
  uint64_t dropped = 0;
  std::vector<int> last(kTellers, -1);
  for (bool done = false; !done;) {
    done = telling == 0;
    const Subscription::Taken taken = steady->Take();
    taken_count += taken.notices.size();
    dropped += taken.dropped;
    for (const Notice& it : taken.notices) {
      int& before = last[std::stoul(it.subject)];
      EXPECT_LT(before, std::stoi(it.text));
      before = std::stoi(it.text);
    }
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  EXPECT_EQ(taken_count + dropped, uint64_t{kTellers} * kEach);
  // The last one of all is some publisher's last, and no later one could displace it. The other's
  // may have been dropped.
  EXPECT_EQ(*std::max_element(last.begin(), last.end()), kEach - 1);
  EXPECT_GE(calls, 1);
}

}  // namespace
}  // namespace pheromone::control
