// A modelled radio: when each robot is answered, drawn from measured rounds (measured_rounds.h)
// instead of sent as bytes.
//
//   const RoundsLink link(/*robots=*/1000, {.robots_per_channel = 16, .lost_percent = 1}, seed);
//   LinkExchange next = link.First(robot);
//   // at next.ask_ms the robot's pose reaches the server, at next.answer_ms it has the answer
//   next = link.After(robot, next);
//
// The robots are on as many channels as they need, in turn, as those of pheromone-swarm run: robot
// i on channel i modulo their number. A robot's gaps are independent of each other and of those of
// others. With nothing lost a gap is the period of 0.2 s, or the time in which the channel has
// served all, if that is longer; a lost frame makes it one or more of these longer. What is left
// out: joining, which takes robots on the air some seconds; and that requests whose answer is lost
// are repeated: each one here is answered.
//
// Chance is a hash of seed, robot and the number of the exchange. Pure; any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "client_fw/lab/link/measured_rounds.h"

namespace pheromone::lab {

constexpr int kMaxMeasuredRobots = 40;
/// Longer steps would put answers where they are not.
constexpr int64_t kMaxRadioStepMs = 100;

struct RadioModel {
  int robots_per_channel = 16;  ///< at most; 1 to kMaxMeasuredRobots
  int lost_percent = 0;         ///< of the frames, for each listener; 0, 1 or 5

  bool operator==(const RadioModel&) const = default;
};

/// The channels that so many robots need.
inline size_t ChannelsOf(size_t robots, int robots_per_channel) {
  const auto most = static_cast<size_t>(robots_per_channel);
  return (robots + most - 1) / most;
}

struct LinkExchange {
  uint64_t number = 0;
  int64_t ask_ms = 0;     ///< not before the answer before it
  int64_t answer_ms = 0;  ///< not before `ask_ms`
};

class RoundsLink {
 public:
  /// Requires a model that was measured (FindMeasured).
  RoundsLink(size_t robots, const RadioModel& model, uint64_t seed);

  LinkExchange First(size_t robot) const;
  LinkExchange After(size_t robot, const LinkExchange& before) const;

 private:
  const MeasuredChannel& ChannelOf(size_t robot) const {
    return *channels_[robot % channels_.size()];
  }

  uint64_t seed_;
  std::vector<const MeasuredChannel*> channels_;
};

}  // namespace pheromone::lab
