#include "client_fw/swarm/run_command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "client_fw/swarm/command.h"
#include "client_fw/swarm/scenario.h"
#include "client_fw/swarm/scenario_report.h"
#include "client_fw/swarm/scenario_run.h"

namespace pheromone::swarm {
namespace {

struct RunOptions {
  std::string file;
  std::optional<uint64_t> seed;
  std::string out;
};

// A bar of 40 places, renewed when the percentage changes.
std::function<void(int64_t)> ProgressBar(int64_t duration_ms) {
  if (isatty(STDERR_FILENO) == 0) {
    return {};
  }
  return [duration_ms, shown = int64_t{-1}](int64_t ms) mutable {
    const int64_t percent = ms * 100 / duration_ms;
    if (percent != shown) {
      shown = percent;
      fmt::print(stderr, "\r[{:<40}] {:3} %",
                 std::string(static_cast<size_t>(percent * 2 / 5), '#'), percent);
    }
  };
}

int Run(const RunOptions& options) {
  Result<Scenario> loaded = LoadScenario(options.file);
  if (!loaded.ok()) {
    return Fail(loaded.error(), kWrongInput);
  }
  Scenario scenario = std::move(loaded.value());
  scenario.seed = options.seed.value_or(scenario.seed);
  for (const std::string& warning : scenario.warnings) {
    fmt::print(stderr, "{}\n", warning);
  }
  const std::function<void(int64_t)> bar = ProgressBar(scenario.duration_ms);
  const ScenarioResult result = RunScenario(scenario, bar);
  if (bar) {
    fmt::print(stderr, "\r{:60}\r", "");
  }
  const std::string summary = Summarise(scenario, result);
  fmt::print("{}", summary);
  if (options.out.empty()) {
    return 0;
  }
  return WriteFiles(options.out, {{"summary.txt", summary},
                                  {"tracks.csv", TracksToCsv(result)},
                                  {"exchanges.csv", ExchangesToCsv(result)},
                                  {"map.svg", DrawScenario(scenario, result)}});
}

}  // namespace

void AddRunCommand(CLI::App* app, int* status) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command = app->add_subcommand(
      "run", "Robots in a scenario from a file, in virtual time; prints a summary");
  command->add_option("scenario", options->file, "A TOML file; examples are in swarm/examples")
      ->required();
  command->add_option("--seed", options->seed, "Instead of the file's");
  command->add_option("--out", options->out,
                      "Folder for summary.txt, tracks.csv, exchanges.csv and map.svg");
  command->callback([options, status] { *status = Run(*options); });
}

}  // namespace pheromone::swarm
