#include "client_fw/core/medium/medium_access.h"

#include "client_fw/core/base/outlined.h"
#include "protocol/fields.h"
#include "protocol/messages.h"
#include "protocol/opcodes.h"
#include "protocol/signing.h"

namespace pheromone {
namespace client {
namespace {

using protocol::FrameParser;

constexpr uint8_t kDefaultSlotMs = 20;    // of a slow modem, before HELLO's answer tells it
constexpr uint8_t kAttemptsAPause = 64;   // of a robot that is alone, on the average
constexpr uint8_t kStalledFrameMs = 200;  // an open frame does not hold us up for longer
constexpr uint8_t kByteGraceMs = 5;       // a lone DLE is not yet a frame, but its first byte
constexpr uint16_t kMaxCarrierMs = 2000;  // and the longest frame: more than a round of all robots
constexpr uint8_t kMaxDamaged = 8;  // frames more than valid ones: no traffic, even with collisions

PHEROMONE_OUTLINED uint16_t Sum(uint16_t a, uint16_t b) {
  return b < UINT16_MAX - a ? static_cast<uint16_t>(a + b) : UINT16_MAX;
}

// The bytes of an answer to HELLO, of any robot, and where it tells the slot.
constexpr uint8_t kHelloAnswerSize = 4 + protocol::SizeOf<protocol::HelloAnswer>().least;
constexpr uint8_t kHelloSlotAt = 2 + protocol::OffsetOf(&protocol::HelloAnswer::slot_ms);

bool TellsSlot(uint8_t answer_size) {
  return answer_size == kHelloAnswerSize ||
         (protocol::kHasSigning && answer_size == kHelloAnswerSize + protocol::kSignature);
}

// Whether the server answers this client's request, so that the channel is not free yet.
bool OpensWindow(uint8_t opcode) {
  return opcode < 0x50 || opcode == protocol::kEvent || opcode == protocol::kHello ||
         opcode == protocol::kPing ||
         (opcode > protocol::kTraceWide && opcode <= protocol::kTraceWide + protocol::kMaxType);
}

}  // namespace

MediumAccess::MediumAccess(const Parameters& parameters)
    : MediumVariables(),
      id_(parameters.id),
      gap_timeout_ms_(parameters.gap_timeout_ms),
      first_window_ms_(parameters.first_window_ms),
      adapter_ms_(parameters.adapter_ms),
      byte_ms_(static_cast<uint8_t>(BytesMs(1, parameters.baud))),
      three_bytes_ms_(static_cast<uint8_t>(BytesMs(3, parameters.baud))),
      longest_frame_ms_(static_cast<uint16_t>(
          BytesMs(protocol::kMaxFrame, parameters.baud) +
          (gap_timeout_ms_ == protocol::kNoGapTimeout ? kStalledFrameMs : gap_timeout_ms_))),
      random_(parameters.id, parameters.boot_counter),
      rounds_(parameters.id, three_bytes_ms_),
      state_() {
  Tune(0, 0);
  ForgetCarrier();
  HearOther();  // we have not listened: others may be about
}

void MediumAccess::Advance(uint16_t elapsed_ms) {
  RunDown(timers_, kTimers, elapsed_ms);
  rounds_.Advance(elapsed_ms);
  quiet_ms_ = Sum(quiet_ms_, elapsed_ms);
  if (elapsed_ms >= kAloneMs) {  // a pause: we have not listened
    HearOther();
    ForgetCarrier();
  }
}

FrameParser::Result MediumAccess::Hear(uint8_t byte, bool awaiting) {
  FrameOpen();  // a gap ends it
  EndRun();
  const bool was_open = state_.parser.open();
  const FrameParser::Result event = state_.parser.Push(byte);
  if (kAllCounters) {
    protocol::Tally(event, &state_.decoder);
  } else if (event == FrameParser::kCrcError) {
    ++state_.decoder.crc_errors;
  }
  Listen(was_open, event);
  if (!awaiting) {
    HearOther();
  }
  if (rounds_.reserved_ms() == 0) {
    rounds_.KeepOpen(state_.window_ms, state_.slot_ms);
  }
  if (event == FrameParser::kFrame) {
    OnFrame();
  } else if (event == FrameParser::kCrcError) {
    OnDamage();
  }
  return event;
}

// It may have been a request that the server understood. But where most of what is heard is
// damaged, it is rubbish, and the windows would never end.
void MediumAccess::OnDamage() {
  if (damaged_ == kMaxDamaged) {
    state_.counters.ignored_damage += kAllCounters;
    return;
  }
  ++damaged_;
  Hold();
}

void MediumAccess::OnFrame() {
  const uint8_t id = state_.parser.body()[0];
  const uint8_t opcode = state_.parser.body()[1];
  const bool from_server = protocol::IsFromServer(opcode);
  if (damaged_ != 0) {
    --damaged_;
  }
  if (from_server) {
    // It ends an exchange: no station has priority, except for a COMMAND that follows at once.
    timers_[kSlot] = static_cast<uint16_t>((three_bytes_ms_ + 1u) / 2);
    rounds_.KeepOpen(0, state_.slot_ms);
  }
  if (id != id_ || from_server) {
    timers_[kHeld] = 0;
  }
  if (id == id_) {
    return;
  }
  HearOther();
  if (id == protocol::kBroadcastId &&
      (opcode == protocol::kRound || opcode == protocol::kCommand)) {
    return;
  }
  state_.census.Hear(id);
  // Among others who know the slot, one that does not would hardly ever get to say HELLO.
  if (opcode == protocol::kHelloAnswer && TellsSlot(state_.parser.size())) {
    rounds_.TellSlot(state_.parser.body()[kHelloSlotAt]);
    ChooseSlotMs();
  }
  if (!from_server) {
    rounds_.OnFrameOf(id);
  }
  if (rounds_.reserved_ms() == 0 && (opcode == protocol::kCommand || OpensWindow(opcode))) {
    Hold();
  }
}

// A byte inside a frame holds the channel until the longest frame would have ended. So does one
// outside, which may belong to a frame whose beginning was missed; a run of these that goes on is
// noise until there is silence for the idle time. The time spent in frames begins again with each
// valid one: traffic may be as dense as it likes.
void MediumAccess::Listen(bool was_open, FrameParser::Result event) {
  const uint16_t silence_ms = quiet_ms_;
  quiet_ms_ = 0;
  uint16_t* spent_ms = &stray_ms_;
  if (was_open || state_.parser.open()) {
    spent_ms = &framed_ms_;
  } else if (event == FrameParser::kNothing) {  // a DLE, perhaps of a frame's beginning
    if (!Noisy()) {
      RestartSlots();
    }
    return;
  }
  const bool held = *spent_ms <= longest_frame_ms_;
  *spent_ms = event == FrameParser::kFrame ? uint16_t{0} : Sum(*spent_ms, silence_ms);
  if (*spent_ms <= longest_frame_ms_) {
    RestartSlots();
  } else if (held) {
    state_.counters.ignored_noise += kAllCounters;
  }
}

PHEROMONE_OUTLINED bool MediumAccess::Noisy() const {
  return stray_ms_ > longest_frame_ms_ || framed_ms_ > longest_frame_ms_;
}

PHEROMONE_BY_POINTER void MediumAccess::EndRun() {
  if (quiet_ms_ >= IdleMs() && !state_.parser.open()) {
    stray_ms_ = 0;
    framed_ms_ = 0;
    quiet_ms_ = 0;
  }
}

// Another station is in the middle of a frame. One that stalls or takes too long is not waited for;
// without a gap timeout, it may still continue.
bool MediumAccess::FrameOpen() {
  if (gap_timeout_ms_ != protocol::kNoGapTimeout) {
    if (quiet_ms_ > gap_timeout_ms_) {
      if (kAllCounters) {
        protocol::TimeOut(&state_.parser, &state_.decoder);
      } else {
        state_.parser.Abort();
      }
    }
  } else if (quiet_ms_ > kStalledFrameMs) {
    return false;
  }
  return state_.parser.open() && Sum(framed_ms_, quiet_ms_) <= longest_frame_ms_;
}

bool MediumAccess::Silent() {
  return !FrameOpen() && (quiet_ms_ > kByteGraceMs || Noisy());
}

PHEROMONE_BY_POINTER void MediumAccess::Poll(bool channel_busy) {
  state_.receiving = FrameOpen();
  if (timers_[kCensus] == 0) {
    timers_[kCensus] = kCensusMs;
    state_.census.Begin();
  }
  slot_begins_ = timers_[kSlot] == 0;
  if (slot_begins_) {
    timers_[kSlot] = state_.slot_ms;
    idle_ = true;
  }
  state_.clear = !DetectCarrier(channel_busy) && !state_.receiving;
  state_.pause = state_.clear && (rounds_.left_ms() == 0 || quiet_ms_ >= three_bytes_ms_);
}

// A station sends for as long as its frame lasts. What stays on for longer than any sequence of
// frames is a fault, and as long as it stays, only bytes tell whether somebody sends.
bool MediumAccess::DetectCarrier(bool channel_busy) {
  if (!channel_busy) {
    ForgetCarrier();
  } else if (timers_[kCarrier] == 0 && !carrier_ignored_) {
    carrier_ignored_ = true;
    state_.counters.ignored_carriers += kAllCounters;
  }
  return channel_busy && !carrier_ignored_;
}

PHEROMONE_OUTLINED void MediumAccess::ForgetCarrier() {
  carrier_ignored_ = false;
  timers_[kCarrier] = static_cast<uint16_t>(kMaxCarrierMs + longest_frame_ms_);
}

// The first slot after a byte begins with the end of the idle time, which is the same for all
// stations, including the sender of the byte: transmissions begin at the start of a slot, and
// others detect them before the next slot.
PHEROMONE_OUTLINED void MediumAccess::RestartSlots() {
  idle_ = false;
  timers_[kSlot] = IdleMs();
}

void MediumAccess::OnSent() {
  quiet_ms_ = 0;
  RestartSlots();
}

// A robot that sends without a pause hears no other robot and assumes that it is alone. So it
// occasionally listens for as long as a newcomer may need.
void MediumAccess::Contend(Delay delay) {
  countdown_ = 0;
  if (delay == kBackOff || (delay == kRandom && timers_[kOthers] != 0)) {
    countdown_ = RandomSlots();
  } else if (delay == kRandom && random_.Below(kAttemptsAPause) == 0) {
    countdown_ = kMinWindow;
  } else if (kHasAdapters && delay == kFirst) {
    countdown_ = 1;
  }
  DrawInOpening();
}

PHEROMONE_OUTLINED void MediumAccess::DrawInOpening() {
  const uint8_t slots = rounds_.OpenSlots();
  if (slots != 0) {
    countdown_ = static_cast<uint8_t>(1 + random_.Below(slots));
  }
}

// Who hears others late, behind an adapter, cannot tell neighbouring slots apart; nor does it know
// when a slot begins, which is counted from a byte. It draws from those that are twice as far apart
// as it hears late, and from half of them with one other robot at most: they are long.
PHEROMONE_OUTLINED uint8_t MediumAccess::RandomSlots() {
  uint8_t slots = window_.slots();
  uint8_t apart = 1;
  if (kHasAdapters && adapter_ms_ != 0) {
    if (at_most_one_other()) {
      slots /= 2;
    }
    const uint16_t wanted =
        static_cast<uint16_t>(1u + (2u * adapter_ms_ + state_.slot_ms - 1u) / state_.slot_ms);
    const uint8_t most = static_cast<uint8_t>(UINT8_MAX / slots);
    apart = wanted < most ? static_cast<uint8_t>(wanted) : most;
  }
  return static_cast<uint8_t>(1 + apart * random_.Below(slots));
}

PHEROMONE_BY_POINTER bool MediumAccess::MayBegin(bool urgent) {
  const bool alone = timers_[kOthers] == 0;
  const bool granted = rounds_.left_ms() == 0 || (!reserved() && rounds_.open() && urgent);
  if (!state_.clear || timers_[kHeld] != 0 || (!alone && !idle_) || !granted) {
    if (countdown_ == 0) {
      countdown_ = static_cast<uint8_t>(1 + RandomSlots());  // not all at once after it
    }
    return false;
  }
  return countdown_ == 0 ? slot_begins_ || alone : slot_begins_ && --countdown_ == 0;
}

PHEROMONE_OUTLINED void MediumAccess::OnOutcome(Outcome outcome) {
  if (outcome == kAnswered) {
    window_.OnSuccess();
  } else if (outcome == kAbandoned) {
    window_ = ContentionWindow();
  } else {
    if (outcome == kMissed) {
      HearOther();  // it may be one that we did not hear, because it began when we did
    }
    window_.OnMiss(state_.census.robots());
  }
}

// Another station's answer is due. Its window begins when its last byte left its UART, a turnaround
// before we heard it; the slot tells how long that is, but for a byte where there is no carrier
// detect. Behind adapters, who asked waits for its own as well before it goes on, and we may have
// heard its request at once, and what follows late.
PHEROMONE_OUTLINED void MediumAccess::Hold() {
  const uint8_t byte_ms = static_cast<uint8_t>(byte_ms_ + 1u);
  const uint8_t turnaround_ms =
      state_.slot_ms > byte_ms ? static_cast<uint8_t>(state_.slot_ms - byte_ms) : uint8_t{0};
  timers_[kHeld] = static_cast<uint16_t>(
      (state_.window_ms > turnaround_ms ? state_.window_ms - turnaround_ms : 0) + 1 +
      3 * AdapterMs());
}

void MediumAccess::Tune(uint8_t slot_ms, uint8_t window_ms) {
  server_slot_ms_ = slot_ms;
  state_.window_ms = window_ms != 0 ? window_ms : first_window_ms_;
  ChooseSlotMs();
}

PHEROMONE_OUTLINED void MediumAccess::ChooseSlotMs() {
  const uint8_t told_ms = rounds_.values().slot_ms;
  state_.slot_ms = server_slot_ms_ != 0 ? server_slot_ms_ : told_ms != 0 ? told_ms : kDefaultSlotMs;
}

bool MediumAccess::Grant(const uint8_t* round) {
  const bool ours = rounds_.Grant(round, AdapterMs());
  ChooseSlotMs();
  rounds_.KeepOpen(rounds_.reserved_ms(), state_.slot_ms);
  DrawInOpening();
  return ours;
}

}  // namespace client
}  // namespace pheromone
