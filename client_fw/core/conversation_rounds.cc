// Rounds: the server says whose turn it is, and answers a round with one frame (protocol/README.md,
// section 9). See conversation.cc for contention.
#include "client_fw/core/base/outlined.h"
#include "client_fw/core/conversation.h"

namespace pheromone {
namespace client {

void Conversation::OnRound(const uint8_t* data, uint8_t length) {
  Rounds* const rounds = medium_.rounds();
  if (!rounds->OnRound(data, length)) {
    return;
  }
  Count(&Counters::rounds);
  timers_[kPause] = 0;  // the server is there
  if (!HasTurns()) {
    HearServerOfOthers();
  }
  if (in_turn_) {
    in_turn_ = false;
    OnRoundAnswer(rounds->Follows(data) ? Rounds::AnswerIn(data, asked_index_) : nullptr);
  } else if (phase_ == Phase::kAwaiting && tx_size_ == 0) {
    OnMiss();  // the server answers before it begins a round
  }
  if (medium_.Grant(data)) {
    in_rounds_ = true;
    HearServer();
    timers_[kAckDue] = kRoundsMs;  // it has a turn
  }
}

// Null: there was none.
void Conversation::OnRoundAnswer(const uint8_t* answer) {
  const int16_t left =
      answer != nullptr ? protocol::GetI16(answer) : int16_t{protocol::kNoIntensities};
  if (left != protocol::kNoIntensities) {
    if (RequestPending()) {
      if (query_ == kNoQueryYet) {
        query_ = kNoQuery;  // the log is quick
      }
      memory_->opcode = 0;
    }
    too_long_ = false;
    OnSuccess();
    OnIntensities(answer);
    HearServer();
    Contend();  // for an EVENT, if there is one
    return;
  }
  const int16_t reason = answer != nullptr ? protocol::GetI16(answer + 2) : int16_t{0};
  if (reason != 0) {
    HearServer();
    OnRefusal(static_cast<protocol::Reason>(reason));
    return;
  }
  Count(&Counters::timeouts);
  if (!requests_.greeted) {
    WaitForHello();
  } else {
    if (query_ != kNoQuery && ChangePending()) {
      query_ = kQueryDue;
    }
    ++attempt_;
    attempt_ = attempt_ > kMaxRetries ? kMaxRetries : attempt_;
    Contend();
  }
}

void Conversation::CheckTurns(const Odometry* odometry) {
  if (medium_.rounds()->left_ms() == 0) {
    LeaveRounds();
  }
  if (medium_.rounds()->TurnDue(medium_.state().receiving) == Rounds::kDue) {
    TakeTurn(odometry);
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
  const uint8_t turn_bytes = medium_.rounds()->values().turn_bytes;
  const bool may_leave_out = medium_.rounds()->open() && !left_out_;
  left_out_ = false;
  // An EVENT for which no opening came: not in every round, as it costs us an answer.
  const bool may_tell =
      state().events != 0 && medium_.rounds()->values().number % protocol::kEventRounds == 0;
  if (!may_tell && (!kHasTags || !HasTagRequest() || (tag_bytes_ > turn_bytes && !may_leave_out))) {
    requests_.event_turn = false;
  }
  Begin(odometry);
  if (kHasTags && IsTag(asked_opcode_) && tx_size_ > turn_bytes) {
    tag_bytes_ = tx_size_;
    requests_.event_turn = may_leave_out;
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
  requests_.event_turn = false;
  too_long_ = tx_size_ > turn_bytes;
  if (too_long_) {
    tx_size_ = 0;
    Contend();
    return;
  }
  in_turn_ = true;
  asked_index_ = medium_.rounds()->values().turn;
}

// No ROUND for long: the server may have been restarted, and does not know us then. All other
// robots find that in the same moment.
void Conversation::LeaveRounds() {
  if (!in_rounds_) {
    return;
  }
  in_rounds_ = false;
  if (in_turn_) {
    in_turn_ = false;
    Count(&Counters::timeouts);
  }
  SayHello();
  Contend(MediumAccess::kBackOff);
}

// Whether what we have to send does not wait for a turn.
bool Conversation::IsUrgent() const {
  const bool event = memory_->opcode == protocol::kEvent ||
                     (memory_->opcode == 0 && requests_.event_turn && state().events != 0) ||
                     (kHasTags && requests_.event_turn && HasTagRequest());
  return !HasTurns() || too_long_ || event;
}

}  // namespace client
}  // namespace pheromone
