// The two-trail bench with robots that drive: Pioneers with the real firmware
// (client_fw/core/tasks/forager.h) over simulated radio channels, in each other's way. The nets run
// in the real engine, in virtual time, or in a running daemon, in real time.
//
//   Result<TrailsRun> run = RunTrails(bench, TrailsExperiment{}, /*seed=*/1);
//   Result<TrailsRun> run = RunTrailsLive(bench, experiment, {"radio-1.pty", ...}, stop, show);
//
// Robots start in the nest's queue. Their sonars see the others (bodies.h), which is how they
// queue; nothing else keeps them apart but the nets. In virtual time the seed determines all; the
// same seed gives the same run. One thread.
#pragma once

#include <csignal>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "client_fw/core/tasks/net_robot.h"
#include "client_fw/experiments/trails/bench.h"
#include "client_fw/experiments/trails/run.h"
#include "client_fw/swarm/channel_model.h"
#include "client_fw/swarm/swarm.h"
#include "server/base/result.h"
#include "server/core/engine/event.h"

namespace pheromone::swarm {

struct TrailsExperiment {
  TrailsRules rules;
  client::NetRobotParameters robot;  ///< of those that are no AVR's image
  int16_t speed_mm_s = 400;
  uint16_t period_ms = 100;  ///< between a robot's requests for intensities
  ChannelTiming timing = {};
  int channels = 0;  ///< robot i is on channel i modulo this; 0: one for each robot
  double frame_loss = 0;
  int avr_robots = 0;  ///< the last ones run the image for the ATmega1284P
  int64_t duration_ms = 1'800'000;
  uint64_t trips = 0;  ///< ends after so many round trips; 0: after the duration only
  int64_t sample_ms = 1000;
  int64_t snapshot_ms = 0;  ///< of where robots are; 0: none

  int channel_count() const { return channels == 0 ? rules.robots : channels; }
};

/// What cannot be run: more robots than places in the nest or than IDs; AVR robots in a build
/// without. Empty if it can be.
std::string WhatIsWrong(const TrailsBench& bench, const TrailsExperiment& experiment);

/// A second of a run.
struct TrailsMoment {
  int64_t time_ms = 0;
  const TrailsLedger& ledger;
  const Swarm& swarm;
};
using ShowTrails = std::function<void(const TrailsMoment&)>;

/// In virtual time. `show`, if given, is called after each second. Errors: those of ConfigWith.
Result<TrailsRun> RunTrails(const TrailsBench& bench, const TrailsExperiment& experiment,
                            uint64_t seed, const ShowTrails& show = {});

/// In real time, against a daemon of the bench's configuration: port i leads to its link for
/// channel i. There are no samples. Ends as soon as `*stop` is not 0, too. Errors: the number of
/// ports is not that of channels, or a port cannot be opened; those of SignWith (swarm/live.h).
Result<TrailsRun> RunTrailsLive(const TrailsBench& bench, const TrailsExperiment& experiment,
                                const std::vector<std::string>& ports, const std::string& keys_file,
                                const volatile std::sig_atomic_t* stop, const ShowTrails& show);

/// The poses where robots with an AVR's image are switched on, which the server has to know
/// ([[frame]]): of links that are called radio-1, radio-2 ... by their channel.
std::vector<engine::RobotFrame> FramesOf(const TrailsBench& bench,
                                         const TrailsExperiment& experiment);

}  // namespace pheromone::swarm
