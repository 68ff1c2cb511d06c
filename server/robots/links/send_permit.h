// Leave to send on a line that another server of a cluster can send on, too (a radio channel with a
// modem at each of them): given until a time, and asked for directly before each write.
//
//   SendPermit permit;
//   permit.OnChange([&] { ... });              // post, and do not call back
//   permit.Set(until_ms, "a");                 // by who knows (server/cluster/link_owners.h)
//   if (permit.Allows(duration)) write(...);   // what is on the air for so long
//
// The time is CLOCK_BOOTTIME, which is read in Allows: a process that was stopped, or whose machine
// was suspended, finds its permit over, whoever has noticed. All functions but OnChange are
// thread-safe.
#pragma once

#include <time.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <utility>

namespace pheromone::links {

class SendPermit {
 public:
  using Now = uint64_t (*)();

  /// `now_ms`: tests change it.
  explicit SendPermit(Now now_ms = BoottimeMs) : now_ms_(now_ms) {}

  static uint64_t BoottimeMs() {
    timespec now{};
    clock_gettime(CLOCK_BOOTTIME, &now);
    return static_cast<uint64_t>(now.tv_sec) * 1000 +
           static_cast<uint64_t>(now.tv_nsec) / 1'000'000;
  }

  /// Whether something may be sent now that is on the air for `lasting`, drivers' delays apart.
  bool Allows(std::chrono::nanoseconds lasting = std::chrono::nanoseconds(0)) const {
    constexpr std::chrono::milliseconds kDriverDelay{20};
    const auto needed = std::chrono::ceil<std::chrono::milliseconds>(lasting) + kDriverDelay;
    return now_ms_() + static_cast<uint64_t>(needed.count()) <= until_ms_;
  }

  /// `owner`: the node that has it, as far as is known; for status.
  void Set(uint64_t until_ms, const std::string& owner) {
    until_ms_ = until_ms;
    bool is_news = false;
    {
      const std::lock_guard lock(mutex_);
      const bool allows = Allows();
      is_news = allows != allowed_ || owner != owner_;
      allowed_ = allows;
      owner_ = owner;
    }
    if (is_news && on_change_) {
      on_change_();
    }
  }
  std::string owner() const {
    const std::lock_guard lock(mutex_);
    return owner_;
  }
  /// Called when leave is given or has ended, or the owner is another one; from any thread. To be
  /// set before Set is called.
  void OnChange(std::function<void()> call) { on_change_ = std::move(call); }

 private:
  const Now now_ms_;
  std::atomic<uint64_t> until_ms_{0};
  std::function<void()> on_change_;
  mutable std::mutex mutex_;
  bool allowed_ = false;
  std::string owner_;
};

}  // namespace pheromone::links
