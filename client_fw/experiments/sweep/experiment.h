// How path following depends on its parameters, one at a time: mean error and progress against the
// profile's a, c and sigma, the speed K, the period of the requests, the server's latency, lost
// frames and odometry drift. All other conditions stay as FollowConditions has them.
//
//   for (const Sweep& sweep : Sweeps())
//     for (double value : sweep.values) FollowSeeds(sweep.at(conditions, value), 1, 10);
//
// Virtual time, one thread; the same arguments give the same figures.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "client_fw/experiments/laws/experiment.h"
#include "client_fw/experiments/laws/follow.h"

namespace pheromone::swarm {

struct Sweep {
  std::string name;  ///< on the command line and in the table
  std::vector<double> values;
  /// The conditions with the value set.
  std::function<FollowConditions(FollowConditions, double)> at;
};

/// All sweeps, in the order of the table.
const std::vector<Sweep>& Sweeps();

struct SweepPoint {
  std::string sweep;
  double value = 0;
  Contender contender;
  FollowSummary summary;
};

/// Every value of a sweep with every contender, on one curve, 20 s each; seeds 1, 2, ... `shown` is
/// called before each point.
std::vector<SweepPoint> RunSweep(const Sweep& sweep, const std::vector<Contender>& contenders,
                                 Curve curve, int seeds, const std::function<void()>& shown);

/// A header line, then a line a point.
std::string ToCsv(const std::vector<SweepPoint>& points);

}  // namespace pheromone::swarm
