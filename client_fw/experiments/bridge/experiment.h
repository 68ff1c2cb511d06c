// The double bridge experiment: does a swarm that deposits and follows an evaporating trail find
// the shorter of two branches (Goss, Aron, Deneubourg and Pasteels 1989; fig. 2 of Susnea et al.
// 2009)?
//
//   const BridgeSeries series = RunBridges(BridgeExperiment{}, 30);
//   const BridgeSummary summary = Summarise(series);
//   summary.ended_short;                 // of 30 swarms
//
// A swarm has *decided* if at least kMaxOfAll of the choices in the last quarter of the run are for
// one branch. The share of choices is used (Goss et al. count the traffic), not the share of the
// robots present: a robot is on a branch twice as long for twice the time.
//
// Virtual time. A series runs on all processors; its result does not depend on their number.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client_fw/experiments/bridge/simulation.h"

namespace pheromone::swarm {

constexpr double kMaxOfAll = 0.8;

enum class Outcome : uint8_t { kShort, kLong, kUndecided };
std::string_view NameOf(Outcome outcome);

/// Of the share of the short branch among the last choices.
Outcome OutcomeOf(double final_share);

struct BridgeRun {
  std::vector<Choice> choices;
  double final_share = 0.5;  ///< of the short branch, in the last quarter of the run
  Outcome outcome = Outcome::kUndecided;
  double presence = 0;  ///< of the robots' time between the forks: the share on the short branch
  uint32_t fail_safe_stops = 0;
  uint64_t state_hash = 0;  ///< of the engine, at the end
};

BridgeRun RunBridge(const BridgeExperiment& experiment, uint64_t seed);

/// The share of the short branch among the choices in [from_ms, to_ms), nothing if there is none.
std::optional<double> ShortShare(const std::vector<Choice>& choices, int64_t from_ms,
                                 int64_t to_ms);

/// Runs of one experiment, of seed 1, 2, ...
struct BridgeSeries {
  BridgeExperiment experiment;
  std::vector<BridgeRun> runs;
};

/// `on_run`, if given, is called after each run, by one thread at a time.
BridgeSeries RunBridges(const BridgeExperiment& experiment, int seeds,
                        const std::function<void()>& on_run = {});

/// The experiments of the command: the base, the controls, and the sweeps, each a variation of
/// `base` in one respect.
std::vector<BridgeExperiment> BridgeExperiments(const BridgeExperiment& base);

/// The mean over the runs, and the standard deviation.
struct ShareSpread {
  double mean = 0;
  double deviation = 0;  ///< standard deviation of the sample; 0 for one run
};

/// Of the share of the short branch in [from_ms, to_ms), over the runs that chose in that time.
ShareSpread ShareOf(const BridgeSeries& series, int64_t from_ms, int64_t to_ms);

struct BridgeSummary {
  int runs = 0;
  int ended_short = 0;
  int ended_long = 0;  ///< locked in on the long branch
  /// Wilson's 95 % interval for the probability to end on the short branch.
  double least_probability = 0;
  double most_probability = 0;
  ShareSpread final_share;
  double presence = 0;  ///< mean
  double choices = 0;   ///< mean
  uint64_t fail_safe_stops = 0;
  uint64_t state_hash = 0;  ///< over all runs
};

BridgeSummary Summarise(const BridgeSeries& series);

/// The lines of a readable table: its head, then one per series.
std::string BridgeTableHead();
std::string BridgeTableRow(const BridgeSeries& series);

/// A header line, then one line per series; per run; per series and minute. ChoicesToCsv counts the
/// choices of a series by the short branch's share of the trail at the entries.
std::string ToCsv(const std::vector<BridgeSeries>& all);
std::string RunsToCsv(const std::vector<BridgeSeries>& all);
std::string SharesToCsv(const std::vector<BridgeSeries>& all);
std::string ChoicesToCsv(const BridgeSeries& series);

}  // namespace pheromone::swarm
