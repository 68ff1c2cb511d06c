// Openings: when those may speak who have no turns, while there are rounds (protocol/README.md,
// "Rounds"): newcomers, clients that only contend, and robots with an EVENT.
//
//   openings.Judge(now, bad_air);                   // a ROUND is composed: how was the last one?
//   openings.Begin(openings.Slots(now, number), ...);
//   openings.OnSent(turns_end);
//   openings.OnMessage(message, has_turns), openings.OnBytes(at, damaged), openings.OnAnswered(at);
//   if (openings.open()) ... openings.end()
//
// While somebody without turns uses every opening, each round has one; while nobody does, openings
// take a fiftieth of the time. One that is used goes on, for so long that each client without turns
// gets about as many exchanges as a robot has turns.
//
// No I/O, no clock. Not thread-safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>

#include "protocol/messages.h"
#include "server/robots/radio/channel_options.h"
#include "server/robots/radio/timing.h"

namespace pheromone::radio {

class Openings {
 public:
  /// `exchange`: a SENSE and its answer, in a window.
  Openings(const ChannelOptions& options, Duration exchange)
      : options_(options), exchange_(exchange) {}

  /// Something was heard, in whatever part of a round.
  void OnChannel(Time at);
  /// A client without turns was heard; it has turns now.
  void OnOther(uint8_t id, Time at) { others_[id] = at; }
  void OnJoined(uint8_t id) { others_.erase(id); }
  /// Clients without turns that were heard lately.
  int OthersPresent() const;

  /// Between the last turn and the next ROUND. What follows concerns only this time.
  bool open() const { return end_ != Time::min(); }
  Time end() const { return end_; }
  void OnMessage(const protocol::Message& message, bool has_turns);
  void OnBytes(Time at, bool damaged);
  /// The last bit of an answer arrives.
  void OnAnswered(Time at);

  /// Of an opening with an exchange in it, at least.
  Duration Shortest() const;

  /// A ROUND is composed. `bad_air`: what is damaged need not have collided.
  void Judge(Time now, bool bad_air);
  /// How many slots the ROUND of this number says, if it has turns: 0, it is not open.
  uint8_t Slots(Time now, uint8_t number) const;
  /// If it has none, and the next one is due after `open`.
  uint8_t SlotsUntil(Duration open) const;
  /// Whether it is to arrive in bad air, too.
  bool IsForNewcomers(Time now, uint8_t number) const;

  struct Round {
    bool has_turns = false;
    bool coded = false;
    bool bad_air = false;
    size_t of = 1;  ///< so many rounds have all robots had a turn in
  };
  void Begin(uint8_t slots, const Round& round);
  void OnSent(Time turns_end);

 private:
  bool IsTime(Time now, uint8_t number) const;
  bool MayGoOn(Time now) const;
  bool OthersServed() const;
  Duration TimeOf(uint8_t slots) const;

  const ChannelOptions options_;
  const Duration exchange_;
  std::map<uint8_t, Time> others_;  // when clients without turns were last heard
  Time last_heard_ = Time::min();
  Round round_;
  Time turns_end_ = Time::min();
  Time end_ = Time::min();  // min: there is none
  uint8_t slots_ = 0;
  Time next_ = Time::min();       // not before
  uint8_t width_ = 0;             // of the next one, in slots
  int plain_ = 0;                 // since one of a coded ROUND
  int exchanges_ = 0;             // in this one
  bool used_ = false;             // by somebody without turns
  bool collided_ = false;         // some of what was heard was damaged
  bool greeted_ = false;          // somebody said HELLO
  bool wanted_ = true;            // the last one that has ended was used, or there was none
  bool collided_before_ = false;  // in the one before that was used
};

}  // namespace pheromone::radio
