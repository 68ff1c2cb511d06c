// pheromone-swarm lab: swarms of thousands on the server's own field, with an ideal or a modelled
// radio, or with each byte on the air (client_fw/lab).
#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "client_fw/boards/host/real_time.h"
#include "client_fw/lab/commit.h"
#include "client_fw/lab/scenario/run.h"
#include "client_fw/lab/scenario/scenario.h"
#include "client_fw/lab/scenario/summary.h"
#include "client_fw/lab/scenario/sweep.h"
#include "client_fw/swarm/command.h"
#include "client_fw/swarm/commands.h"
#include "client_fw/swarm/daemon_links.h"
#include "client_fw/swarm/lab_outputs.h"
#include "client_fw/swarm/lab_radio.h"
#include "client_fw/swarm/progress_bar.h"
#include "server/base/format.h"
#include "server/base/number_check.h"

namespace pheromone::swarm {
namespace {

struct LabOptions {
  std::string file;
  std::vector<std::string> settings;
  std::optional<uint64_t> seed;
  int threads = 1;
  std::string summary;
  std::vector<std::string> daemon;  // addresses of its links; none: the engine in this process
  std::string keys;                 // a file, for --daemon; empty: frames are not signed
  LabOutputOptions outputs;
  std::optional<double> every_s;
};

// KEY=VALUE each; --seed is run.seed.
Result<lab::KeyValues> SettingsOf(const LabOptions& options) {
  lab::KeyValues settings;
  for (const std::string& text : options.settings) {
    const size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0) {
      return Error{"--set " + text + ": expected KEY=VALUE, such as robots[1].count=20"};
    }
    settings.emplace_back(text.substr(0, equals), text.substr(equals + 1));
  }
  if (options.seed) {
    settings.emplace_back("run.seed", std::to_string(*options.seed));
  }
  return settings;
}

// Who has the pheromones, and answers as late as it does, leaves nothing to these.
Status CheckForDaemon(const LabOptions& options, const lab::LabScenario& scenario) {
  if (scenario.level != lab::Level::kFirmware) {
    return Error{fmt::format("--daemon: found run.level = \"{}\", expected \"firmware\"",
                             lab::NameOf(scenario.level))};
  }
  if (scenario.world.radio) {
    return Error{
        "--daemon: found radio.model = \"rounds\", expected \"ideal\": the daemon answers "
        "when it does"};
  }
  for (const auto& [option, value, instead] :
       {std::tuple("--maps", &options.outputs.maps, "pheromonectl map export"),
        std::tuple("--frames", &options.outputs.frames, "the dashboard"),
        std::tuple("--mcap", &options.outputs.mcap, "pheromonectl capture, then export")}) {
    if (!value->empty()) {
      return Error{fmt::format("{}: with --daemon, the daemon has the pheromones, expected {}",
                               option, instead)};
    }
  }
  if (!options.summary.empty()) {
    return Error{"--summary: a run with --daemon cannot be repeated by its seed, expected none"};
  }
  return Ok();
}

Result<std::shared_ptr<DaemonLinks>> OpenDaemon(const LabOptions& options,
                                                const lab::LabScenario& scenario) {
  PHEROMONE_TRY(const std::vector<DaemonAddress> addresses, ParseAddresses(options.daemon));
  PHEROMONE_TRY_STATUS(CheckForDaemon(options, scenario));
  return DaemonLinks::Open(addresses, scenario, options.keys);
}

int RunOne(const LabOptions& options) {
  const Result<lab::KeyValues> settings = SettingsOf(options);
  if (!settings.ok()) {
    return Fail(settings.error(), kWrongInput);
  }
  const Result<lab::LabScenario> scenario = lab::LoadLabScenario(options.file, settings.value());
  if (!scenario.ok()) {
    return Fail(scenario.error(), kWrongInput);
  }
  for (const config::Warning& warning : scenario.value().warnings) {
    fmt::print(stderr, "{}\n", warning.text);
  }
  const bool on_air = scenario.value().level == lab::Level::kRadio;
  LabOutputOptions outputs = options.outputs;
  outputs.every_ms = std::llround(options.every_s.value_or(10) * 1000);
  bool has_output = false;
  for (const auto& [option, value] :
       {std::pair("--series", &outputs.series), std::pair("--tracks", &outputs.tracks),
        std::pair("--maps", &outputs.maps), std::pair("--frames", &outputs.frames),
        std::pair("--mcap", &outputs.mcap)}) {
    has_output = has_output || !value->empty();
    if (on_air && !value->empty()) {
      return Fail(std::string(option) + ": run.level = \"radio\" has no such output, expected " +
                      "\"field\" or \"firmware\"",
                  kWrongInput);
    }
  }
  if (options.every_s && !has_output) {
    return Fail("--every " + ShortestText(*options.every_s) +
                    ": found no output, expected --series, --tracks, --maps, --frames or --mcap",
                kWrongInput);
  }
  if (on_air && options.threads != 1) {
    return Fail("--threads " + std::to_string(options.threads) +
                    ": run.level = \"radio\" has one thread, expected 1",
                kWrongInput);
  }
  std::shared_ptr<DaemonLinks> daemon;
  if (!options.daemon.empty()) {
    Result<std::shared_ptr<DaemonLinks>> opened = OpenDaemon(options, scenario.value());
    if (!opened.ok()) {
      return Fail(opened.error(), kWrongInput);
    }
    daemon = std::move(opened.value());
  }
  Result<LabOutputs> writer = LabOutputs::Open(std::move(outputs));
  if (!writer.ok()) {
    return Fail(writer.error(), kFailed);
  }
  const std::function<void(int64_t)> bar = ProgressBar(scenario.value().duration_ms);
  const volatile std::sig_atomic_t* stop = daemon != nullptr ? StopOnSignals() : nullptr;
  std::optional<lab::LabResult> stopped;
  const auto look = [&](const lab::World& world) -> Status {
    if (bar) {
      bar(static_cast<int64_t>(world.time().now_ms()));
    }
    PHEROMONE_TRY_STATUS(writer.value().Look(world));
    if (stop != nullptr && *stop != 0) {
      stopped = lab::ResultOf(world);
      return Error{"stopped"};
    }
    return Ok();
  };
  Result<lab::LabResult> result =
      on_air ? RunLabOnAir(scenario.value(), bar)
             : lab::RunLab(scenario.value(), options.threads, look, daemon);
  const double lag_s = daemon != nullptr ? daemon->lag_s() : 0;
  EndProgressBar(bar);
  if (stopped) {
    result = *stopped;
  }
  const Status finished = writer.value().Finish();
  if (!result.ok()) {
    return Fail(result.error(), kFailed);
  }
  if (!finished.ok()) {
    return Fail(finished.error(), kFailed);
  }
  for (const auto& [name, value] : lab::MeasuresOf(result.value())) {
    if (value) {
      fmt::print("{:<30} {:.6g}\n", name, *value);
    }
  }
  if (daemon != nullptr) {
    fmt::print("{:<30} {:.3f}\n", "lag_s", lag_s);
    const Status answered = daemon->CheckAnswers();
    return answered.ok() ? 0 : Fail(answered.error(), kFailed);
  }
  fmt::print("{:<30} {}\n", "hash", HexText(result.value().hash));
  if (options.summary.empty()) {
    return 0;
  }
  const Status appended = lab::AppendRow(
      options.summary, lab::SummaryOf(scenario.value(), result.value(), lab::SourceCommit()));
  return appended.ok() ? 0 : Fail(appended.error(), kFailed);
}

// Each combination is tried, so that a mistake is told before a thousand runs are begun.
Status CheckRuns(const LabOptions& options, const std::vector<lab::SweepRun>& runs) {
  const lab::KeyValues* checked = nullptr;
  for (const lab::SweepRun& run : runs) {
    if (checked == nullptr || run.settings != *checked) {
      PHEROMONE_TRY_STATUS(lab::LoadLabScenario(options.file, run.settings));
      checked = &run.settings;
    }
  }
  return Ok();
}

int ListRuns(const LabOptions& options) {
  const Result<config::Value> tree = lab::LoadTree(options.file);
  if (!tree.ok()) {
    return Fail(tree.error(), kWrongInput);
  }
  const Result<std::vector<lab::SweepRun>> runs = lab::RunsOf(tree.value(), options.file);
  if (!runs.ok()) {
    return Fail(runs.error(), kWrongInput);
  }
  if (const Status good = CheckRuns(options, runs.value()); !good.ok()) {
    return Fail(good.error(), kWrongInput);
  }
  for (const lab::SweepRun& run : runs.value()) {
    fmt::print("{}\n", lab::CommandOf(run, options.file, options.summary));
  }
  return 0;
}

// The scenario is read whole, so that what the daemon would refuse is told by its place in it.
int PrintConfig(const LabOptions& options) {
  const Result<lab::KeyValues> settings = SettingsOf(options);
  if (!settings.ok()) {
    return Fail(settings.error(), kWrongInput);
  }
  const Result<config::Value> tree = lab::LoadTree(options.file, settings.value());
  if (!tree.ok()) {
    return Fail(tree.error(), kWrongInput);
  }
  const Result<lab::LabScenario> scenario = lab::ReadLabScenario(
      tree.value(), options.file, std::filesystem::path(options.file).parent_path());
  if (!scenario.ok()) {
    return Fail(scenario.error(), kWrongInput);
  }
  const Result<std::vector<DaemonAddress>> addresses = ParseAddresses(options.daemon);
  if (!addresses.ok()) {
    return Fail(addresses.error(), kWrongInput);
  }
  if (const Status room = CheckRoom(scenario.value(), addresses.value().size()); !room.ok()) {
    return Fail(room.error(), kWrongInput);
  }
  fmt::print("{}", DaemonConfig(tree.value(), addresses.value(), options.keys));
  return 0;
}

}  // namespace

void AddLabCommand(CLI::App* app, int* status) {
  CLI::App* command = app->add_subcommand(
      "lab", "Swarms of thousands on the server's own field: run, list, config");
  command->require_subcommand(1);
  auto options = std::make_shared<LabOptions>();
  const auto add = [&](const std::string& name, const std::string& description) {
    CLI::App* one = command->add_subcommand(name, description);
    one->add_option("scenario", options->file,
                    "A TOML file; examples are in client_fw/lab/examples")
        ->required()
        ->type_name("FILE");
    return one;
  };
  CLI::App* run = add("run", "Run a scenario and print what was measured");
  const auto add_set = [&](CLI::App* to) {
    to->add_option("--set", options->settings,
                   "Replace a value of the file, such as robots[1].count=20; any number of times")
        ->allow_extra_args(false)
        ->type_name("KEY=VALUE");
  };
  const auto add_daemon = [&](CLI::App* to, const std::string& description) {
    return to->add_option("--daemon", options->daemon, description)
        ->delimiter(',')
        ->type_name("HOST:PORT[,HOST:PORT...]");
  };
  const auto add_keys = [&](CLI::App* to, const std::string& description) {
    return to->add_option("--keys", options->keys, description)->type_name("FILE");
  };
  add_set(run);
  CLI::Option* daemon =
      add_daemon(run,
                 "In real time, with a running server: the addresses of its links of kind \"udp\", "
                 "one for each 254 robots; HOST:FIRST-LAST for ports in a row");
  add_keys(run,
           "With --daemon: sign frames with the robots' keys in this file, which is like the "
           "server's; robots of all links with the same ID have the same")
      ->needs(daemon);
  run->add_option("--seed", options->seed, "Replace the seed of the file")->type_name("N");
  run->add_option("--threads", options->threads,
                  "That share the work; the results are the same (default: 1)")
      ->check(WholeNumber(1, 256))
      ->type_name("N");
  run->add_option("--summary", options->summary,
                  "Append a row with all parameters, the seed, the commit, what was measured and "
                  "the hash to this CSV file, if it has no such row")
      ->type_name("FILE");
  LabOutputOptions& outputs = options->outputs;
  run->add_option(
         "--series", outputs.series,
         "Write what was measured until then to this CSV file, a row every --every seconds")
      ->type_name("FILE");
  run->add_option("--tracks", outputs.tracks,
                  "Write where each robot is to this CSV file, as often")
      ->type_name("FILE");
  run->add_option("--maps", outputs.maps,
                  "Write the content of each pheromone to PHEROMONE.npy in this folder, as often: "
                  "an array (moments, rows, columns) for NumPy")
      ->type_name("FOLDER");
  run->add_option("--frames", outputs.frames,
                  "Write a picture of each pheromone with the robots to PHEROMONE-00000.png and so "
                  "on in this folder, as often")
      ->type_name("FOLDER");
  run->add_option("--mcap", outputs.mcap,
                  "Write pheromones and robots to this file for Foxglove and others, as often")
      ->type_name("FILE");
  run->add_option("--every", options->every_s, "Seconds between two of these (default: 10)")
      ->check(Number(0.001, 1e6))
      ->type_name("SECONDS");
  run->callback([options, status] { *status = RunOne(*options); });
  CLI::App* list =
      add("list", "Print a command for each run of the scenario's [sweep], for GNU parallel");
  list->add_option("--summary", options->summary, "That each command appends its row to this file")
      ->type_name("FILE");
  list->callback([options, status] { *status = ListRuns(*options); });
  CLI::App* config =
      add("config",
          "Print the configuration of a server for run --daemon: the scenario's map, "
          "pheromones and paths, and links");
  add_set(config);
  add_daemon(config, "The addresses of the links, as for run")->required();
  add_keys(config, "Links that require signing with the keys in this file");
  config->callback([options, status] { *status = PrintConfig(*options); });
}

}  // namespace pheromone::swarm
