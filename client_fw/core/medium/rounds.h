// The turns that a server grants on a half-duplex channel (protocol/README.md, section 9): a ROUND
// says whose turn it is, answers those of the round before, and may leave an opening in which
// everybody contends.
//
//   if (rounds.OnRound(data, length)) {          // DATA of a ROUND
//     Use(Rounds::AnswerIn(data, turn));         // to what was sent in the turn before
//     rounds.Grant(data);
//     rounds.KeepOpen(rounds.reserved_ms(), slot_ms);
//   }
//   rounds.OnFrameOf(id);                        // each frame of another robot
//   if (rounds.TurnDue(receiving) == Rounds::kDue) ... send, at most values().turn_bytes
//
// Time is told by Advance. Nothing is allocated; one loop.
#pragma once

#include <stdint.h>

#include "client_fw/core/base/run_down.h"
#include "protocol/fields.h"
#include "protocol/messages.h"

namespace pheromone {
namespace client {

struct RoundValues {   // plain memory: all zero
  uint8_t number;      ///< of the last ROUND granted
  uint8_t slot_ms;     ///< told last; 0: it was not
  uint8_t turn_bytes;  ///< the longest frame that fits a turn
  uint8_t turns;       ///< ours in this round that are still to come
  uint8_t turn;        ///< index in the round of the one that is due
};

/// What begins at zero, separate so that one loop can clear it as plain memory.
class RoundVariables {
 protected:
  enum Timer : uint8_t {
    kRounds,
    kReserved,
    kOpen,
    kTurn,        // until our turn begins
    kTurnLate,    // until it is too late for it
    kSecondTurn,  // until the second one begins
    kTimers
  };

  RoundValues values_;
  uint8_t next_turn_;     // index in the round
  uint8_t before_us_;     // ID of the robot whose turn precedes ours; 0: the server
  uint8_t before_turns_;  // of it, not heard yet
  uint8_t open_slots_;    // of this round
  uint16_t timers_[kTimers];
};

class Rounds : private RoundVariables {
 public:
  enum Turn : uint8_t { kNone, kDue, kMissed };

  Rounds(uint8_t id, uint8_t three_bytes_ms)
      : RoundVariables(), id_(id), three_bytes_ms_(three_bytes_ms) {}

  void Advance(uint16_t elapsed_ms) { RunDown(timers_, kTimers, elapsed_ms); }

  /// False, and nothing happens, if DATA is no ROUND's.
  bool OnRound(const uint8_t* data, uint8_t length);
  /// DATA of the answer to this turn of the round before: left, right. Null: none.
  static const uint8_t* AnswerIn(const uint8_t* data, uint8_t turn);
  /// Whether this is the ROUND after the last one granted.
  bool Follows(const uint8_t* data) const;
  /// Who has turns, and whether the others may contend after them: KeepOpen is to follow. True:
  /// some are ours. `adapter_ms`: for so long bytes are held back.
  bool Grant(const uint8_t* data, uint8_t adapter_ms = 0);

  /// Takes no turn in this round.
  void Decline() { values_.turns = 0; }

  /// A frame of another robot: its turn is over with it.
  void OnFrameOf(uint8_t id);
  /// Whether it is our turn; each one is told once. `receiving`: a frame of somebody else, which
  /// may be about to end; a carrier without one may be the tail of a keyed transmitter.
  Turn TurnDue(bool receiving);

  /// The slot, as told in something else.
  void TellSlot(uint8_t slot_ms) { values_.slot_ms = slot_ms; }

  /// An opening lasts for its slots after whatever was sent in it.
  void KeepOpen(uint16_t before_slots_ms, uint8_t slot_ms);
  /// Slots of the opening to choose from; 0: there is none, or any moment will do.
  uint8_t OpenSlots() const;

  /// For so long the server counts as granting turns; 0: it does not.
  uint16_t left_ms() const { return timers_[kRounds]; }
  /// For so long others are heard in their turns.
  uint16_t reserved_ms() const { return timers_[kReserved]; }
  /// Who has no turn may contend.
  bool open() const { return timers_[kOpen] != 0; }
  const RoundValues& values() const { return values_; }

 private:
  uint8_t id_;
  uint8_t three_bytes_ms_;
};

/// Without a ROUND for so long there are none any more.
constexpr uint16_t kRoundsMs = 2000;

}  // namespace client
}  // namespace pheromone
