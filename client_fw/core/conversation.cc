// Time and the channel. The other parts are conversation_send.cc, conversation_receive.cc and
// conversation_act.cc.
#include "client_fw/core/conversation.h"

namespace pheromone {
namespace client {
namespace {

constexpr uint8_t kDefaultSlotMs = 5;  // before HELLO's answer tells it
constexpr uint8_t kHalfFirstHelloMs =
    50;                                   // HELLO's back-off: 50, 100 ... 800 ms, and as much again
constexpr uint8_t kHelloDoublings = 4;    // at random
constexpr uint16_t kAloneMs = 1000;       // nobody else heard for so long: no random delay
constexpr uint8_t kAttemptsAPause = 64;   // of a robot that is alone, on the average
constexpr uint8_t kStalledFrameMs = 200;  // an open frame does not hold us up for longer
constexpr uint8_t kByteGraceMs = 5;       // a lone DLE is not yet a frame, but its first byte
constexpr uint16_t kCensusMs = 1000;      // in which every robot in range is heard
constexpr uint16_t kLongestStepMs = 0x7FFF;

}  // namespace

Conversation::Conversation(const Parameters& parameters, RequestMemory* memory)
    : ConversationState(),
      memory_(memory),
      random_(parameters.id, parameters.boot_counter),
      fuzzy_(FuzzyState{kNoError}),
      parameters_(parameters),
      start_(parameters.start) {
  flags_ = kNoAnswerYet;
  phase_ = Phase::kContending;
  HearOther();  // we have not listened: others may be about
  if (memory->nonce != parameters.boot_counter || memory->length > kMaxPending) {
    *memory = RequestMemory();
    memory->nonce = parameters.boot_counter;
  }
}

// Lets the timers run; returns what has passed since the last call.
uint16_t Conversation::Advance(Milliseconds now_ms) {
  const Milliseconds passed_ms = static_cast<Milliseconds>(now_ms - now_ms_);
  now_ms_ = now_ms;
  const uint16_t elapsed_ms =
      passed_ms < kLongestStepMs ? static_cast<uint16_t>(passed_ms) : kLongestStepMs;
  for (uint16_t& timer : timers_) {
    timer = timer > elapsed_ms ? static_cast<uint16_t>(timer - elapsed_ms) : 0;
  }
  quiet_ms_ =
      elapsed_ms < 255u - quiet_ms_ ? static_cast<uint8_t>(quiet_ms_ + elapsed_ms) : UINT8_MAX;
  if (elapsed_ms >= kAloneMs) {
    HearOther();  // a pause: we have not listened
  }
  return elapsed_ms;
}

void Conversation::Poll(Milliseconds now_ms, const Odometry* odometry, bool channel_busy) {
  const uint16_t elapsed_ms = Advance(now_ms);
  const bool open = FrameOpen();
  if (phase_ == Phase::kAwaiting && tx_size_ == 0 && timers_[kWindow] == 0 && !open &&
      quiet_ms_ > kByteGraceMs) {
    OnMiss();
  }
  CheckSilence();
  if (timers_[kCensus] == 0) {
    TakeCensus();
  }
  if (phase_ == Phase::kAwaiting || tx_size_ != 0) {
    slot_left_ms_ = 0;
    return;
  }
  const bool clear = !open && !channel_busy;
  if (ack_due_ && clear) {
    ack_due_ = false;
    Count(&Counters::acks);
    Send(protocol::kCommandAck, ack_, sizeof(ack_));
    return;
  }
  if (phase_ == Phase::kResting && timers_[kPeriod] == 0) {
    ContendFor(0);  // what was random is in the moment at which the period began
  }
  const bool free =
      clear && timers_[kHeld] == 0 && (timers_[kOthers] == 0 || quiet_ms_ >= IdleMs());
  const bool slot_begins = SlotBegins(elapsed_ms, free);
  if (phase_ == Phase::kResting || timers_[kPause] != 0) {
    return;
  }
  if (!free && countdown_ == 0) {
    countdown_ = static_cast<uint8_t>(1 + RandomSlots());  // not all at once after it
  }
  if (!slot_begins) {
    return;
  }
  if (countdown_ > 1) {
    --countdown_;
    return;
  }
  Begin(odometry);
}

// Slots are counted from the moment when the channel became free, which all stations see at the
// same time: whoever begins, begins with a slot, and others have noticed before the next. What is
// due after a quiet of a whole window, or of a robot that is alone, need not wait for one.
bool Conversation::SlotBegins(uint16_t elapsed_ms, bool free) {
  if (!free) {
    slot_left_ms_ = 0;
    return false;
  }
  if (slot_left_ms_ > elapsed_ms) {
    slot_left_ms_ = static_cast<uint8_t>(slot_left_ms_ - elapsed_ms);
    return countdown_ == 0 && (timers_[kOthers] == 0 || quiet_ms_ / kMinWindow >= SlotMs());
  }
  slot_left_ms_ = SlotMs();
  return true;
}

void Conversation::OnSent(Milliseconds now_ms) {
  Advance(now_ms);
  tx_size_ = 0;
  quiet_ms_ = 0;
  timers_[kWindow] = static_cast<uint16_t>(WindowMs() + 1);
}

void Conversation::CheckSilence() {
  if (timers_[kAnswered] == 0 && (flags_ & kNoAnswerYet) == 0) {
    // Events of its own would not help a channel that is merely too full.
    Stop(kFailSafe, timers_[kContacted] == 0 ? BitOf(protocol::EventCode::kFailSafeStop) : 0);
  }
  if (greeted_ && phase_ != Phase::kAwaiting && timers_[kContacted] == 0) {
    SayHello();
    Contend();
  }
  if (ack_due_ && timers_[kAckDue] == 0) {
    ack_due_ = false;  // the server has stopped waiting, and will repeat the command
    Count(&Counters::dropped_acks);
  }
}

// Somebody is in the middle of a frame. Without a gap timeout, what stalls is not waited for, but
// may still go on.
bool Conversation::FrameOpen() {
  if (kHasBufferedLink && parameters_.gap_timeout_ms == protocol::kNoGapTimeout) {
    return parser_.open() && quiet_ms_ <= kStalledFrameMs;
  }
  if (quiet_ms_ > parameters_.gap_timeout_ms) {
    TimeOut(&parser_);
  }
  return parser_.open();
}

void Conversation::TakeCensus() {
  timers_[kCensus] = kCensusMs;
  robots_ = counted_;
  counted_ = 0;
  for (uint8_t& eight : seen_) {
    eight = 0;
  }
}

void Conversation::OnMiss() {
  Count(&Counters::timeouts);
  resync_ = kHasBufferedLink && parameters_.buffered_link;
  window_.OnMiss();
  if (asked_opcode_ == protocol::kHello) {
    WaitForHello();
  } else {
    Retry();
  }
}

// Back off, or give this period up.
void Conversation::Retry() {
  if (attempt_ == kMaxRetries) {
    Count(&Counters::abandoned);
    window_ = ContentionWindow();
    Rest();
  } else {
    ++attempt_;
    ContendFor(RandomSlots());
  }
}

void Conversation::SayHello() {
  greeted_ = false;
  hello_attempt_ = 0;
  attempt_ = 0;
}

void Conversation::WaitForHello() {
  timers_[kPause] = static_cast<uint16_t>((kHalfFirstHelloMs + random_.Below(kHalfFirstHelloMs))
                                          << hello_attempt_);
  if (hello_attempt_ < kHelloDoublings) {
    ++hello_attempt_;
  }
  ContendFor(0);
}

// Until the next period begins. If it has begun already, others come first, by chance.
void Conversation::Rest() {
  attempt_ = 0;
  event_turn_ = false;
  phase_ = Phase::kResting;
  if (timers_[kPeriod] == 0) {
    Count(&Counters::late_periods);
    Contend();
  }
}

// Long enough for one exchange of every robot about: 26 bytes, two turnarounds, and the more time
// for contention the more there are. But never so long that the fail-safe would stop the robot.
uint16_t Conversation::PeriodMs() {
  const uint16_t period_ms = parameters_.period_ms;
  if (period_ms <= 1) {
    return 0;
  }
  const uint16_t exchange_ms =
      static_cast<uint16_t>(9u * parameters_.three_bytes_ms + (2u + robots_ / 2u) * SlotMs());
  const uint16_t needed_ms = static_cast<uint16_t>((robots_ + 1u) * exchange_ms);
  congested_ = needed_ms > period_ms;
  if (!congested_) {
    return period_ms;
  }
  Count(&Counters::stretched_periods);
  const uint16_t most_ms =
      static_cast<uint16_t>(parameters_.fail_safe_ms - parameters_.fail_safe_ms / 8u);
  return needed_ms < most_ms ? needed_ms : most_ms;
}

// Who asks without a pause hears nobody and believes that it is alone. So now and then it listens
// for as long as a newcomer may need.
void Conversation::Contend() {
  uint8_t slots = 0;
  if (timers_[kOthers] != 0) {
    slots = RandomSlots();
  } else if (random_.Below(kAttemptsAPause) == 0) {
    slots = kMinWindow;
  }
  ContendFor(slots);
}

void Conversation::ContendFor(uint8_t slots) {
  phase_ = Phase::kContending;
  countdown_ = slots;
}

void Conversation::OnSuccess() {
  attempt_ = 0;
  window_.OnSuccess();
}

uint8_t Conversation::SlotMs() const {
  return server_[kSlotAt] != 0 ? server_[kSlotAt] : kDefaultSlotMs;
}

uint8_t Conversation::WindowMs() const {
  return greeted_ && server_[kWindowAt] != 0 ? server_[kWindowAt] : parameters_.first_window_ms;
}

void Conversation::HearOther() {
  timers_[kOthers] = kAloneMs;
}

}  // namespace client
}  // namespace pheromone
