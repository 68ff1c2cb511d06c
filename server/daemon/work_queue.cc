#include "server/daemon/work_queue.h"

#include <spdlog/spdlog.h>

#include <exception>
#include <utility>

#include "server/daemon/scheduling.h"

namespace pheromone::daemon {

WorkQueue::WorkQueue(WorkQueueOptions options) : options_(std::move(options)) {
  for (size_t i = 0; i < options_.threads; ++i) {
    threads_.emplace_back([this] { Run(); });
  }
}

WorkQueue::~WorkQueue() {
  Close();
}

bool WorkQueue::Add(std::function<void()> work) {
  const std::lock_guard lock(mutex_);
  if (closed_ || waiting_.size() >= options_.max_waiting) {
    return false;
  }
  waiting_.push_back(std::move(work));
  wake_.notify_one();
  return true;
}

void WorkQueue::Close() {
  std::deque<std::function<void()>> dropped;
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    dropped.swap(waiting_);
    wake_.notify_all();
  }
  dropped.clear();  // outside the lock: their destructors may do work
  for (std::thread& thread : threads_) {
    if (thread.joinable()) {
      thread.join();
    }
  }
}

void WorkQueue::Run() {
  if (options_.yields) {
    YieldToOthers();
  }
  for (;;) {
    std::function<void()> work;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [this] { return closed_ || !waiting_.empty(); });
      if (closed_) {
        return;
      }
      work = std::move(waiting_.front());
      waiting_.pop_front();
    }
    try {
      work();
    } catch (const std::exception& failure) {
      spdlog::error("{}: {}", options_.name, failure.what());
    }
  }
}

}  // namespace pheromone::daemon
