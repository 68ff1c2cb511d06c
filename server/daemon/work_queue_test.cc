// Work on other threads: in order, bounded, and dropped rather than waited for at the end.
//
// A promise outlives the thread that sets it: set_value is still at work when a waiter returns.

#include "server/daemon/work_queue.h"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/resource.h>

#include <future>
#include <memory>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

namespace pheromone::daemon {
namespace {

// Keeps the only thread of a queue busy until it is told to go on.
class Blocker {
 public:
  explicit Blocker(WorkQueue* queue) {
    const auto begun = std::make_shared<std::promise<void>>();
    EXPECT_TRUE(queue->Add([this, begun] {
      begun->set_value();
      go_on_.get_future().wait();
    }));
    begun->get_future().wait();
  }
  void GoOn() { go_on_.set_value(); }

 private:
  std::promise<void> go_on_;
};

TEST(WorkQueueTest, WorkIsDoneInItsOrder) {
  std::vector<int> done;
  std::promise<void> over;
  WorkQueue queue({.name = "test"});
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(queue.Add([&done, i] { done.push_back(i); }));
  }
  ASSERT_TRUE(queue.Add([&over] { over.set_value(); }));
  over.get_future().wait();
  EXPECT_EQ(done, (std::vector<int>{0, 1, 2, 3, 4}));
}

TEST(WorkQueueTest, AFullQueueTakesNoMoreUntilThereIsRoom) {
  std::promise<void> over;
  int done = 0;
  WorkQueue queue({.name = "test", .max_waiting = 2});
  Blocker blocker(&queue);
  EXPECT_TRUE(queue.Add([&done] { ++done; }));
  EXPECT_TRUE(queue.Add([&] {
    ++done;
    over.set_value();
  }));
  EXPECT_FALSE(queue.Add([&done] { done += 100; }));
  blocker.GoOn();
  over.get_future().wait();
  EXPECT_EQ(done, 2);
  EXPECT_TRUE(queue.Add([] {}));
}

TEST(WorkQueueTest, CloseWaitsForWhatIsDoneAndDropsWhatWaits) {
  WorkQueue queue({.name = "test"});
  Blocker blocker(&queue);
  const auto held = std::make_shared<int>(0);
  bool dropped = true;
  ASSERT_TRUE(queue.Add([held, &dropped] { dropped = false; }));
  std::thread closing([&queue] { queue.Close(); });
  while (held.use_count() > 1) {  // what waits goes while the thread is still busy
    std::this_thread::yield();
  }
  EXPECT_FALSE(queue.Add([] {}));
  blocker.GoOn();
  closing.join();
  EXPECT_TRUE(dropped);
}

TEST(WorkQueueTest, WorkThatThrowsEndsNeitherTheThreadNorTheProcess) {
  std::promise<void> over;
  WorkQueue queue({.name = "test"});
  ASSERT_TRUE(queue.Add([] { throw std::runtime_error("out of memory, say"); }));
  ASSERT_TRUE(queue.Add([&over] { over.set_value(); }));
  over.get_future().wait();
}

TEST(WorkQueueTest, OnlyAThreadThatYieldsRunsAfterTheOthers) {
  const auto look = [](WorkQueue* queue) {
    const auto found = std::make_shared<std::promise<std::pair<int, int>>>();
    EXPECT_TRUE(queue->Add([found] {
      int policy = -1;
      sched_param ignored{};
      pthread_getschedparam(pthread_self(), &policy, &ignored);
      found->set_value({policy, getpriority(PRIO_PROCESS, 0)});
    }));
    return found->get_future().get();
  };
  const int nice = getpriority(PRIO_PROCESS, 0);
  WorkQueue plain({.name = "plain"});
  WorkQueue yielding({.name = "yielding", .yields = true});
  EXPECT_EQ(look(&plain).second, nice);
  EXPECT_EQ(look(&yielding).first, SCHED_BATCH);
  EXPECT_GE(look(&yielding).second, 10);
  EXPECT_EQ(getpriority(PRIO_PROCESS, 0), nice);
}

}  // namespace
}  // namespace pheromone::daemon
