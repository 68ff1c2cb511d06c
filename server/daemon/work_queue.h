// A bounded work queue with worker threads.
//
//   WorkQueue pictures({.name = "pictures", .threads = 1, .max_waiting = 16, .yields = true});
//   if (!pictures.Add([=] { draw })) { report that it is full }
//   pictures.Close();
//
// Exceptions of work items are logged, and the thread continues. Thread-safe.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace pheromone::daemon {

struct WorkQueueOptions {
  std::string name;  ///< for the log, in words
  size_t threads = 1;
  size_t max_waiting = 16;  ///< in addition to the items being executed
  bool yields = false;      ///< its threads have low priority, see YieldToOthers (scheduling.h)
};

class WorkQueue {
 public:
  explicit WorkQueue(WorkQueueOptions options);
  WorkQueue(const WorkQueue&) = delete;
  WorkQueue& operator=(const WorkQueue&) = delete;
  ~WorkQueue();

  /// False if the queue is full or closed: the work is not done.
  bool Add(std::function<void()> work);

  /// Waits for the items being executed and drops those that wait. Not from a work item.
  void Close();

 private:
  void Run();

  const WorkQueueOptions options_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> waiting_;
  bool closed_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace pheromone::daemon
