// What may not be sent before a change is durable, until it is: one answer for each robot, however
// often it asks, and the commands of the operator.
//
//   if (const auto dropped = held.Hold(answer)) ...   // this one goes nowhere
//   held.Release(log.DurableSequence(), &out);
//
// A robot has one request under way (protocol/README.md, section 8). One that repeats it joins the
// answer that waits, which then goes to where it was asked for last; one that asks for something
// else has given up what it asked for before.
//
// Memory: 40 KiB for each link on which a robot ever waited, whoever else claims to be there.
// Commands are as many as were issued: their number is for the caller to bound. Not thread-safe.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "server/engine/event.h"

namespace pheromone::engine {

class HeldAnswers {
 public:
  struct Dropped {
    Outgoing answer;
    bool repeated = false;  ///< the same was held, and still is
  };

  /// Takes an answer; returns the one that goes nowhere because of it.
  std::optional<Dropped> Hold(const Outgoing& answer);
  /// Lets go of a robot's answer, and returns it.
  std::optional<Dropped> Drop(LinkIndex link, uint8_t id);

  /// Takes what nobody asked for. Commands keep their order, and none replaces another: a halt that
  /// comes after a resume must stay behind it.
  void HoldCommand(const Outgoing& command) { commands_.push_back(command); }

  /// Appends what speaks of no later change than `durable`, in the order in which it was given; an
  /// answer that is due before one that was given earlier waits for that.
  void Release(uint64_t durable, std::vector<Outgoing>* out);

  size_t answers() const { return count_; }
  size_t commands() const { return commands_.size(); }

 private:
  static constexpr uint32_t kNone = UINT32_MAX;

  // The slots that are held form a list, from the one given first.
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
