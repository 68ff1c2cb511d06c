// The cleaning swarm: robots that clean a grid of zones, each with a virtual tag in its middle, and
// coordinate by nothing but what they write on the tags (Tammet, Vain and Kuusik 2006, section 4).
// The real firmware (client_fw/core/tasks/cleaner.h) over simulated radio channels, with the real
// engine, in virtual time.
//
//   const CleaningRun run = RunCleaning(CleaningExperiment{}, /*seed=*/1);
//   run.together_ms;                      // two robots cleaned one zone: always 0
//   SoilOf(experiment.grid, experiment.soil, zone, run.cleanings, experiment.duration_ms);
//
// A tag is in range of its own zone and the four beside it, not of the diagonal ones. Robots start
// in the middle of different zones, if the seed chooses these, as it does their headings. They are
// points, and do not collide: two may meet on their ways, or stand in one zone, but must not clean
// one. Driving is an ideal differential drive with exact odometry, and a Pioneer's acceleration.
//
// The seed determines all; the same seed gives the same run. Pure; any thread.
#pragma once

#include <bit>
#include <csignal>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client_fw/experiments/cleaning/grid.h"
#include "client_fw/sim/differential_drive.h"
#include "client_fw/swarm/channel_model.h"
#include "client_fw/swarm/simulation.h"
#include "server/base/result.h"

namespace pheromone::swarm {

/// A robot that breaks down.
struct SwitchOff {
  int robot = 0;
  int64_t time_ms = 0;
};

struct CleaningExperiment {
  CleaningGrid grid;
  SoilRule soil;
  int robots = 2;                ///< at most one for each zone, and 254
  std::vector<int> starts = {};  ///< a zone for each robot; empty: the seed chooses
  uint64_t closed = 0;           ///< zones, as bits, on which an operator's sign keeps robots away
  int64_t cleaning_ms = 10'000;
  int64_t lease_s = 0;  ///< of a claim; 0: twice as long as cleaning takes, and 2 s
  int16_t speed_mm_s = 300;
  int slots = 8;  ///< of each tag, at least 2
  int64_t duration_ms = 1'200'000;
  uint16_t period_ms = 200;  ///< between a robot's requests for intensities
  ChannelTiming timing = {};
  int channels = 1;       ///< robot i is on channel i modulo this
  double frame_loss = 0;  ///< of each listener
  std::optional<SwitchOff> switch_off = {};
  int64_t sample_ms = 0;  ///< of the tracks; 0: none

  bool IsClosed(int zone) const { return zone < 64 && (closed >> zone & 1) != 0; }
  int open_zones() const { return grid.zones() - std::popcount(closed); }
  int64_t LeaseSeconds() const;
  /// Open zones for each robot times the time for one: driving to the next at full speed, and
  /// cleaning.
  double IdealCycleSeconds() const;
};

/// What a robot cannot do: too many robots, channels without a robot. Empty if it can be run.
std::string WhatIsWrong(const CleaningExperiment& experiment);

SimulationConfig SimulationOf(const CleaningExperiment& experiment, uint64_t seed);

struct CleaningRun {
  std::vector<Cleaning> cleanings;  ///< by their begin
  /// Two robots cleaned one zone, by where they truly were: never.
  int64_t together_ms = 0;
  /// Cleanings in another zone than the one whose tag was claimed.
  int64_t misplaced = 0;
  int64_t end_ms = 0;        ///< of the run; live it may have been ended early
  uint64_t lost_claims = 0;  ///< that another was faster with, or whose lease ended
  uint64_t tag_requests = 0;
  uint64_t fail_safe_stops = 0;
  double utilisation = 0;                           ///< of the fullest channel
  std::vector<std::vector<sim::PlanePose>> tracks;  ///< by robot, every sample_ms from 0 on
  uint64_t state_hash = 0;  ///< of the engine, at the end; not of a live run

  bool is_safe() const { return together_ms == 0 && misplaced == 0; }
};

/// `on_second`, if given, is called after each second of the run.
CleaningRun RunCleaning(const CleaningExperiment& experiment, uint64_t seed,
                        const std::function<void(int64_t second)>& on_second = {});

/// In real time against a running server with the configuration of ServerText: port i leads to its
/// link for channel i. Ends early if `*stop` is not 0, a signal handler's doing. Errors: a port
/// that cannot be opened, another number of ports than channels, those of SignWith (swarm/live.h).
Result<CleaningRun> RunCleaningLive(const CleaningExperiment& experiment, uint64_t seed,
                                    const std::vector<std::string>& ports,
                                    const std::string& keys_file,
                                    const volatile std::sig_atomic_t* stop,
                                    const std::function<void(int64_t second)>& on_second = {});

/// The configuration of a server for this floor, as TOML, with a pty for each channel.
std::string ServerText(const CleaningExperiment& experiment);

/// What a run comes to. Closed zones do not count.
struct CleaningSummary {
  uint64_t done = 0;           ///< cleanings
  double worst_gap_s = 0;      ///< of all open zones
  double mean_gap_s = 0;       ///< between two cleanings of a zone
  int worst_zone = 0;          ///< the one of worst_gap_s
  double highest_percent = 0;  ///< soil, of all zones and times
  double turn_s = 0;           ///< of a robot: from one cleaning to the next, and cleaning
  double cycle_s = 0;          ///< open zones for each robot times that
};

CleaningSummary Summarise(const CleaningExperiment& experiment, const CleaningRun& run);

}  // namespace pheromone::swarm
