// Memory of the field: its limit, and its reclamation.
//
// MemoryBudget counts bytes. Its count depends only on the order of changes, never on readers, so
// that "map full" is the same in a replay.
//
// Reclaimer lets any number of readers use objects that one writer removes: an object is freed only
// when no reader that could have found it is still reading (epoch-based reclamation, Fraser 2004).
// Readers are wait-free: two stores and a load per visit. All shared words are atomic, and there
// are no fences, so that ThreadSanitizer can follow.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>

namespace pheromone::field {

struct MemoryBudget {
  uint64_t limit_bytes = 0;
  uint64_t used_bytes = 0;  ///< including reservations
  /// Of a change in progress: it is used up first, and what the change releases is added, so that
  /// nobody else takes what the change needs again. Null: there is none.
  uint64_t* reservation = nullptr;

  /// False, changing nothing, if that much is not left.
  bool Take(uint64_t bytes) {
    if (reservation != nullptr && *reservation >= bytes) {
      *reservation -= bytes;
      return true;
    }
    if (used_bytes + bytes > limit_bytes) {
      return false;
    }
    used_bytes += bytes;
    return true;
  }
  void Give(uint64_t bytes) {
    if (reservation != nullptr) {
      *reservation += bytes;
    } else {
      used_bytes -= bytes;
    }
  }
};

class Reclaimer {  // NOLINT(clang-analyzer-optin.performance.Padding): a line for each slot
 public:
  static constexpr size_t kReaders = 64;

  Reclaimer() = default;
  Reclaimer(const Reclaimer&) = delete;
  Reclaimer& operator=(const Reclaimer&) = delete;
  ~Reclaimer();  ///< frees everything; no reader is left

  /// Registers one reader (one thread at a time); any thread. Negative if all places are in use.
  int Register();
  void Unregister(int reader);

  /// Between these two calls, objects that the reader finds stay valid even if they are unlinked.
  void Enter(int reader) {
    slots_[static_cast<size_t>(reader)].epoch.store(epoch_.load(std::memory_order_acquire));
  }
  void Leave(int reader) {
    slots_[static_cast<size_t>(reader)].epoch.store(kIdle, std::memory_order_release);
  }

  /// The writer: `free` will be called, by the writer's thread inside a later Retire or Collect,
  /// when no reader can hold the object any more. The object was unlinked before by a
  /// sequentially consistent store to the pointer that readers load with the same order.
  void Retire(std::function<void()> free);
  void Collect();

  size_t waiting() const { return waiting_.size(); }

 private:
  static constexpr uint64_t kIdle = UINT64_MAX;
  struct alignas(64) Slot {
    std::atomic<uint64_t> epoch{kIdle};
    std::atomic<bool> taken{false};
  };
  struct Retired {
    uint64_t epoch;
    std::function<void()> free;
  };

  std::atomic<uint64_t> epoch_{0};
  std::array<Slot, kReaders> slots_;
  std::deque<Retired> waiting_;
};

}  // namespace pheromone::field
