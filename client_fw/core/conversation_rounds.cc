// Rounds: the server says whose turn it is, and answers a round with one frame (protocol/README.md,
// section 9). See conversation.cc for contention.
#include "client_fw/core/conversation.h"

namespace pheromone {
namespace client {
namespace {

constexpr uint16_t kRoundsMs = 2000;  // without a ROUND there are none any more
constexpr uint8_t kLatestMs = 2;      // after its beginning a turn can still be taken

// Offsets in DATA.
constexpr uint8_t kNumberAt = protocol::OffsetOf(&protocol::Round::number);
constexpr uint8_t kTurnAt = protocol::OffsetOf(&protocol::Round::turn_ms);
constexpr uint8_t kTurnBytesAt = protocol::OffsetOf(&protocol::Round::turn_bytes);
constexpr uint8_t kRoundSlotAt = protocol::OffsetOf(&protocol::Round::slot_ms);
constexpr uint8_t kOpenAt = protocol::OffsetOf(&protocol::Round::open_slots);
constexpr uint8_t kCountsAt = protocol::OffsetOf(&protocol::Round::turn_count);
constexpr uint8_t kRoundHeader = protocol::OffsetOf(&protocol::Round::answers, 0);

constexpr uint8_t kAnswerSize = protocol::SizeOf<protocol::RoundAnswer>().least;

}  // namespace

void Conversation::OnRound(const uint8_t* data, uint8_t length) {
  if (length < kRoundHeader) {
    return;
  }
  const uint8_t answers = data[kCountsAt] & 0x0Fu;
  const uint8_t turns = static_cast<uint8_t>(data[kCountsAt] >> 4);
  if (length != kRoundHeader + kAnswerSize * answers + turns) {
    return;
  }
  Count(&Counters::rounds);
  timers_[kRounds] = kRoundsMs;
  timers_[kPause] = 0;  // the server is there
  if (!HasTurns()) {
    HearServer();
  }
  if (in_turn_) {
    const bool follows = static_cast<uint8_t>(round_ + 1u) == data[kNumberAt];
    const uint8_t* const answer = data + kRoundHeader + kAnswerSize * asked_index_;
    in_turn_ = false;
    if (follows && asked_index_ < answers) {
      OnRoundAnswer(protocol::GetI16(answer), answer);
    } else {
      OnRoundAnswer(protocol::kNoIntensities, nullptr);
    }
  } else if (phase_ == Phase::kAwaiting && tx_size_ == 0) {
    OnMiss();  // the server answers before it begins a round
  }
  round_ = data[kNumberAt];
  turn_bytes_ = data[kTurnBytesAt];
  round_slot_ms_ = data[kRoundSlotAt];
  GrantTurns(data + kRoundHeader + kAnswerSize * answers, turns, data[kTurnAt], data[kOpenAt]);
}

void Conversation::OnRoundAnswer(int16_t left, const uint8_t* intensities) {
  if (left != protocol::kNoIntensities) {
    if (RequestPending()) {
      memory_->opcode = 0;
    }
    too_long_ = false;
    OnSuccess();
    OnIntensities(intensities);
    HearServer();
    Contend();  // for an EVENT, if there is one
    return;
  }
  const int16_t reason = intensities != nullptr ? protocol::GetI16(intensities + 2) : int16_t{0};
  if (reason != 0) {
    HearServer();
    OnRefusal(static_cast<protocol::Reason>(reason));
    return;
  }
  Count(&Counters::timeouts);
  if (!greeted_) {
    WaitForHello();
  } else {
    ++attempt_;
    attempt_ = attempt_ > kMaxRetries ? kMaxRetries : attempt_;
    Contend();
  }
}

// Who has turns, and when the others may contend.
void Conversation::GrantTurns(const uint8_t* turns, uint8_t count, uint8_t turn_ms,
                              uint8_t open_slots) {
  turns_ = 0;
  for (uint8_t i = 0; i < count; ++i) {
    // The second turn of ours follows the first.
    if (turns[i] != parameters().id || (turns_ != 0 && i != turn_index_ + 1)) {
      continue;
    }
    const uint16_t begin_ms = static_cast<uint16_t>(protocol::kBeforeTurnsMs + i * turn_ms);
    if (++turns_ == 1) {
      turn_index_ = i;
      before_us_ = i == 0 ? uint8_t{0} : turns[i - 1];
      before_turns_ = i > 1 && turns[i - 2] == before_us_ ? uint8_t{2} : uint8_t{1};
      timers_[kTurn] = begin_ms;
      timers_[kTurnLate] = static_cast<uint16_t>(begin_ms + kLatestMs);
    } else {
      timers_[kSecondTurn] = begin_ms;
    }
  }
  if (turns_ != 0) {
    in_rounds_ = true;
    HearServer();
    timers_[kAckDue] = kRoundsMs;  // it has a turn
  }
  const uint16_t reserved_ms =
      count == 0 ? uint16_t{0} : static_cast<uint16_t>(protocol::kBeforeTurnsMs + count * turn_ms);
  timers_[kReserved] = reserved_ms;
  timers_[kOpen] = 0;
  open_slots_ = open_slots;
  if (open_slots != 0) {
    timers_[kOpen] = 1;
    KeepOpen(reserved_ms);
    DrawInOpening();
  }
}

// The server makes an opening as wide as it takes, so any of its slots will do.
void Conversation::DrawInOpening() {
  if (timers_[kRounds] != 0 && timers_[kOpen] != 0 &&
      open_slots_ != protocol::kOpenUntilNextRound) {
    countdown_ = static_cast<uint8_t>(1 + random_.Below(open_slots_));
  }
}

// An opening lasts for its slots after whatever was sent in it.
void Conversation::KeepOpen(uint16_t before_slots_ms) {
  if (timers_[kOpen] == 0) {
    return;
  }
  const uint16_t slots_ms =
      open_slots_ == protocol::kOpenUntilNextRound
          ? kRoundsMs
          : static_cast<uint16_t>(1u * open_slots_ * SlotMs() + three_bytes_ms_);
  timers_[kOpen] = static_cast<uint16_t>(before_slots_ms + slots_ms);
}

// Its turn is over when its frame is: ours begins at once. One that we do not hear has its full
// time.
void Conversation::OnTurnOf(uint8_t id) {
  if (turns_ != 0 && timers_[kReserved] != 0 && id == before_us_ && before_turns_ != 0 &&
      --before_turns_ == 0) {
    timers_[kTurn] = 0;
  }
}

void Conversation::CheckTurns(const Odometry* odometry, bool clear) {
  if (timers_[kRounds] == 0) {
    LeaveRounds();
    return;
  }
  if (turns_ == 0 || timers_[kTurn] != 0) {
    return;
  }
  if (!clear && timers_[kTurnLate] != 0) {
    return;  // the station before us may be about to end
  }
  const bool late = timers_[kTurnLate] == 0;
  if (!late) {
    TakeTurn(odometry);
  } else {
    Count(&Counters::skipped_turns);
  }
  if (--turns_ != 0) {
    ++turn_index_;
    timers_[kTurn] = 0;  // directly after the first
    timers_[kTurnLate] = static_cast<uint16_t>(timers_[kSecondTurn] + kLatestMs);
  }
}

// An ACK goes first; the server has granted two turns then.
void Conversation::TakeTurn(const Odometry* odometry) {
  Count(&Counters::turns);
  if (ack_due_) {
    SendAck();
    return;
  }
  if (phase_ == Phase::kAwaiting) {
    return;  // an answer to what we sent in an opening
  }
  const bool may_leave_out = timers_[kOpen] != 0 && !left_out_;
  left_out_ = false;
  event_turn_ =
      kHasTags && event_turn_ && HasTagRequest() && (tag_bytes_ <= turn_bytes_ || may_leave_out);
  Begin(odometry);
  if (kHasTags && IsTag(asked_opcode_) && tx_size_ > turn_bytes_) {
    tag_bytes_ = tx_size_;
    event_turn_ = may_leave_out;
    if (may_leave_out) {
      // For the opening: who takes a turn awaits the answer until that is over, and on a full
      // channel a robot has a turn in every round. Never twice in succession.
      left_out_ = true;
      tx_size_ = 0;
      Contend();
      return;
    }
    Begin(odometry);
  }
  if (phase_ != Phase::kAwaiting) {
    return;
  }
  event_turn_ = false;
  too_long_ = tx_size_ > turn_bytes_;
  if (too_long_) {
    tx_size_ = 0;
    Contend();
    return;
  }
  in_turn_ = true;
  asked_index_ = turn_index_;
}

// No ROUND for long: the server may have been restarted, and does not know us then.
void Conversation::LeaveRounds() {
  if (in_turn_) {
    in_turn_ = false;
    Count(&Counters::timeouts);
    Contend();
  }
  turns_ = 0;
  if (in_rounds_) {
    in_rounds_ = false;
    SayHello();
    Contend();
  }
}

// Whether what we have to send may be sent in contention now.
bool Conversation::MayContend() const {
  if (timers_[kRounds] == 0) {
    return true;
  }
  if (timers_[kReserved] != 0 || timers_[kOpen] == 0) {
    return false;
  }
  const bool event = memory_->opcode == protocol::kEvent ||
                     (memory_->opcode == 0 && event_turn_ && state().events != 0) ||
                     (kHasTags && event_turn_ && HasTagRequest());
  return !HasTurns() || too_long_ || event;
}

}  // namespace client
}  // namespace pheromone
