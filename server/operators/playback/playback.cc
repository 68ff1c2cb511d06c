#include "server/operators/playback/playback.h"

#include <algorithm>

namespace pheromone::playback {
namespace {

constexpr double kNsInMs = 1e6;
// Of the time of who watches: further behind, it goes on from where it is.
constexpr double kMaxLagMs = 200;

}  // namespace

State Playback::Take(const Request& request) {
  is_playing_ = request.play;
  speed_ = std::clamp(request.speed, kMinSpeed, kMaxSpeed);
  origin_ms_.reset();
  if (request.seek_ns) {
    const Range& range = player_.range();
    goal_ns_ = std::clamp(*request.seek_ns, range.begin_ns, range.end_ns);
    player_.Seek(goal_ns_);
    is_buffering_ = true;
  }
  State now = state();
  now.did_seek = request.seek_ns.has_value();
  told_ = now.phase;
  return now;
}

void Playback::MoveOrigin(uint64_t now_ms) {
  origin_ms_ = now_ms;
  origin_ns_ = player_.time_ns();
}

bool Playback::Turn(uint64_t now_ms, uint64_t most_bytes) {
  if (is_buffering_) {
    is_buffering_ = !player_.Arrive(most_bytes);
    origin_ms_.reset();
    return is_buffering_;
  }
  if (!is_playing_ || player_.has_failed()) {
    return false;
  }
  if (!origin_ms_) {
    MoveOrigin(now_ms);
  }
  const double passed_ns = static_cast<double>(now_ms - std::min(now_ms, *origin_ms_)) * kNsInMs *
                           static_cast<double>(speed_);
  const uint64_t left_ns = player_.range().end_ns - std::min(player_.range().end_ns, origin_ns_);
  const uint64_t goal_ns =
      origin_ns_ + std::min(left_ns, static_cast<uint64_t>(std::min(passed_ns, 9e18)));
  player_.Proceed(goal_ns);
  const bool is_there = player_.Arrive(most_bytes);
  if (!is_there && static_cast<double>(goal_ns - player_.time_ns()) >
                       kMaxLagMs * kNsInMs * static_cast<double>(speed_)) {
    MoveOrigin(now_ms);
    return false;
  }
  return !is_there;
}

State Playback::state() const {
  const bool is_at_end = player_.has_failed() || player_.time_ns() >= player_.range().end_ns;
  return {.phase = is_buffering_              ? State::Phase::kBuffering
                   : is_at_end && is_playing_ ? State::Phase::kEnded
                   : is_playing_              ? State::Phase::kPlaying
                                              : State::Phase::kPaused,
          .time_ns = is_buffering_ ? goal_ns_ : player_.time_ns(),
          .speed = speed_};
}

std::optional<State> Playback::TakeNews() {
  const State now = state();
  if (now.phase == told_) {
    return std::nullopt;
  }
  told_ = now.phase;
  return now;
}

}  // namespace pheromone::playback
