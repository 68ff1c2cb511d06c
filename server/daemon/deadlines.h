// Delayed calls on a thread of their own: timeouts, retransmissions, polling. Nothing on that
// thread blocks, so that deadlines are met.
//
//   Deadlines deadlines;
//   const Deadlines::Id id = deadlines.After(std::chrono::seconds(5), [=](bool stopped) { ... });
//   deadlines.Cancel(id);
//   deadlines.Stop();
//
// Each call is made once, unless it is cancelled before: in time with `stopped` false, or by Stop
// with `stopped` true. Thread-safe.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

namespace pheromone::daemon {

class Deadlines {
 public:
  using Call = std::function<void(bool stopped)>;
  using Id = std::pair<std::chrono::steady_clock::time_point, uint64_t>;

  Deadlines();
  Deadlines(const Deadlines&) = delete;
  Deadlines& operator=(const Deadlines&) = delete;
  ~Deadlines();

  /// `call` must not block. After Stop it is made at once, by the caller.
  Id After(std::chrono::milliseconds delay, Call call);

  /// Does nothing if the call has been made, or is being made.
  void Cancel(Id id);

  /// Makes the remaining calls, and returns when all have ended. Not from a call.
  void Stop();

 private:
  void Run();

  std::mutex mutex_;
  std::condition_variable wake_;
  std::map<Id, Call> calls_;  // in the order in which they are due
  uint64_t last_ = 0;
  bool stopped_ = false;
  std::thread thread_;
};

}  // namespace pheromone::daemon
