#include "server/daemon/scheduling.h"

#include <pthread.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>

namespace pheromone::daemon {
namespace {

constexpr int kNice = 19;
constexpr uint64_t kShortestTurnNs = 100'000;
constexpr uint64_t kKeepPolicy = 0x08;  // SCHED_FLAG_KEEP_POLICY

// As sched_setattr(2) describes it; the C library has neither the function nor the structure.
struct Attributes {
  uint32_t size = 48;
  uint32_t policy = 0;
  uint64_t flags = 0;
  int32_t nice = 0;
  uint32_t priority = 0;
  uint64_t runtime_ns = 0;
  uint64_t deadline_ns = 0;
  uint64_t period_ns = 0;
};
static_assert(sizeof(Attributes) == 48);

}  // namespace

void YieldToOthers() {
  const sched_param none{};
  if (pthread_setschedparam(pthread_self(), SCHED_BATCH, &none) != 0) {
    spdlog::debug("cannot set the scheduling class SCHED_BATCH");
  }
  // Of the calling thread alone, as Linux has it (setpriority(2), "C library/kernel differences").
  if (setpriority(PRIO_PROCESS, 0, kNice) != 0) {
    spdlog::debug("cannot set the nice value {}", kNice);
  }
}

void TakeShortTurns() {
  Attributes attributes;
  attributes.flags = kKeepPolicy;  // the server may have been started with another class
  attributes.nice = getpriority(PRIO_PROCESS, 0);
  attributes.runtime_ns = kShortestTurnNs;
  if (syscall(SYS_sched_setattr, 0, &attributes, 0) != 0) {
    spdlog::debug("cannot set the time slice of a thread: {}", std::strerror(errno));
  }
}

}  // namespace pheromone::daemon
