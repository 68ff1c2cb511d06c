// Threads that live as long as the pool, and portions of work that they share.
//
//   WorkerPool pool(2);
//   Portions squares(100);
//   pool.Run([&](int worker) { squares.Work([&](size_t i) { Square(i); }); });
//
// Nothing is queued: all workers run the same function at once, and Run returns when all have
// returned. Who does which portion is left to chance; results must not depend on it.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

namespace pheromone::lab {

class WorkerPool {
 public:
  /// Worker 0 is whoever calls Run; `threads` - 1 others are started.
  explicit WorkerPool(int threads);
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;
  ~WorkerPool();

  /// Calls `work(worker)` in all threads. Not to be called from within itself.
  void Run(const std::function<void(int worker)>& work);

 private:
  void Serve(int worker);

  std::vector<std::thread> others_;
  const std::function<void(int worker)>* work_ = nullptr;  // null: they are to end
  std::atomic<uint32_t> round_{0};
  std::atomic<uint32_t> running_{0};
};

/// Portions 0 to count - 1, each done once by one of the threads that call Work. For one round: a
/// new one is made for the next.
class Portions {  // NOLINT(clang-analyzer-optin.performance.Padding): a line for each counter
 public:
  explicit Portions(size_t count) : count_(static_cast<uint32_t>(count)) {}

  /// Does portions until all are begun. A thread that comes late finds fewer, or none.
  template <typename Portion>
  void Work(Portion&& portion) {
    for (uint32_t i = next_.fetch_add(1); i < count_; i = next_.fetch_add(1)) {
      portion(size_t{i});
      if (done_.fetch_add(1, std::memory_order_acq_rel) + 1 == count_) {
        done_.notify_all();
      }
    }
  }

  /// Returns when all are done; what was written in them is then visible here.
  void Await() const {
    for (uint32_t done = done_.load(std::memory_order_acquire); done < count_;
         done = done_.load(std::memory_order_acquire)) {
      done_.wait(done, std::memory_order_acquire);
    }
  }

 private:
  uint32_t count_;
  alignas(64) std::atomic<uint32_t> next_{0};
  alignas(64) std::atomic<uint32_t> done_{0};
};

}  // namespace pheromone::lab
