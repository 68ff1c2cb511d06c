// Notices of changes in a running server, pushed to subscribers. Each subscriber has a bounded
// queue of its own.
//
//   auto subscription = control->Subscribe({.wake = [&] { post(executor, take); }});
//   ...
//   // in `take`, on the subscriber's own thread:
//   const Subscription::Taken taken = subscription->Take();
//   for (const Notice& notice : taken.notices) { ... }
//   if (taken.dropped != 0) { /* query the complete state */ }
//
// The publisher never waits for a subscriber: if a queue is full, its oldest notice is dropped and
// counted; other subscribers are not affected. Notices report the latest state rather than a
// history: of two changes in quick succession, a subscriber may see only the second.
//
// Thread-safe. Subscriptions and their board may be destroyed in either order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace pheromone::control {

struct Notice {
  enum class Topic : uint8_t {
    kConfiguration,  ///< another configuration is in effect
    kCapture,        ///< on: a recording started; off: it stopped
    kLink,           ///< on: the link is up; off: it is down, or another attempt failed
    kHealth,         ///< on: the log is durable again; off: it is not
    kArrival,        ///< on: a robot has reached its goal, and is halted
    kNet,            ///< off: a net has refused what a robot left on a tag
    kOperator,       ///< on: an operator has changed something; off: that was refused, or failed
  };
  Topic topic = Topic::kConfiguration;
  bool is_on = true;
  /// The link's name, with the robot's ID at an arrival; the net's name; where an operator's
  /// request came from; or empty.
  std::string subject = {};
  std::string text = {};  ///< the reason or the place; may be empty
  bool operator==(const Notice&) const = default;
};

struct ListenerOptions {
  size_t max_waiting = 64;  ///< at least 1; beyond it, the oldest notice is dropped
  /// Called when a notice is queued, and not again before Take; from any thread, under a lock: it
  /// should only post, and must not call the subscription. May be empty.
  std::function<void()> wake = {};
};

/// The queue of one subscriber.
class NoticeQueue {
 public:
  struct Taken {
    std::vector<Notice> notices;  ///< in the order of publication
    uint64_t dropped = 0;         ///< since the last Take; they were older than these
  };

  explicit NoticeQueue(ListenerOptions options);
  NoticeQueue(const NoticeQueue&) = delete;
  NoticeQueue& operator=(const NoticeQueue&) = delete;

  void Push(const Notice& notice);
  Taken Take();
  /// `wake` is not called after this returns.
  void Close();

 private:
  std::mutex mutex_;
  ListenerOptions options_;
  std::deque<Notice> waiting_;
  uint64_t dropped_ = 0;
  bool awake_ = false;  // `wake` was called, and Take was not yet
};

/// The subscriber's end of a queue; destroying it ends the subscription.
class Subscription {
 public:
  using Taken = NoticeQueue::Taken;

  explicit Subscription(std::shared_ptr<NoticeQueue> queue) : queue_(std::move(queue)) {}
  Subscription(const Subscription&) = delete;
  Subscription& operator=(const Subscription&) = delete;
  ~Subscription() { queue_->Close(); }

  /// Removes and returns all queued notices.
  Taken Take() { return queue_->Take(); }

 private:
  const std::shared_ptr<NoticeQueue> queue_;
};

/// The publisher's end.
class NoticeBoard {
 public:
  std::unique_ptr<Subscription> Subscribe(ListenerOptions options);

  /// Queues a notice for all present subscribers, in time proportional to their number.
  void Publish(const Notice& notice);

 private:
  std::mutex mutex_;
  std::vector<std::weak_ptr<NoticeQueue>> listeners_;
};

}  // namespace pheromone::control
