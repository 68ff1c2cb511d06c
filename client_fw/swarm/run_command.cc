#include "client_fw/swarm/run_command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "client_fw/boards/host/real_time.h"
#include "client_fw/swarm/command.h"
#include "client_fw/swarm/scenario/report.h"
#include "client_fw/swarm/scenario/run.h"
#include "client_fw/swarm/scenario/scenario.h"

namespace pheromone::swarm {
namespace {

struct RunOptions {
  std::string file;
  std::optional<uint64_t> seed;
  std::vector<std::string> ports;  // of a daemon; none: an engine in process
  bool medium_access = false;
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

// A line a second about a live run; on a terminal it is renewed.
class StatusLine {
 public:
  void Show(const LiveSwarm& live) {
    const Swarm& swarm = live.swarm();
    if (swarm.now_ms() < next_ms_) {
      return;
    }
    next_ms_ = swarm.now_ms() + 1000;
    answers_.resize(swarm.robot_count());
    size_t answered = 0;
    for (size_t i = 0; i < swarm.robot_count(); ++i) {
      const uint32_t answers = swarm.robot(i).counters().answers;
      answered += std::exchange(answers_[i], answers) != answers ? 1u : 0u;
    }
    fmt::print("{}{:6.1f} s  {} of {} robots got answers", terminal_ ? "\r" : "",
               static_cast<double>(swarm.now_ms()) / 1000, answered, swarm.robot_count());
    for (size_t i = 0; i < swarm.channel_count(); ++i) {
      fmt::print("  channel {} {:4.1f} %{}", i + 1, swarm.medium(i).Utilisation() * 100,
                 live.modem(i).connected() ? "" : " NO MODEM");
    }
    fmt::print("{}", terminal_ ? "\x1b[K" : "\n");
    std::fflush(stdout);
  }
  /// After the last one.
  void End() const { fmt::print("{}", terminal_ ? "\n" : ""); }

 private:
  bool terminal_ = isatty(STDOUT_FILENO) != 0;
  int64_t next_ms_ = 1000;
  std::vector<uint32_t> answers_;  // of each robot, a second ago
};

SwarmRecord RunInVirtualTime(const Scenario& scenario) {
  const std::function<void(int64_t)> bar = ProgressBar(scenario.duration_ms);
  SwarmRecord record = RunScenario(scenario, bar);
  if (bar) {
    fmt::print(stderr, "\r{:60}\r", "");
  }
  return record;
}

Result<SwarmRecord> RunAgainstDaemon(const Scenario& scenario, const RunOptions& options) {
  if (const std::string frames = FramesForDaemon(scenario); !frames.empty()) {
    fmt::print(stderr,
               "These robots report coordinates relative to where they are switched on. Add their "
               "frames to the server's configuration, with the names of its links:\n{}",
               frames);
  }
  StatusLine line;
  Result<SwarmRecord> record =
      RunScenarioLive(scenario, options.ports,
                      options.medium_access ? LinkKind::kMediumAccess : LinkKind::kBuffered,
                      StopOnSignals(), [&line](const LiveSwarm& live) { line.Show(live); });
  line.End();
  return record;
}

Result<SwarmRecord> RunOrTellWhyNot(const Scenario& scenario, const RunOptions& options) {
  try {
    return options.ports.empty() ? RunInVirtualTime(scenario) : RunAgainstDaemon(scenario, options);
  } catch (const std::runtime_error& error) {
    return Error{error.what()};
  }
}

// For a live run: a robot without any answer indicates a wrong daemon or port.
int CheckAnswers(const SwarmRecord& record) {
  for (size_t i = 0; i < record.robots.size(); ++i) {
    if (record.robots[i].counters.answers == 0) {
      return Fail(fmt::format("robot {} received no answer", i + 1), kFailed);
    }
  }
  return 0;
}

int Run(const RunOptions& options) {
  Result<Scenario> loaded = LoadScenario(options.file);
  if (!loaded.ok()) {
    return Fail(loaded.error(), kWrongInput);
  }
  Scenario scenario = std::move(loaded.value());
  scenario.seed = options.seed.value_or(scenario.seed);
  for (const config::Warning& warning : scenario.warnings) {
    fmt::print(stderr, "{}\n", warning.text);
  }
  const Result<SwarmRecord> run = RunOrTellWhyNot(scenario, options);
  if (!run.ok()) {
    return Fail(run.error(), kFailed);
  }
  const SwarmRecord& record = run.value();
  const std::string summary = Summarise(scenario, record);
  fmt::print("{}", summary);
  if (!options.out.empty()) {
    const int written = WriteFiles(options.out, {{"summary.txt", summary},
                                                 {"robots.csv", RobotsToCsv(scenario, record)},
                                                 {"tracks.csv", TracksToCsv(record)},
                                                 {"exchanges.csv", ExchangesToCsv(record)},
                                                 {"map.svg", DrawScenario(scenario, record)}});
    if (written != 0) {
      return written;
    }
  }
  return options.ports.empty() ? 0 : CheckAnswers(record);
}

}  // namespace

void AddRunCommand(CLI::App* app, int* status) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command = app->add_subcommand(
      "run",
      "Run a scenario from a file, in virtual time or against a running server; prints a summary");
  command
      ->add_option("scenario", options->file,
                   "A TOML file, pheromone-scenario(5); examples are in client_fw/swarm/examples")
      ->required();
  command->add_option("--seed", options->seed, "Override the seed of the file");
  CLI::Option* daemon =
      command
          ->add_option("--daemon", options->ports,
                       "Run in real time against a running server, until Ctrl-C or the end of the "
                       "scenario: for each channel, the terminal device of its link")
          ->delimiter(',')
          ->check(TerminalDevice())
          ->type_name("PORT[,PORT...]");
  command
      ->add_flag("--medium-access", options->medium_access,
                 "With --daemon: its links have medium_access = true, so robots take turns")
      ->needs(daemon);
  command->add_option("--out", options->out,
                      "Folder for summary.txt, robots.csv, tracks.csv, exchanges.csv and map.svg");
  command->callback([options, status] { *status = Run(*options); });
}

}  // namespace pheromone::swarm
