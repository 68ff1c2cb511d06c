#include "server/operators/web/stream/pacer.h"

#include <time.h>

namespace pheromone::web {
namespace {

Pacer::Nanoseconds Read(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return std::chrono::seconds(time.tv_sec) + Pacer::Nanoseconds(time.tv_nsec);
}

// Returns early if a signal arrives, which does no harm.
void Sleep(Pacer::Nanoseconds time) {
  const timespec duration{0, static_cast<long>(time.count())};
  nanosleep(&duration, nullptr);
}

}  // namespace

Pacer::Pacer()
    : Pacer({.used = [] { return Read(CLOCK_THREAD_CPUTIME_ID); },
             .now = [] { return Read(CLOCK_MONOTONIC); },
             .sleep = Sleep}) {}

void Pacer::MayPause() {
  const Nanoseconds used = parts_.used();
  if (used - used_at_pause_ < kPiece) {
    return;
  }
  used_at_pause_ = used;
  const Nanoseconds begin = parts_.now();
  parts_.sleep(kPause);
  paused_ += parts_.now() - begin;
}

}  // namespace pheromone::web
