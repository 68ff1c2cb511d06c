// How many robots a radio channel can serve: N robots that send requests over one half-duplex
// channel, in virtual time, with the client's actual medium access code.
//
//   const ChannelRun run = MeasureChannel({.robots = 4}, seed);
//   const ChannelSummary row = Summarise(experiment, runs);      // of all seeds
//
// The robots stand on a pheromone path and send SENSE, either once in each period of a clock (5 Hz)
// or, with period 0, as soon as the previous one is answered. They are switched on at random times
// in the first second; the first kWarmUpMs are not counted. A request counts as delivered if it is
// answered within 500 ms of the time at which it was due (delivery.h).
//
// Figures are per second of the channel, not per robot. The seed determines positions, IDs,
// switch-on times, and the robots' random delays; the same seed gives the same figures. Pure; any
// thread.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client_fw/swarm/channel_model.h"

namespace pheromone::swarm {

constexpr int64_t kWarmUpMs = 10'000;
constexpr int64_t kDeadlineMs = 500;

/// How robots get to send: each for itself, or in turns that the server grants.
enum class Access : uint8_t { kContention, kRounds };

/// Shares of bytes that arrive wrong. Everything applies to each listener for itself.
struct Air {
  double byte_error = 0;   ///< of all
  double burst_bytes = 1;  ///< mean length of the runs of wrong bytes
  double bad_robot = 0;    ///< what the first robot sends and hears, besides
  double from_server = 0;  ///< what the server sends, besides
  double to_server = 0;    ///< what the server hears, besides
  bool fades = false;      ///< each robot is out of reach for 0.2 to 2 s, a tenth of the time

  bool operator==(const Air&) const = default;
};

/// "3 % in bursts of 4"; "-": nothing is damaged.
std::string NameOf(const Air& air);

struct ChannelExperiment {
  int robots = 1;  ///< 1 to 100
  Access access = Access::kContention;
  int simple = 0;               ///< with rounds: so many of the robots only contend
  uint16_t period_ms = 200;     ///< 0: continuously
  uint16_t fail_safe_ms = 480;  ///< of the robots
  int hidden_pairs = 0;         ///< of robots that do not hear each other, the first ones
  double frame_loss = 0;        ///< of each listener
  Air air = {};
  bool is_signed = false;        ///< the link requires signed frames, and all robots have keys
  bool together = false;         ///< all are switched on at 0, instead of within a second
  int64_t duration_ms = 60'000;  ///< counted, after the warm-up
  ChannelTiming timing = {};
};

/// The figures of one robot.
struct RobotShare {
  int64_t due = 0;  ///< 0 if it asks continuously
  int64_t delivered = 0;
  int64_t answers = 0;
  int64_t longest_gap_ms = 0;  ///< without an answer
  int64_t fail_safe_stops = 0;
};

struct ChannelRun {
  std::vector<RobotShare> robots;
  std::vector<int64_t> latencies_ms;  ///< of all robots; asking continuously: between two answers
  std::vector<int64_t> gaps_ms;       ///< between the answers of each robot
  std::vector<int64_t> pose_ages_ms;  ///< from the last request to its answer
  int64_t time_to_order_ms = 0;       ///< from 0 until every robot had an answer; -1: never
  double goodput = 0;                 ///< answers a second
  uint64_t requests = 0;              ///< since the start, retries included
  uint64_t collided_blocks = 0;       ///< since the start
  uint64_t late_answers = 0;          ///< that the server did not send
  uint64_t refused = 0;               ///< frames with a wrong tag, or without one, at both ends
  double utilisation = 0;
  uint64_t hash = 0;  ///< of all figures above and the engine's state
};

ChannelRun MeasureChannel(const ChannelExperiment& experiment, uint64_t seed);

/// Means over the seeds, and the worst seed.
struct ChannelSummary {
  ChannelExperiment experiment;
  int seeds = 0;
  double peak = 0;   ///< C_1, exchanges a second
  double ideal = 0;  ///< the bound of channel_model.h, or the offered load if that is less
  /// B_1: one exchange at a time, with instant knowledge of what was lost; or the offered load.
  double lossy_bound = 0;
  double goodput = 0;
  double worst_goodput = 0;
  double delivered = 0;  ///< share of the requests due
  double worst_delivered = 0;
  double worst_robot_delivered = 0;  ///< the worst robot of all seeds
  double worst_robot_share = 0;      ///< its answers by the mean of its run's robots, worst seed
  int64_t p50_ms = 0;                ///< latency, over all seeds
  int64_t p99_ms = 0;
  int64_t longest_gap_ms = 0;
  int64_t fail_safe_stops = 0;
  int64_t pose_age_p50_ms = 0;
  int64_t time_to_order_ms = 0;  ///< of the slowest seed; -1: never
  double requests_per_answer = 0;
  double utilisation = 0;
  std::vector<int64_t> gaps_ms;       ///< of all seeds, sorted
  std::vector<int64_t> pose_ages_ms;  ///< likewise
  uint64_t hash = 0;
};

ChannelSummary Summarise(const ChannelExperiment& experiment, const std::vector<ChannelRun>& runs);

}  // namespace pheromone::swarm
