// Holds the messages that may not be sent until a change is durable: one answer for each robot,
// however often it repeats its request, and the commands of the operator.
//
//   if (const auto dropped = held.Hold(answer)) ...   // this one is dropped
//   held.Release(log.DurableSequence(), &out);
//
// A robot has one request in flight (protocol/README.md, section 8). A repeated request shares the
// held answer, which then goes to the source of the last repetition; a different request abandons
// the earlier one.
//
// Memory: 40 KiB for each link on which a robot ever waited, independent of the number of robots.
// The caller limits the number of commands. Not thread-safe.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "server/core/engine/event.h"

namespace pheromone::engine {

class HeldAnswers {
 public:
  struct Dropped {
    Outgoing answer;
    bool repeated = false;  ///< the same was held, and still is
  };

  /// Holds an answer; returns the one that is dropped because of it.
  std::optional<Dropped> Hold(const Outgoing& answer);
  /// Removes and returns the answer held for a robot.
  std::optional<Dropped> Drop(LinkIndex link, uint8_t id);

  /// Holds a command. Commands keep their order and none replaces another: a halt issued after a
  /// resume must stay behind it.
  void HoldCommand(const Outgoing& command) { commands_.push_back(command); }

  /// Appends the messages that depend on no change later than `durable`, in the order in which they
  /// were held; a message that is due before one held earlier waits for it.
  void Release(uint64_t durable, std::vector<Outgoing>* out);

  size_t answers() const { return count_; }
  size_t commands() const { return commands_.size(); }

 private:
  static constexpr uint32_t kNone = UINT32_MAX;

  // The held slots form a list, the oldest first.
  struct Slot {
    bool held = false;
    uint32_t previous = kNone;
    uint32_t next = kNone;
    uint64_t due = 0;  // the greatest durable_at up to here
    Outgoing answer;
  };

  static uint32_t Place(LinkIndex link, uint8_t id) { return uint32_t{link} << 8 | id; }
  Slot& At(uint32_t place) { return (*links_[place >> 8])[place & 0xFFu]; }
  void Unlink(Slot* slot);

  std::vector<std::unique_ptr<std::array<Slot, 256>>> links_;
  uint32_t first_ = kNone;
  uint32_t last_ = kNone;
  size_t count_ = 0;
  std::deque<Outgoing> commands_;
};

}  // namespace pheromone::engine
