// Many concurrent reads, or one rotation: like std::shared_mutex, but a continuous sequence of
// reads cannot starve a rotation, as it can with glibc's implementation.
#pragma once

#include <atomic>
#include <mutex>
#include <shared_mutex>

namespace pheromone::capture {

class RotationLock {
 public:
  /// A read waits while a rotation is in progress or waiting. Not recursive.
  void lock_shared() {
    if (cutting_) {
      const std::lock_guard after_the_cut(cut_);
    }
    reads_.lock_shared();
  }
  /// Returns false instead of waiting.
  bool try_lock_shared() { return !cutting_ && reads_.try_lock_shared(); }
  void unlock_shared() { reads_.unlock_shared(); }

  void lock() {
    cut_.lock();
    cutting_ = true;
    reads_.lock();
  }
  void unlock() {
    cutting_ = false;
    reads_.unlock();
    cut_.unlock();
  }

  /// Whether a rotation is in progress or waiting for reads to end.
  bool cutting() const { return cutting_; }

 private:
  std::mutex cut_;
  std::shared_mutex reads_;
  std::atomic<bool> cutting_{false};
};

}  // namespace pheromone::capture
