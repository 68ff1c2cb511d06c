#include "server/daemon/work_queue.h"

#include <pthread.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <exception>
#include <utility>

namespace pheromone::daemon {
namespace {

constexpr int kNice = 10;

}  // namespace

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
  dropped.clear();  // outside of the lock: what they hold may do more than vanish
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

void YieldToOthers() {
  const sched_param none{};
  if (pthread_setschedparam(pthread_self(), SCHED_BATCH, &none) != 0) {
    spdlog::debug("the system does not let a thread have the class SCHED_BATCH");
  }
  // Of the calling thread alone, as Linux has it (setpriority(2), "C library/kernel differences").
  if (setpriority(PRIO_PROCESS, 0, kNice) != 0) {
    spdlog::debug("the system does not let a thread have the nice value {}", kNice);
  }
}

void TakeShortTurns() {
  // As sched_setattr(2) describes it; the C library has neither the function nor the structure.
  struct {
    uint32_t size = 48;
    uint32_t policy = SCHED_OTHER;
    uint64_t flags = 0;
    int32_t nice = getpriority(PRIO_PROCESS, 0);
    uint32_t priority = 0;
    uint64_t runtime_ns = 100'000;  // the shortest that Linux takes
    uint64_t deadline_ns = 0;
    uint64_t period_ns = 0;
  } attributes;
  static_assert(sizeof attributes == 48);
  if (syscall(SYS_sched_setattr, 0, &attributes, 0) != 0) {
    spdlog::debug("the system does not let a thread have turns of its own length: {}",
                  std::strerror(errno));
  }
}

}  // namespace pheromone::daemon
