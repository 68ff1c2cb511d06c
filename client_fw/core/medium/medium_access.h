// When a robot may send on a half-duplex channel that it shares (protocol/README.md, section 9): it
// hears every byte, tells a busy channel from a broken one, and finds a slot in contention or takes
// the turns of rounds. What is sent is not its matter.
//
//   medium.Advance(elapsed_ms);
//   if (medium.Hear(byte, awaiting) == FrameParser::kFrame) Use(medium.state().parser.body());
//   medium.Poll(channel_busy);                  // once in each round of the loop
//   medium.Contend(MediumAccess::kRandom);      // there is something to send
//   if (medium.MayBegin(true)) { medium.OnBegin(); ... send ...; medium.OnSent(); }
//   medium.OnOutcome(MediumAccess::kAnswered);
//
// Nothing is allocated; one loop.
#pragma once

#include <stdint.h>

#include "client_fw/core/base/outlined.h"
#include "client_fw/core/base/run_down.h"
#include "client_fw/core/medium/backoff.h"
#include "client_fw/core/medium/census.h"
#include "client_fw/core/medium/rounds.h"
#include "client_fw/core/steering/parameters.h"
#include "protocol/decoder.h"
#include "protocol/frame_parser.h"

namespace pheromone {
namespace client {

#ifndef PHEROMONE_ALL_COUNTERS
#define PHEROMONE_ALL_COUNTERS 1
#endif
/// False: of the conversation and the channel, only what an operator can ask for is counted
/// (Conversation::TellCounter).
constexpr bool kAllCounters = PHEROMONE_ALL_COUNTERS != 0;

/// All wrap.
struct MediumCounters {
  unsigned ignored_carriers;  ///< carriers that stayed too long to be a transmission
  unsigned ignored_noise;     ///< runs of bytes that stayed too long without a valid frame
  unsigned ignored_damage;    ///< damaged frames that opened no window: most frames were
};

#ifndef PHEROMONE_ADAPTERS
#define PHEROMONE_ADAPTERS 1
#endif
/// False: bytes come from a UART of our own, and Parameters::adapter_ms is not looked at.
constexpr bool kHasAdapters = PHEROMONE_ADAPTERS != 0;

struct MediumState {  // NOLINT(cppcoreguidelines-pro-type-member-init): MediumState() is all zero
  uint8_t slot_ms;    ///< of contention
  uint8_t window_ms;  ///< of responses
  bool receiving;     ///< as of Poll: another station is in the middle of a frame
  bool clear;         ///< as of Poll: nobody is sending
  bool pause;         ///< clear, and a ROUND that follows a COMMAND would have begun
  Census census;      ///< the other robots
  MediumCounters counters;
  protocol::FrameParser parser;
  protocol::DecoderCounters decoder;
};

/// The period in ms in which this robot and all that it hears find time for an exchange each by
/// contention: 26 bytes and what signing adds to them, the turnarounds and the server's delay, and
/// two slots in which to find an order.
inline uint32_t ContentionPeriodMs(const MediumState& medium, uint32_t baud, uint8_t added = 0) {
  const uint16_t bytes = static_cast<uint16_t>(26 + added);
  const uint32_t each_ms = BytesMs(bytes, baud) + medium.window_ms + 2u * medium.slot_ms;
  return (medium.census.robots() + 1u) * each_ms - 2u * medium.slot_ms;
}

/// What begins at zero, separate so that one loop can clear it as plain memory.
class MediumVariables {
 protected:
  enum Timer : uint8_t {
    kOthers,   // another station may be present
    kHeld,     // another station's answer or ACK is due
    kCensus,   // until the other robots have been counted
    kSlot,     // until the next slot begins
    kCarrier,  // a carrier may still be a transmission
    kTimers
  };

  uint16_t timers_[kTimers];
  uint8_t server_slot_ms_;
  uint8_t countdown_;  // the slot that is ours; 0: not drawn, begin at once
  uint8_t damaged_;    // frames with a bad CRC, less the valid ones; not below 0
  bool idle_;          // a slot has begun since the last byte that held the channel
  bool slot_begins_;
  bool carrier_ignored_;
  uint16_t quiet_ms_;  // since the last byte heard or sent; stays at the largest value
  // Of this run of bytes, which ends with the idle time:
  uint16_t stray_ms_;   // taken by bytes outside of frames
  uint16_t framed_ms_;  // taken by frames since the last valid one
};

class MediumAccess : private MediumVariables {
 public:
  enum Delay : uint8_t {
    kAtOnce,   ///< in the next slot
    kFirst,    ///< in the next slot, also if the channel is not free yet
    kRandom,   ///< after random slots, unless nobody else is about
    kBackOff,  ///< after random slots
  };
  enum Outcome : uint8_t { kAnswered, kMissed, kBusy, kAbandoned };

  explicit MediumAccess(const Parameters& parameters);

  const MediumState& state() const { return state_; }
  const Rounds& rounds() const { return rounds_; }
  Rounds* rounds() { return &rounds_; }

  void Advance(uint16_t elapsed_ms);
  /// A byte from the radio, and what it did. `awaiting`: it may be of an answer to us.
  protocol::FrameParser::Result Hear(uint8_t byte, bool awaiting);
  /// Nothing is being received that may be an answer.
  bool Silent();
  /// `channel_busy`: the radio detects a carrier.
  void Poll(bool channel_busy);

  /// There is something to send.
  void Contend(Delay delay);
  /// Only those who have a turn may send. The last one may still be heard after that.
  bool reserved() const { return rounds_.reserved_ms() > AdapterMs(); }
  /// Whether it may be sent now, by contention. Between turns only what is `urgent` may.
  bool MayBegin(bool urgent);
  /// Our first byte leaves, and our last one has left.
  void OnBegin() { EndRun(); }
  void OnSent();
  /// Of what was sent.
  void OnOutcome(Outcome outcome);

  /// The server's slot and response window; 0: unknown.
  void Tune(uint8_t slot_ms, uint8_t window_ms);
  void set_adapter_ms(uint8_t adapter_ms) { adapter_ms_ = adapter_ms; }
  /// Of the other robots that were heard lately.
  bool at_most_one_other() const { return state_.census.robots() < 2; }
  /// What a ROUND grants. True: turns of ours.
  bool Grant(const uint8_t* round);
  /// A random number below `bound`.
  uint8_t Draw(uint8_t bound) { return random_.Below(bound); }

 private:
  bool FrameOpen();
  void Listen(bool was_open, protocol::FrameParser::Result event);
  bool Noisy() const;
  void EndRun();
  void OnFrame();
  void OnDamage();
  void Hold();
  uint8_t AdapterMs() const { return kHasAdapters ? adapter_ms_ : uint8_t{0}; }
  void HearOther() { timers_[kOthers] = kAloneMs; }
  bool DetectCarrier(bool channel_busy);
  void ForgetCarrier();
  void RestartSlots();
  void ChooseSlotMs();
  void DrawInOpening();
  uint16_t IdleMs() const { return static_cast<uint16_t>(state_.slot_ms + three_bytes_ms_); }
  uint8_t RandomSlots();

  enum : uint16_t { kAloneMs = 1000 };  // nobody else about for so long: no random delay

  uint8_t id_;
  uint8_t gap_timeout_ms_;
  uint8_t first_window_ms_;
  uint8_t adapter_ms_;
  uint8_t byte_ms_;
  uint8_t three_bytes_ms_;
  uint16_t longest_frame_ms_;  // stray or framed bytes hold the channel for this long
  Random random_;
  ContentionWindow window_;
  Rounds rounds_;
  MediumState state_;
};

}  // namespace client
}  // namespace pheromone
