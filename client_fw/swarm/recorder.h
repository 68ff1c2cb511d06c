// Records a swarm: the robots' tracks, their exchanges with the server, and the use of their
// channels.
//
//   Recorder recorder(&swarm, field_config, /*sample_ms=*/200);
//   do {
//     recorder.Look();                                     // at the start, and every millisecond
//     swarm.Step(...);
//   } while (...);
//   const SwarmRecord record = recorder.Finish();
//
// One thread.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "client_fw/sim/radio_medium.h"
#include "client_fw/swarm/swarm.h"
#include "client_fw/swarm/track.h"
#include "server/core/field/config.h"

namespace pheromone::swarm {

/// An answer received by a robot.
struct Exchange {
  int64_t time_ms = 0;
  size_t robot = 0;       ///< counted from 0
  uint32_t requests = 0;  ///< sent since the answer before
  int16_t p_left = 0;     ///< 1/4096 of a pheromone unit
  int16_t p_right = 0;
};

struct RobotRecord {
  std::vector<Sample> track;
  client::Counters counters{};
  double progress_m = 0;           ///< along the [[path]] it starts nearest to; 0 without one
  double mean_error_m = 0;         ///< from it
  int64_t off_limits_samples = 0;  ///< of the track: in an obstacle or off the map
  uint32_t bumps = 0;              ///< into obstacles
};

struct ChannelRecord {
  sim::RadioCounters radio;
  double utilisation = 0;
  std::optional<uint64_t> late_answers;  ///< of an engine in process
  std::optional<uint64_t> reconnects;    ///< of a daemon's port
};

struct SwarmRecord {
  int64_t duration_ms = 0;
  std::vector<RobotRecord> robots;
  std::vector<ChannelRecord> channels;
  std::vector<Exchange> exchanges;     ///< in the order of time
  std::optional<uint64_t> state_hash;  ///< at the end, of an engine in process
};

class Recorder {
 public:
  /// `swarm` must outlive the recorder.
  Recorder(const Swarm* swarm, const field::FieldConfig& field, int64_t sample_ms);

  /// Records what is new at the swarm's present time. True if a sample was due.
  bool Look();

  /// Everything so far, except what only the server's side knows.
  SwarmRecord Finish();

 private:
  void NoteExchanges();
  void Sample();

  const Swarm* swarm_;
  field::FieldConfig field_;
  std::vector<field::Path> paths_;  // by robot: the one that it starts nearest to
  int64_t sample_ms_;
  SwarmRecord record_;
};

}  // namespace pheromone::swarm
