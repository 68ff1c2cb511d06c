// Time and the channel. The other parts are conversation_send.cc and conversation_receive.cc.
#include "client_fw/core/conversation.h"

#include "client_fw/core/base/outlined.h"
#include "client_fw/core/base/run_down.h"

namespace pheromone {
namespace client {
namespace {

// HELLO's back-off: 50, 100 ... 400 ms, and as much again at random.
constexpr uint8_t kHalfFirstHelloMs = 50;
constexpr uint8_t kLongestWindowMs = 255;  // that a server can announce
constexpr uint8_t kHelloDoublings = 3;
constexpr uint8_t kSeldomHelloDoublings = 7;
constexpr uint8_t kSilentSlots = 200;       // without the server are too many for a crowd's noise
constexpr uint16_t kTurnPatienceMs = 8000;  // without a turn the server has forgotten us
constexpr uint16_t kSessionPatienceMs = 8000;  // without a signed frame, too
constexpr uint16_t kLongestStepMs = 0x7FFF;

// After a warm reset the memory goes on; otherwise it begins here.
RequestMemory* Continue(const Parameters& parameters, RequestMemory* memory) {
  if (!memory->in_use || memory->nonce != parameters.boot_counter || memory->length > kMaxPending ||
      memory->tag_length > kMaxTagRequest) {
    static_cast<RequestValues&>(*memory) = RequestValues();
    memory->in_use = true;
    memory->nonce = parameters.boot_counter;
    memory->start = parameters.start;
  }
  Seal(memory);
  return memory;
}

}  // namespace

Conversation::Conversation(const Parameters& parameters, RequestMemory* memory)
    : ConversationState(),
      LinkSigning(parameters.key),
      medium_(parameters),
      behaviour_(parameters, Continue(parameters, memory)),
      memory_(memory) {
  phase_ = Phase::kContending;
}

// Advances the timers.
void Conversation::Advance(Moment now_ms) {
  const Moment passed_ms = now_ms - now_ms_;
  now_ms_ = now_ms;
  const uint16_t elapsed_ms =
      passed_ms < kLongestStepMs ? static_cast<uint16_t>(passed_ms) : kLongestStepMs;
  RunDown(timers_, kTimers, elapsed_ms);
  behaviour_.Advance(elapsed_ms);
  medium_.Advance(elapsed_ms);
}

PHEROMONE_OUTLINED void Conversation::Poll(Moment now_ms, const Odometry* odometry,
                                           bool channel_busy) {
  Advance(now_ms);
  if (odometry != nullptr && !behaviour_.Locate(*odometry)) {
    odometry = nullptr;
  }
  if (phase_ == Phase::kAwaiting && !in_turn_ && tx_size_ == 0 && timers_[kWindow] == 0 &&
      medium_.Silent()) {
    OnMiss();
  }
  behaviour_.Check();
  CheckSilence();
  medium_.Poll(channel_busy);
  if (is_signed() && signing()->Derive()) {
    return;  // so that keys take no more than a moment of each pass
  }
  if (tx_size_ == 0) {
    CheckTurns(odometry);
  }
  if (phase_ == Phase::kAwaiting || tx_size_ != 0) {
    return;
  }
  // A ROUND may follow the COMMAND, with a turn for its ACK.
  if (ack_due_ && medium_.state().pause && medium_.rounds()->values().turns == 0 &&
      !medium_.reserved()) {
    SendAck();
    return;
  }
  if (phase_ == Phase::kResting && timers_[kPeriod] <= EarlyMs() && !HasTurns()) {
    // What was random is in the moment at which the period began. With only one other robot, nobody
    // else waits for that to finish.
    const bool next = IsBuffered() && medium_.at_most_one_other();
    Contend(next ? MediumAccess::kFirst : MediumAccess::kAtOnce);
  }
  if (phase_ == Phase::kContending && timers_[kPause] == 0 && medium_.MayBegin(IsUrgent())) {
    Begin(odometry);
  }
}

void Conversation::OnSent(Moment now_ms) {
  Advance(now_ms);
  tx_size_ = 0;
  medium_.OnSent();
  // A HELLO that stays unanswered may be that of a server with slow modems.
  const bool patient = !requests_.greeted && hello_attempt_ != 0;
  const uint8_t window_ms = patient ? kLongestWindowMs : medium_.state().window_ms;
  const uint8_t adapter_ms = kHasAdapters ? parameters().adapter_ms : uint8_t{0};
  timers_[kWindow] = static_cast<uint16_t>(window_ms + 1u + adapter_ms);
}

void Conversation::CheckSilence() {
  if (requests_.greeted && phase_ != Phase::kAwaiting && timers_[kContacted] == 0 && HasTurns()) {
    GiveUp();
  }
  if (ack_due_ && timers_[kAckDue] == 0) {
    ack_due_ = false;  // the server has stopped waiting, and will repeat the command
    Count(&Counters::dropped_acks);
  }
}

void Conversation::OnMiss() {
  Count(&Counters::timeouts);
  // Where others are heard, the window holds all that may be late, and a PING takes a request's
  // place.
  resync_ = parameters().buffered_link && !(kHasAdapters && medium_.state().census.robots() != 0);
  if (!IsBuffered() || !RequestPending()) {
    medium_.OnOutcome(MediumAccess::kMissed);  // otherwise the query that follows tells
  }
  if (asked_opcode_ == protocol::kHello) {
    WaitForHello();
  } else {
    Retry();
  }
}

// Backs off, or abandons this period.
void Conversation::Retry() {
  if (IsTag(asked_opcode_) && timers_[kPeriod] == 0) {
    requests_.event_turn = false;
  }
  if (attempt_ == kMaxRetries) {
    Count(&Counters::abandoned);
    medium_.OnOutcome(MediumAccess::kAbandoned);
    GiveUp();
  } else {
    // Air loses answers, so there the change is repeated once before it counts as waiting; a
    // buffered link does not, and a modem behind one would have too little time for both.
    if (ChangePending() && (attempt_ != 0 || query_ == kQueryMade || IsBuffered())) {
      query_ = kQueryDue;
    }
    ++attempt_;
    const bool follows = IsBuffered() && ChangePending();
    Contend(follows ? MediumAccess::kFirst : MediumAccess::kBackOff);
  }
}

PHEROMONE_OUTLINED void Conversation::SayHello() {
  Greet(false);
  hello_attempt_ = 0;
  attempt_ = 0;
  if (kHasSigning) {
    signing()->GreetAnew();
  }
}

void Conversation::WaitForHello() {
  const bool seldom = is_signed() && SavesHellos();
  const uint8_t doublings = seldom ? uint8_t{kSeldomHelloDoublings} : hello_attempt_;
  if (hello_attempt_ < kHelloDoublings) {
    ++hello_attempt_;
  }
  // The server is there, and opens the channel now and then.
  if (medium_.rounds()->left_ms() != 0 && !seldom) {
    Contend(MediumAccess::kBackOff);
    return;
  }
  timers_[kPause] =
      static_cast<uint16_t>((kHalfFirstHelloMs + medium_.Draw(kHalfFirstHelloMs)) << doublings);
  Contend(MediumAccess::kAtOnce);
}

// Nothing was answered, no turn came, or there was nothing to ask. Only then is a silent server
// taken for one that is not there: in bad air it is not heard for longer, and HELLO and its answer
// arrive more seldom than any request.
void Conversation::GiveUp() {
  if (timers_[kContacted] == 0) {
    behaviour_.OnSilence();
    GreetAgain();
  } else {
    Rest();
  }
}

// Waits for the next period. If it has already begun, a random delay lets others go first.
void Conversation::Rest() {
  attempt_ = 0;
  requests_.event_turn = false;
  phase_ = Phase::kResting;
  if (timers_[kPeriod] == 0 && !HasTurns()) {
    Count(&Counters::late_periods);
    Contend();
  }
}

// Long enough for every robot heard. If this is more than fail_safe_ms, robots drive for a part of
// each period; with less, all would collide and hardly drive at all.
uint16_t Conversation::NeededMs() const {
  const uint8_t added = is_signed() ? uint8_t{2 * protocol::kSignature} : uint8_t{0};
  const uint32_t all_ms = ContentionPeriodMs(medium_.state(), parameters().baud, added);
  return all_ms < kLongestStepMs ? static_cast<uint16_t>(all_ms) : kLongestStepMs;
}

bool Conversation::congested() const {
  return medium_.state().census.robots() != 0 && parameters().period_ms > 1 &&
         NeededMs() > parameters().period_ms;
}

// There may be no opening when the period is over.
uint16_t Conversation::EarlyMs() const {
  return medium_.rounds().OpenSlots() != 0 && !medium_.reserved()
             ? static_cast<uint16_t>(parameters().period_ms / 4)
             : uint16_t{0};
}

uint16_t Conversation::PeriodMs() {
  if (congested() && medium_.rounds()->left_ms() == 0) {
    Count(&Counters::stretched_periods);
    return NeededMs();
  }
  return parameters().period_ms;
}

PHEROMONE_OUTLINED void Conversation::Contend(MediumAccess::Delay delay) {
  phase_ = Phase::kContending;
  medium_.Contend(delay);
}

PHEROMONE_OUTLINED void Conversation::Greet(bool greeted) {
  requests_.greeted = greeted;
  medium_.Tune(server_[kSlotAt], greeted ? server_[kWindowAt] : uint8_t{0});
}

PHEROMONE_OUTLINED void Conversation::OnSuccess() {
  attempt_ = 0;
  medium_.OnOutcome(MediumAccess::kAnswered);
}

void Conversation::HearServer() {
  const uint16_t patience_ms = static_cast<uint16_t>(kSilentSlots * medium_.state().slot_ms);
  timers_[kContacted] = HasTurns()                                ? kTurnPatienceMs
                        : patience_ms > parameters().fail_safe_ms ? patience_ms
                                                                  : parameters().fail_safe_ms;
  if (kHasSigning) {
    timers_[kSpokenTo] = kSessionPatienceMs;
  }
}

}  // namespace client
}  // namespace pheromone
