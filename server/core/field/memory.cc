#include "server/core/field/memory.h"

#include <algorithm>
#include <utility>

namespace pheromone::field {

Reclaimer::~Reclaimer() {
  for (const Retired& retired : waiting_) {
    retired.free();
  }
}

int Reclaimer::Register() {
  for (size_t i = 0; i < kReaders; ++i) {
    bool free = false;
    if (slots_[i].taken.compare_exchange_strong(free, true)) {
      return static_cast<int>(i);
    }
  }
  return -1;
}

void Reclaimer::Unregister(int reader) {
  Leave(reader);
  slots_[static_cast<size_t>(reader)].taken.store(false);
}

void Reclaimer::Retire(std::function<void()> free) {
  // A reader that enters from now on stores the next epoch, or an older one although it entered
  // later; the latter only delays.
  const uint64_t epoch = epoch_.fetch_add(1);
  waiting_.push_back({epoch, std::move(free)});
  Collect();
}

void Reclaimer::Collect() {
  if (waiting_.empty()) {
    return;
  }
  uint64_t oldest = kIdle;
  for (const Slot& slot : slots_) {
    oldest = std::min(oldest, slot.epoch.load());
  }
  while (!waiting_.empty() && waiting_.front().epoch < oldest) {
    waiting_.front().free();
    waiting_.pop_front();
  }
}

}  // namespace pheromone::field
