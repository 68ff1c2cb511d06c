// One robot follows one curve under given conditions: the basis of the comparison of laws and the
// sweeps. The path experiment (path_experiment.h) with any curve, any steering, and practical
// disturbances: a late server, a lossy radio, odometry that drifts.
//
//   const FollowResult result = Follow({.curve = Curve::kSpiral}, /*seed=*/1);
//   result.mean_error_m;
//
// The robot starts as in the path experiment, 0.2 m beside the path and 20 degrees off; the side,
// the sign of the heading error, the position between two nodes, and the radio's random delays come
// from the seed. The run ends after `duration_ms`, or 0.5 m before the end of an open curve. Errors
// are those of the true pose, sampled every 100 ms. Virtual time; the same seed gives the same
// result.
#pragma once

#include <cstdint>
#include <vector>

#include "client_fw/experiments/laws/curves.h"
#include "client_fw/experiments/laws/law_robot.h"
#include "client_fw/swarm/track.h"

namespace pheromone::swarm {

struct FollowConditions {
  Curve curve = Curve::kLine;
  Steering steering;
  int64_t duration_ms = 20'000;
  uint16_t period_ms = 200;
  double cell_m = 0.1;        ///< a
  double core_m = 0.1;        ///< c
  double sigma_m = 0.4;       ///< sigma: with c, the reach
  double latency_ms = 2;      ///< the server's delay, at most 200
  double frame_loss = 0;      ///< probability that a listener misses a frame
  double odometry_drift = 0;  ///< the right wheel's distances are reported longer by this share
  double offset_m = 0.2;      ///< beside the path at the start
  double heading_error_deg = 20;
};

struct FollowResult {
  std::vector<Sample> track;
  double mean_error_m = 0;       ///< over the whole run
  double late_mean_error_m = 0;  ///< over its second half
  double progress_mm_s = 0;      ///< along the curve
};

FollowResult Follow(const FollowConditions& conditions, uint64_t seed);

/// Over runs of several seeds.
struct Spread {
  double mean = 0;
  double deviation = 0;  ///< the seeds' standard deviation (n - 1); 0 of one run
  double least = 0;
  double most = 0;
};

Spread SpreadOf(const std::vector<double>& values);

struct FollowSummary {
  FollowConditions conditions;
  int runs = 0;
  Spread error_mm;
  Spread late_error_mm;
  Spread progress_mm_s;
};

/// Runs of seeds first_seed, first_seed + 1, ...
FollowSummary FollowSeeds(const FollowConditions& conditions, uint64_t first_seed, int runs);

}  // namespace pheromone::swarm
