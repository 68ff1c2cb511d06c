// pheromone-experiments bridge: the double bridge experiment, in virtual time.
#include "client_fw/swarm/command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "client_fw/experiments/bridge/experiment.h"
#include "client_fw/experiments/bridge/moments.h"
#include "client_fw/experiments/commands.h"
#include "server/base/number_check.h"

namespace pheromone::swarm {
namespace {

struct BridgeOptions {
  int seeds = 30;
  double minutes = 20;
  double tau_s = 20;
  bool base_only = false;
  std::string out;
  BridgeExperiment base;
};

// The first swarm of the base that ended on each branch: growing up, and at the end.
std::vector<BridgeMoment> MomentsOf(const BridgeSeries& series) {
  std::vector<BridgeMoment> moments;
  const int64_t end_ms = series.experiment.duration_ms;
  for (const Outcome outcome : {Outcome::kShort, Outcome::kLong}) {
    const auto run = std::find_if(series.runs.begin(), series.runs.end(),
                                  [=](const BridgeRun& it) { return it.outcome == outcome; });
    if (run == series.runs.end()) {
      continue;
    }
    const auto seed = static_cast<uint64_t>(run - series.runs.begin()) + 1;
    for (const int64_t ms : {std::min<int64_t>(40'000, end_ms), end_ms}) {
      moments.push_back({series.experiment, seed, ms, outcome});
    }
  }
  return moments;
}

int RunBridgeCommand(const BridgeOptions& options) {
  BridgeExperiment base = options.base;
  base.tau_ms = static_cast<int64_t>(options.tau_s * 1000);
  base.duration_ms = static_cast<int64_t>(options.minutes * 60'000);
  const std::vector<BridgeExperiment> experiments =
      options.base_only ? std::vector<BridgeExperiment>{base} : BridgeExperiments(base);
  std::vector<BridgeSeries> all;
  fmt::print(stderr, "{} experiments of {} swarms, each of {} min of virtual time\n",
             experiments.size(), options.seeds, options.minutes);
  fmt::print("{}", BridgeTableHead());
  std::fflush(stdout);
  for (const BridgeExperiment& experiment : experiments) {
    int done = 0;
    all.push_back(RunBridges(experiment, options.seeds, [&] {
      ++done;
      ShowProgress(fmt::format("{}/{} {}: {} of {} swarms", all.size() + 1, experiments.size(),
                               experiment.name, done, options.seeds));
    }));
    ShowProgress("");
    fmt::print("{}", BridgeTableRow(all.back()));
    std::fflush(stdout);
    // After each, so that nothing is lost when the command is cut off.
    const int written = options.out.empty()
                            ? 0
                            : WriteFiles(options.out, {{"bridge.csv", ToCsv(all)},
                                                       {"bridge-runs.csv", RunsToCsv(all)},
                                                       {"bridge-share.csv", SharesToCsv(all)}});
    if (written != 0) {
      return written;
    }
  }
  return options.out.empty()
             ? 0
             : WriteFiles(options.out,
                          {{"bridge-choices.csv", ChoicesToCsv(all.front())},
                           {"bridge-arena.csv", MomentsToCsv(MomentsOf(all.front()))}});
}

}  // namespace

void AddBridgeCommand(CLI::App* app, int* status) {
  auto options = std::make_shared<BridgeOptions>();
  BridgeExperiment& base = options->base;
  CLI::App* command = app->add_subcommand(
      "bridge",
      "The double-bridge experiment in virtual time: whether robots that deposit an evaporating "
      "trail find the shorter of two branches; prints the outcomes, with controls and sweeps");
  command->add_option("--seeds", options->seeds, "Swarms per experiment (default: 30)")
      ->check(WholeNumber(1, 10'000));
  command->add_option("--robots", base.robots, "Robots in the base experiment (default: 8)")
      ->check(WholeNumber(1, 50));
  command->add_option("--minutes", options->minutes, "Length of a run (default: 20)")
      ->check(Number(1.0, 600.0));
  command->add_option("--tau", options->tau_s, "Evaporation time, s; 0: never (default: 20)")
      ->check(Number(0.0, 86'400.0));
  command->add_option("--c-max", base.max_count, "Maximum of a node in quanta, 1 / Q (default: 32)")
      ->check(WholeNumber(1, 10'000));
  command
      ->add_option("--wander", base.wandering.rad_s,
                   "Random component of the turning rate, rad/s (default: 0.25)")
      ->check(Number(0.0, 2.0));
  command->add_flag("--base-only", options->base_only, "Without the controls and sweeps");
  command->add_option("--out", options->out,
                      "Folder for bridge.csv (one row for each experiment), bridge-runs.csv, "
                      "bridge-share.csv, and bridge-choices.csv and bridge-arena.csv of the first");
  command->callback([options, status] { *status = RunBridgeCommand(*options); });
}

}  // namespace pheromone::swarm
