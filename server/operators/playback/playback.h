// Plays a recording: play, pause, speed and seek, as viewers ask for them. A state machine over a
// player (player.h); the time that passes is an argument.
//
//   Playback playback(&player);
//   State state = playback.Take({.play = true, .speed = 4, .seek_ns = 1'700'000'000'000'000'000});
//   while (playback.Turn(now_ms, kPortion)) {}      // more is to be done at once
//   if (playback.is_ready()) Show(player, player.time_ns());
//   if (auto state = playback.TakeNews()) { tell it }
//
// A request is followed by any number of turns until the moment is reached: buffering; nothing is
// shown meanwhile. Where replaying takes longer than the recorded time, it plays as fast as it can.
#pragma once

#include <cstdint>
#include <optional>

#include "server/operators/playback/player.h"

namespace pheromone::playback {

constexpr float kMinSpeed = 0.01F;
constexpr float kMaxSpeed = 1000;

struct Request {
  bool play = false;
  float speed = 1;  ///< from kMinSpeed to kMaxSpeed
  std::optional<uint64_t> seek_ns = {};
};

struct State {
  enum class Phase : uint8_t { kPlaying = 0, kPaused = 1, kBuffering = 2, kEnded = 3 };
  Phase phase = Phase::kPaused;
  uint64_t time_ns = 0;
  float speed = 1;
  bool did_seek = false;
  bool operator==(const State&) const = default;
};

class Playback {
 public:
  /// `player` has finished its survey, and outlives this.
  explicit Playback(Player* player) : player_(*player) {}

  /// What is so from now on.
  State Take(const Request& request);

  /// Goes on to where it should be at `now_ms`, of a clock that is never set, for about so many
  /// bytes of the recording. True: it is not there yet.
  bool Turn(uint64_t now_ms, uint64_t most_bytes);

  /// Whether the player is at a moment that is to be shown.
  bool is_ready() const { return !is_buffering_ && player_.has_views(); }
  State state() const;
  /// The state, if it has changed since it was last told, other than the time as it goes.
  std::optional<State> TakeNews();

 private:
  void MoveOrigin(uint64_t now_ms);

  Player& player_;
  bool is_playing_ = false;
  float speed_ = 1;
  bool is_buffering_ = true;
  uint64_t goal_ns_ = 0;  // while buffering
  std::optional<uint64_t> origin_ms_;
  uint64_t origin_ns_ = 0;  // of the recording, at origin_ms_
  State::Phase told_ = State::Phase::kPaused;
};

}  // namespace pheromone::playback
