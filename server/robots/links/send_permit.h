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
// All functions but OnChange are thread-safe; one thread at a time claims and holds.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>

#include "server/base/boottime.h"

namespace pheromone::links {

class SendPermit {
 public:
  using Now = uint64_t (*)();

  /// `now_ms`: tests change it.
  explicit SendPermit(Now now_ms = BoottimeMs);

  /// Whether something may be sent now that is on the air for `lasting`.
  bool Allows(std::chrono::nanoseconds lasting = std::chrono::nanoseconds(0)) const;
  /// The same, directly before sending it.
  bool Claim(std::chrono::nanoseconds lasting);
  /// Between these it may be on the air for as long as a driver takes: said before the claim with
  /// which that begins, and when the driver has returned.
  void Hold() { is_held_ = true; }
  void Release() { is_held_ = false; }
  /// When all that was claimed is over; UINT64_MAX: while it is held. Who has set the permit to 0
  /// and asks then misses nothing: Claim looks at the permit again when it has noted it.
  uint64_t in_use_until_ms() const;

  /// `owner`: the node that has it, as far as is known; for status.
  void Set(uint64_t until_ms, const std::string& owner);
  std::string owner() const;
  /// Called when leave is given or has ended, or the owner is another one; from any thread. To be
  /// set before Set is called.
  void OnChange(std::function<void()> call);

 private:
  uint64_t EndOf(std::chrono::nanoseconds lasting) const;

  const Now now_ms_;
  std::atomic<uint64_t> until_ms_{0};
  std::atomic<uint64_t> in_use_until_ms_{0};
  std::atomic<bool> is_held_{false};
  std::function<void()> on_change_;
  mutable std::mutex mutex_;
  bool allowed_ = false;
  std::string owner_;
};

}  // namespace pheromone::links
