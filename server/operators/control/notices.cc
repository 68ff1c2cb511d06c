#include "server/operators/control/notices.h"

#include <cassert>
#include <iterator>
#include <utility>

namespace pheromone::control {

NoticeQueue::NoticeQueue(ListenerOptions options) : options_(std::move(options)) {
  assert(options_.max_waiting > 0);
}

void NoticeQueue::Push(const Notice& notice) {
  const std::lock_guard lock(mutex_);
  if (waiting_.size() >= options_.max_waiting) {
    waiting_.pop_front();
    ++dropped_;
  }
  waiting_.push_back(notice);
  if (options_.wake && !std::exchange(awake_, true)) {
    options_.wake();
  }
}

NoticeQueue::Taken NoticeQueue::Take() {
  const std::lock_guard lock(mutex_);
  Taken taken;
  taken.notices.assign(std::move_iterator(waiting_.begin()), std::move_iterator(waiting_.end()));
  taken.dropped = std::exchange(dropped_, 0);
  waiting_.clear();
  awake_ = false;
  return taken;
}

void NoticeQueue::Close() {
  const std::lock_guard lock(mutex_);
  options_.wake = nullptr;
}

std::unique_ptr<Subscription> NoticeBoard::Subscribe(ListenerOptions options) {
  auto queue = std::make_shared<NoticeQueue>(std::move(options));
  const std::lock_guard lock(mutex_);
  std::erase_if(listeners_, [](const auto& it) { return it.expired(); });
  listeners_.push_back(queue);
  return std::make_unique<Subscription>(std::move(queue));
}

// One at a time, so that all subscribers get the same order.
void NoticeBoard::Publish(const Notice& notice) {
  const std::lock_guard lock(mutex_);
  for (const std::weak_ptr<NoticeQueue>& it : listeners_) {
    if (const std::shared_ptr<NoticeQueue> queue = it.lock(); queue != nullptr) {
      queue->Push(notice);
    }
  }
}

}  // namespace pheromone::control
