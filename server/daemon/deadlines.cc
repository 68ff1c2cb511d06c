#include "server/daemon/deadlines.h"

#include <utility>

namespace pheromone::daemon {

Deadlines::Deadlines() : thread_([this] { Run(); }) {}

Deadlines::~Deadlines() {
  Stop();
}

Deadlines::Id Deadlines::After(std::chrono::milliseconds delay, Call call) {
  Id id{std::chrono::steady_clock::now() + delay, 0};
  {
    const std::lock_guard lock(mutex_);
    id.second = ++last_;
    if (!stopped_) {
      const auto place = calls_.emplace(id, std::move(call)).first;
      if (place == calls_.begin()) {
        wake_.notify_one();
      }
      return id;
    }
  }
  call(true);
  return id;
}

void Deadlines::Cancel(Id id) {
  Call cancelled;  // destroyed outside the lock
  const std::lock_guard lock(mutex_);
  const auto place = calls_.find(id);
  if (place != calls_.end()) {
    cancelled = std::move(place->second);
    calls_.erase(place);
  }
}

void Deadlines::Stop() {
  std::map<Id, Call> rest;
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
    rest.swap(calls_);
    wake_.notify_one();
  }
  if (thread_.joinable()) {
    thread_.join();
  }
  for (const auto& [id, call] : rest) {
    call(true);
  }
}

void Deadlines::Run() {
  std::unique_lock lock(mutex_);
  while (!stopped_) {
    if (calls_.empty()) {
      wake_.wait(lock);
    } else if (const auto due = calls_.begin()->first.first;
               due > std::chrono::steady_clock::now()) {
      wake_.wait_until(lock, due);
    } else {
      {
        const auto first = calls_.extract(calls_.begin());
        lock.unlock();
        first.mapped()(false);
      }  // the call is destroyed outside the lock
      lock.lock();
    }
  }
}

}  // namespace pheromone::daemon
