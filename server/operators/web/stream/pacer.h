// Short pauses in the work of a thread of low priority.
//
//   Pacer pacer;
//   while (io.run_one() != 0) {
//     pacer.MayPause();
//   }
//
// Low priority alone does not keep such a thread from holding up robots. Linux lets it finish its
// turn, up to some milliseconds, before a thread that wakes; and what the kernel does for serial
// ports and pseudo-terminals it does in threads of its own, to which the nice value of a thread of
// ours means nothing if our processes are a group (a service, or a terminal's session). A thread
// that sleeps, however shortly, has given the processor away.
#pragma once

#include <chrono>
#include <functional>
#include <utility>

namespace pheromone::web {

class Pacer {
 public:
  using Nanoseconds = std::chrono::nanoseconds;

  /// The processor's time between two pauses, and the least length of a pause. With them, the 99th
  /// percentile of answer times of 16 robots at 115200 baud is about as good beside twenty viewers
  /// as without (proto_tests/exchange_bench/results/README.md).
  static constexpr Nanoseconds kPiece = std::chrono::microseconds(200);
  static constexpr Nanoseconds kPause = std::chrono::microseconds(300);

  struct Parts {
    std::function<Nanoseconds()> used;  ///< time for which this thread had the processor
    std::function<Nanoseconds()> now;   ///< of a clock that never decreases
    std::function<void(Nanoseconds)> sleep;
  };

  /// Those of the operating system; all calls are made on one thread.
  Pacer();
  explicit Pacer(Parts parts) : parts_(std::move(parts)) {}

  /// Between two pieces of work: sleeps for kPause, if the thread has used the processor for kPiece
  /// since it last did.
  void MayPause();

  /// The length of all pauses so far.
  Nanoseconds paused() const { return paused_; }

 private:
  const Parts parts_;
  Nanoseconds used_at_pause_{0};
  Nanoseconds paused_{0};
};

}  // namespace pheromone::web
