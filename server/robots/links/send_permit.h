// Leave to send on a line that another server of a cluster can send on, too (a radio channel with a
// modem at each of them): given until a time, and asked for directly before each write.
//
//   SendPermit permit;
//   permit.OnChange([&] { ... });              // post, and do not call back
//   permit.Set(until_ms, "a");                 // by who knows (server/cluster/link_owners.h)
//   if (permit.Claim(duration)) write(...);    // what is on the air for so long
//
// The time is CLOCK_BOOTTIME, which is read in Allows and Claim: a process that was stopped, or
// whose machine was suspended, finds its permit over, whoever has noticed.
//
// The margin: what is claimed lasts from the keying of the transmitter to the end of its tail, as
// if all of it were still to be written, and kDriverDelay more: for the time between the clock and
// the driver, and between the driver and the UART. It ends before the permit, or is not begun.
//
// All functions but OnChange are thread-safe; one thread at a time claims.
#pragma once

#include <time.h>

#include <algorithm>
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

  /// Whether something may be sent now that is on the air for `lasting`.
  bool Allows(std::chrono::nanoseconds lasting = std::chrono::nanoseconds(0)) const {
    return EndOf(lasting) <= until_ms_;
  }

  /// The same, directly before sending it.
  bool Claim(std::chrono::nanoseconds lasting) {
    const uint64_t end_ms = EndOf(lasting);
    if (end_ms > until_ms_) {
      return false;
    }
    in_use_until_ms_ = std::max(in_use_until_ms_.load(), end_ms);
    return end_ms <= until_ms_;
  }
  /// When all that was claimed is over. Who has set the permit to 0 and asks then misses nothing:
  /// Claim looks at the permit again when it has noted it.
  uint64_t in_use_until_ms() const { return in_use_until_ms_; }

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
  static constexpr std::chrono::milliseconds kDriverDelay{20};

  uint64_t EndOf(std::chrono::nanoseconds lasting) const {
    const auto needed = std::chrono::ceil<std::chrono::milliseconds>(lasting) + kDriverDelay;
    return now_ms_() + static_cast<uint64_t>(needed.count());
  }

  const Now now_ms_;
  std::atomic<uint64_t> until_ms_{0};
  std::atomic<uint64_t> in_use_until_ms_{0};
  std::function<void()> on_change_;
  mutable std::mutex mutex_;
  bool allowed_ = false;
  std::string owner_;
};

}  // namespace pheromone::links
