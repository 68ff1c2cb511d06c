#include "server/daemon/scheduling.h"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/resource.h>

#include <thread>

namespace pheromone::daemon {
namespace {

int ClassOfThisThread() {
  int policy = -1;
  sched_param ignored{};
  pthread_getschedparam(pthread_self(), &policy, &ignored);
  return policy;
}

// Whoever started the server may have given it another class. What a kernel keeps of the turns
// differs by version.
TEST(Scheduling, ShortTurnsLeaveClassAndNiceValueAsTheyAre) {
  std::thread([] {
    TakeShortTurns();
    EXPECT_EQ(ClassOfThisThread(), SCHED_OTHER);
    YieldToOthers();
    const int nice = getpriority(PRIO_PROCESS, 0);
    TakeShortTurns();
    EXPECT_EQ(ClassOfThisThread(), SCHED_BATCH);
    EXPECT_EQ(getpriority(PRIO_PROCESS, 0), nice);
  }).join();
}

}  // namespace
}  // namespace pheromone::daemon
