// Time and the channel. The other parts are conversation_send.cc and conversation_receive.cc.
#include "client_fw/core/conversation.h"

#include "client_fw/core/base/outlined.h"
#include "client_fw/core/base/run_down.h"

namespace pheromone {
namespace client {
namespace {

constexpr uint8_t kDefaultSlotMs = 20;  // of a slow modem, before HELLO's answer tells it
// HELLO's back-off: 50, 100 ... 400 ms, and as much again at random.
constexpr uint8_t kHalfFirstHelloMs = 50;
constexpr uint8_t kLongestWindowMs = 255;  // that a server can announce
constexpr uint8_t kHelloDoublings = 3;
constexpr uint16_t kAloneMs = 1000;       // nobody else about for so long: no random delay
constexpr uint8_t kAttemptsAPause = 64;   // of a robot that is alone, on the average
constexpr uint8_t kStalledFrameMs = 200;  // an open frame does not hold us up for longer
constexpr uint8_t kByteGraceMs = 5;       // a lone DLE is not yet a frame, but its first byte
constexpr uint16_t kMaxCarrierMs = 2000;  // and the longest frame: more than a round of all robots
constexpr uint8_t kSilentSlots = 64;      // without the server are too many for a crowd's noise
constexpr uint16_t kTurnPatienceMs = 3000;  // without a turn the server has forgotten us
constexpr uint16_t kLongestStepMs = 0x7FFF;

PHEROMONE_OUTLINED uint16_t Sum(uint16_t a, uint16_t b) {
  return b < UINT16_MAX - a ? static_cast<uint16_t>(a + b) : UINT16_MAX;
}

// After a warm reset the memory goes on; otherwise it begins here.
RequestMemory* Continue(const Parameters& parameters, RequestMemory* memory) {
  if (!memory->in_use || memory->nonce != parameters.boot_counter || memory->length > kMaxPending ||
      memory->tag_length > kMaxTagRequest) {
    *memory = RequestMemory();
    memory->in_use = true;
    memory->nonce = parameters.boot_counter;
    memory->start = parameters.start;
  }
  return memory;
}

}  // namespace

Conversation::Conversation(const Parameters& parameters, RequestMemory* memory)
    : ConversationState(),
      behaviour_(parameters, Continue(parameters, memory)),
      memory_(memory),
      random_(parameters.id, parameters.boot_counter) {
  three_bytes_ms_ = static_cast<uint8_t>(BytesMs(3));
  longest_frame_ms_ = static_cast<uint16_t>(BytesMs(protocol::kMaxFrame) +
                                            (parameters.gap_timeout_ms == protocol::kNoGapTimeout
                                                 ? kStalledFrameMs
                                                 : parameters.gap_timeout_ms));
  phase_ = Phase::kContending;
  ForgetCarrier();
  HearOther();  // we have not listened: others may be about
}

// Advances the timers.
void Conversation::Advance(uint32_t now_ms) {
  const uint32_t passed_ms = static_cast<uint32_t>(now_ms - now_ms_);
  now_ms_ = now_ms;
  const uint16_t elapsed_ms =
      passed_ms < kLongestStepMs ? static_cast<uint16_t>(passed_ms) : kLongestStepMs;
  RunDown(timers_, kTimers, elapsed_ms);
  behaviour_.Advance(elapsed_ms);
  quiet_ms_ = Sum(quiet_ms_, elapsed_ms);
  if (elapsed_ms >= kAloneMs) {  // a pause: we have not listened
    HearOther();
    ForgetCarrier();
  }
}

void Conversation::Poll(uint32_t now_ms, const Odometry* odometry, bool channel_busy) {
  Advance(now_ms);
  if (odometry != nullptr && !behaviour_.Locate(*odometry)) {
    odometry = nullptr;
  }
  const bool open = FrameOpen();
  if (phase_ == Phase::kAwaiting && !in_turn_ && tx_size_ == 0 && timers_[kWindow] == 0 && !open &&
      (quiet_ms_ > kByteGraceMs || Noisy())) {
    OnMiss();
  }
  behaviour_.Check();
  CheckSilence();
  if (timers_[kCensus] == 0) {
    timers_[kCensus] = kCensusMs;
    census_.Begin();
  }
  const bool slot_begins = timers_[kSlot] == 0;
  if (slot_begins) {
    timers_[kSlot] = SlotMs();
    idle_ = true;
  }
  const bool carrier = DetectCarrier(channel_busy);
  const bool clear = !open && !carrier;
  if (tx_size_ == 0) {
    CheckTurns(odometry, clear);
  }
  if (phase_ == Phase::kAwaiting || tx_size_ != 0) {
    return;
  }
  // A ROUND may follow the COMMAND, with a turn for its ACK.
  const bool ends = timers_[kRounds] == 0 || quiet_ms_ >= three_bytes_ms_;
  if (ack_due_ && clear && ends && turns_ == 0 && timers_[kReserved] == 0) {
    SendAck();
    return;
  }
  if (phase_ == Phase::kResting && timers_[kPeriod] == 0 && !HasTurns()) {
    ContendFor(0);  // what was random is in the moment at which the period began
  }
  if (phase_ == Phase::kResting || timers_[kPause] != 0) {
    return;
  }
  const bool alone = timers_[kOthers] == 0;
  if (!clear || timers_[kHeld] != 0 || (!alone && !idle_) || !MayContend()) {
    if (countdown_ == 0) {
      countdown_ = static_cast<uint8_t>(1 + RandomSlots());  // not all at once after it
    }
  } else if (countdown_ == 0 ? slot_begins || alone : slot_begins && --countdown_ == 0) {
    Begin(odometry);
  }
}

// A station sends for as long as its frame lasts. What stays on for longer than any sequence of
// frames is a fault, and as long as it stays, only bytes tell whether somebody sends.
bool Conversation::DetectCarrier(bool channel_busy) {
  if (!channel_busy) {
    ForgetCarrier();
  } else if (timers_[kCarrier] == 0 && !carrier_ignored_) {
    carrier_ignored_ = true;
    Count(&Counters::ignored_carriers);
  }
  return channel_busy && !carrier_ignored_;
}

PHEROMONE_OUTLINED void Conversation::ForgetCarrier() {
  carrier_ignored_ = false;
  timers_[kCarrier] = static_cast<uint16_t>(kMaxCarrierMs + longest_frame_ms_);
}

// A byte inside a frame holds the channel until the longest frame would have ended. So does one
// outside, which may belong to a frame whose beginning was missed; a run of these that goes on is
// noise until there is silence for the idle time. The time spent in frames begins again with each
// valid one: traffic may be as dense as it likes.
void Conversation::Listen(bool was_open, protocol::FrameParser::Result event) {
  const uint16_t silence_ms = quiet_ms_;
  quiet_ms_ = 0;
  uint16_t* spent_ms = &stray_ms_;
  if (was_open || parser_.open()) {
    spent_ms = &framed_ms_;
  } else if (event == protocol::FrameParser::kNothing) {  // a DLE, perhaps of a frame's beginning
    if (!Noisy()) {
      RestartSlots();
    }
    return;
  }
  const bool held = *spent_ms <= longest_frame_ms_;
  *spent_ms = event == protocol::FrameParser::kFrame ? uint16_t{0} : Sum(*spent_ms, silence_ms);
  if (*spent_ms <= longest_frame_ms_) {
    RestartSlots();
  } else if (held) {
    Count(&Counters::ignored_noise);
  }
}

PHEROMONE_OUTLINED bool Conversation::Noisy() const {
  return stray_ms_ > longest_frame_ms_ || framed_ms_ > longest_frame_ms_;
}

void Conversation::EndRun() {
  if (quiet_ms_ >= IdleMs() && !parser_.open()) {
    stray_ms_ = 0;
    framed_ms_ = 0;
    quiet_ms_ = 0;
  }
}

// The first slot after a byte begins with the end of the idle time, which is the same for all
// stations, including the sender of the byte: transmissions begin at the start of a slot, and
// others detect them before the next slot.
void Conversation::RestartSlots() {
  idle_ = false;
  timers_[kSlot] = IdleMs();
}

void Conversation::OnSent(uint32_t now_ms) {
  Advance(now_ms);
  tx_size_ = 0;
  quiet_ms_ = 0;
  RestartSlots();
  // A HELLO that stays unanswered may be that of a server with slow modems.
  const bool patient = !greeted_ && hello_attempt_ != 0;
  timers_[kWindow] = static_cast<uint16_t>((patient ? kLongestWindowMs : WindowMs()) + 1);
}

PHEROMONE_OUTLINED void Conversation::CheckSilence() {
  if (greeted_ && phase_ != Phase::kAwaiting && timers_[kContacted] == 0) {
    behaviour_.OnSilence();
    SayHello();
    Contend();
  }
  if (ack_due_ && timers_[kAckDue] == 0) {
    ack_due_ = false;  // the server has stopped waiting, and will repeat the command
    Count(&Counters::dropped_acks);
  }
}

// Another station is in the middle of a frame. One that stalls or takes too long is not waited for;
// without a gap timeout, it may still continue.
bool Conversation::FrameOpen() {
  if (parameters().gap_timeout_ms != protocol::kNoGapTimeout) {
    if (quiet_ms_ > parameters().gap_timeout_ms) {
      protocol::TimeOut(&parser_, &decoder_counters_);
    }
  } else if (quiet_ms_ > kStalledFrameMs) {
    return false;
  }
  return parser_.open() && Sum(framed_ms_, quiet_ms_) <= longest_frame_ms_;
}

void Conversation::OnMiss() {
  Count(&Counters::timeouts);
  resync_ = parameters().buffered_link;
  HearOther();  // it may be one that we did not hear, because it began when we did
  window_.OnMiss(census_.robots());
  if (asked_opcode_ == protocol::kHello) {
    WaitForHello();
  } else {
    Retry();
  }
}

// Backs off, or abandons this period.
void Conversation::Retry() {
  if (IsTag(asked_opcode_) && timers_[kPeriod] == 0) {
    event_turn_ = false;
  }
  if (attempt_ == kMaxRetries) {
    Count(&Counters::abandoned);
    window_ = ContentionWindow();
    Rest();
  } else {
    ++attempt_;
    ContendFor(RandomSlots());
  }
}

PHEROMONE_OUTLINED void Conversation::SayHello() {
  greeted_ = false;
  hello_attempt_ = 0;
  attempt_ = 0;
}

void Conversation::WaitForHello() {
  const uint8_t doublings = hello_attempt_;
  if (hello_attempt_ < kHelloDoublings) {
    ++hello_attempt_;
  }
  if (timers_[kRounds] != 0) {  // the server is there, and opens the channel now and then
    ContendFor(RandomSlots());
    return;
  }
  timers_[kPause] =
      static_cast<uint16_t>((kHalfFirstHelloMs + random_.Below(kHalfFirstHelloMs)) << doublings);
  ContendFor(0);
}

// Waits for the next period. If it has already begun, a random delay lets others go first.
void Conversation::Rest() {
  attempt_ = 0;
  event_turn_ = false;
  phase_ = Phase::kResting;
  if (timers_[kPeriod] == 0 && !HasTurns()) {
    Count(&Counters::late_periods);
    Contend();
  }
}

// On the radio.
PHEROMONE_OUTLINED uint16_t Conversation::BytesMs(uint8_t bytes) const {
  return client::BytesMs(bytes, parameters().baud);
}

// Long enough for one exchange of every robot heard: 26 bytes, the turnarounds and the server's
// delay, and two slots in which to find an order. If this is more than fail_safe_ms, robots
// drive for a part of each period; with less, all would collide and hardly drive at all.
uint16_t Conversation::NeededMs() const {
  const uint32_t each_ms = BytesMs(26) + WindowMs() + 2u * SlotMs();
  const uint32_t all_ms = (census_.robots() + 1u) * each_ms - 2u * SlotMs();
  return all_ms < kLongestStepMs ? static_cast<uint16_t>(all_ms) : kLongestStepMs;
}

bool Conversation::congested() const {
  return census_.robots() != 0 && parameters().period_ms > 1 && NeededMs() > parameters().period_ms;
}

uint16_t Conversation::PeriodMs() {
  if (congested() && !HasTurns()) {
    Count(&Counters::stretched_periods);
    return NeededMs();
  }
  return parameters().period_ms;
}

// A robot that sends without a pause hears no other robot and assumes that it is alone. So it
// occasionally listens for as long as a newcomer may need.
void Conversation::Contend() {
  uint8_t slots = 0;
  if (timers_[kOthers] != 0) {
    slots = RandomSlots();
  } else if (random_.Below(kAttemptsAPause) == 0) {
    slots = kMinWindow;
  }
  ContendFor(slots);
}

PHEROMONE_OUTLINED void Conversation::ContendFor(uint8_t slots) {
  phase_ = Phase::kContending;
  countdown_ = slots;
  DrawInOpening();
}

void Conversation::OnSuccess() {
  attempt_ = 0;
  window_.OnSuccess();
}

uint8_t Conversation::SlotMs() const {
  if (server_[kSlotAt] != 0) {
    return server_[kSlotAt];
  }
  return round_slot_ms_ != 0 ? round_slot_ms_ : kDefaultSlotMs;
}

uint8_t Conversation::WindowMs() const {
  return greeted_ && server_[kWindowAt] != 0 ? server_[kWindowAt] : parameters().first_window_ms;
}

// Another station's answer is due. Its window begins when its last byte left its UART, a turnaround
// before we heard it; the slot tells how long that is, but for a byte where there is no carrier
// detect.
void Conversation::Hold() {
  const uint16_t byte_ms = static_cast<uint16_t>(BytesMs(1) + 1u);
  const uint16_t turnaround_ms = static_cast<uint16_t>(SlotMs() > byte_ms ? SlotMs() - byte_ms : 0);
  const uint16_t window_ms = WindowMs();
  timers_[kHeld] =
      static_cast<uint16_t>((window_ms > turnaround_ms ? window_ms - turnaround_ms : 0) + 1);
}

PHEROMONE_OUTLINED void Conversation::Count(uint32_t Counters::*which) {
  ++(counters_.*which);
}

PHEROMONE_OUTLINED void Conversation::HearOther() {
  timers_[kOthers] = kAloneMs;
}

void Conversation::HearServer() {
  const uint16_t patience_ms = static_cast<uint16_t>(kSilentSlots * SlotMs());
  timers_[kContacted] = HasTurns()                                ? kTurnPatienceMs
                        : patience_ms > parameters().fail_safe_ms ? patience_ms
                                                                  : parameters().fail_safe_ms;
}

}  // namespace client
}  // namespace pheromone
