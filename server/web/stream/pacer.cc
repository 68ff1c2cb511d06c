#include "server/web/stream/pacer.h"

#include <time.h>

#include <thread>

namespace pheromone::web {
namespace {

Pacer::Nanoseconds Read(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return std::chrono::seconds(time.tv_sec) + Pacer::Nanoseconds(time.tv_nsec);
}

}  // namespace

Pacer::Pacer()
    : Pacer({.used = [] { return Read(CLOCK_THREAD_CPUTIME_ID); },
             .now = [] { return Read(CLOCK_MONOTONIC); },
             .sleep = [](Nanoseconds time) { std::this_thread::sleep_for(time); }}) {}

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
