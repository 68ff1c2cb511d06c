// Many reads at a time, or one cut: as std::shared_mutex, but reads that follow each other without
// a pause do not keep a cut waiting, which glibc's lets them do for ever.
#pragma once

#include <atomic>
#include <mutex>
#include <shared_mutex>

namespace pheromone::capture {

class CutLock {
 public:
  /// A read waits while a cut is made, or waits itself. Not twice on one thread.
  void lock_shared() {
    if (cutting_) {
      const std::lock_guard after_the_cut(cut_);
    }
    reads_.lock_shared();
  }
  /// False if it would have to wait.
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

  /// Whether a cut is made, or waits for reads to end.
  bool cutting() const { return cutting_; }

 private:
  std::mutex cut_;
  std::shared_mutex reads_;
  std::atomic<bool> cutting_{false};
};

}  // namespace pheromone::capture
