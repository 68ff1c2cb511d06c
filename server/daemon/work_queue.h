// Threads that do one piece of work after the other, and a bounded queue before them.
//
//   WorkQueue pictures({.name = "pictures", .threads = 1, .max_waiting = 16, .yields = true});
//   if (!pictures.Add([=] { draw })) { it is full: say so }
//   pictures.Close();
//
// Work that throws is told in the log, and the thread goes on. Thread-safe.
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
  size_t max_waiting = 16;  ///< beside what is being done
  bool yields = false;      ///< its threads run after all others, see YieldToOthers (scheduling.h)
};

class WorkQueue {
 public:
  explicit WorkQueue(WorkQueueOptions options);
  WorkQueue(const WorkQueue&) = delete;
  WorkQueue& operator=(const WorkQueue&) = delete;
  ~WorkQueue();

  /// False if there is no room for it, or the queue is closed: it will not be done.
  bool Add(std::function<void()> work);

  /// Waits for what is being done; what waits is dropped. Not from the work itself.
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
