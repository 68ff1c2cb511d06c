#include "client_fw/core/medium/rounds.h"

#include "client_fw/core/base/outlined.h"

namespace pheromone {
namespace client {
namespace {

// Offsets in DATA.
constexpr uint8_t kNumberAt = protocol::OffsetOf(&protocol::Round::number);
constexpr uint8_t kTurnAt = protocol::OffsetOf(&protocol::Round::turn_ms);
constexpr uint8_t kTurnBytesAt = protocol::OffsetOf(&protocol::Round::turn_bytes);
constexpr uint8_t kRoundSlotAt = protocol::OffsetOf(&protocol::Round::slot_ms);
constexpr uint8_t kOpenAt = protocol::OffsetOf(&protocol::Round::open_slots);
constexpr uint8_t kCountsAt = protocol::OffsetOf(&protocol::Round::turn_count);
constexpr uint8_t kRoundHeader = protocol::OffsetOf(&protocol::Round::answers, 0);

constexpr uint8_t kAnswerSize = protocol::SizeOf<protocol::RoundAnswer>().least;

uint8_t Answers(const uint8_t* data) {
  return data[kCountsAt] & 0x0Fu;
}

uint8_t Turns(const uint8_t* data) {
  return static_cast<uint8_t>(data[kCountsAt] >> 4);
}

}  // namespace

bool Rounds::OnRound(const uint8_t* data, uint8_t length) {
  if (length < kRoundHeader || length != kRoundHeader + kAnswerSize * Answers(data) + Turns(data)) {
    return false;
  }
  timers_[kRounds] = kRoundsMs;
  return true;
}

const uint8_t* Rounds::AnswerIn(const uint8_t* data, uint8_t turn) {
  return turn < Answers(data) ? &data[kRoundHeader + kAnswerSize * turn] : nullptr;
}

bool Rounds::Follows(const uint8_t* data) const {
  return static_cast<uint8_t>(values_.number + 1u) == data[kNumberAt];
}

bool Rounds::Grant(const uint8_t* data, uint8_t adapter_ms) {
  values_.number = data[kNumberAt];
  values_.turn_bytes = data[kTurnBytesAt];
  values_.slot_ms = data[kRoundSlotAt];
  values_.turns = 0;
  const uint8_t turn_ms = data[kTurnAt];
  const uint8_t count = Turns(data);
  const uint8_t* const turns = &data[kRoundHeader + kAnswerSize * Answers(data)];
  for (uint8_t i = 0; i < count; ++i) {
    // The second turn of ours follows the first.
    if (turns[i] != id_ || (values_.turns != 0 && i != next_turn_ + 1)) {
      continue;
    }
    const uint16_t begin_ms = static_cast<uint16_t>(protocol::kBeforeTurnsMs + i * turn_ms);
    if (++values_.turns == 1) {
      next_turn_ = i;
      before_us_ = i == 0 ? uint8_t{0} : turns[i - 1];
      before_turns_ = i > 1 && turns[i - 2] == before_us_ ? uint8_t{2} : uint8_t{1};
      timers_[kTurn] = begin_ms;
      timers_[kTurnLate] = static_cast<uint16_t>(begin_ms + protocol::kLatestTurnMs);
    } else {
      timers_[kSecondTurn] = begin_ms;
    }
  }
  timers_[kReserved] =
      count == 0 ? uint16_t{0}
                 : static_cast<uint16_t>(protocol::kBeforeTurnsMs + count * turn_ms + adapter_ms);
  open_slots_ = data[kOpenAt];
  timers_[kOpen] = open_slots_ != 0 ? 1 : 0;
  return values_.turns != 0;
}

// The server makes an opening as wide as it takes, so any of its slots will do.
uint8_t Rounds::OpenSlots() const {
  return left_ms() != 0 && open() && open_slots_ != protocol::kOpenUntilNextRound ? open_slots_
                                                                                  : uint8_t{0};
}

void Rounds::KeepOpen(uint16_t before_slots_ms, uint8_t slot_ms) {
  if (timers_[kOpen] == 0) {
    return;
  }
  const uint16_t slots_ms =
      open_slots_ == protocol::kOpenUntilNextRound
          ? kRoundsMs
          : static_cast<uint16_t>(1u * open_slots_ * slot_ms + three_bytes_ms_);
  timers_[kOpen] = static_cast<uint16_t>(before_slots_ms + slots_ms);
}

// Ours begins at once. One that we do not hear has its full time.
void Rounds::OnFrameOf(uint8_t id) {
  if (values_.turns != 0 && timers_[kReserved] != 0 && id == before_us_ && before_turns_ != 0 &&
      --before_turns_ == 0) {
    timers_[kTurn] = 0;
  }
}

PHEROMONE_BY_POINTER Rounds::Turn Rounds::TurnDue(bool receiving) {
  if (timers_[kRounds] == 0) {
    values_.turns = 0;
  }
  const bool late = timers_[kTurnLate] == 0;
  if (values_.turns == 0 || timers_[kTurn] != 0 || (receiving && !late)) {
    return kNone;
  }
  values_.turn = next_turn_;
  if (--values_.turns != 0) {
    ++next_turn_;
    timers_[kTurn] = 0;  // directly after the first
    timers_[kTurnLate] = static_cast<uint16_t>(timers_[kSecondTurn] + protocol::kLatestTurnMs);
  }
  return late ? kMissed : kDue;
}

}  // namespace client
}  // namespace pheromone
