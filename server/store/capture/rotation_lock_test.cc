#include "server/store/capture/rotation_lock.h"

#include <gtest/gtest.h>

#include <thread>

namespace pheromone::capture {
namespace {

TEST(RotationLock, ACutThatWaitsIsNotOvertakenByFurtherReads) {
  RotationLock lock;
  lock.lock_shared();
  EXPECT_TRUE(lock.try_lock_shared());  // a read beside a read
  lock.unlock_shared();
  bool cut = false;
  std::thread cutter([&] {
    lock.lock();
    cut = true;
    lock.unlock();
  });
  while (!lock.cutting()) {
    std::this_thread::yield();
  }
  EXPECT_FALSE(lock.try_lock_shared());
  EXPECT_FALSE(cut);
  lock.unlock_shared();
  lock.lock_shared();  // behind the cut, if it is not through already
  lock.unlock_shared();
  cutter.join();
  EXPECT_TRUE(cut);
  EXPECT_TRUE(lock.try_lock_shared());
  lock.unlock_shared();
}

}  // namespace
}  // namespace pheromone::capture
