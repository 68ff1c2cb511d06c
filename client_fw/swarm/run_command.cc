// pheromone-swarm run: robots in a scenario from a file, in virtual time.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "client_fw/boards/host/real_time.h"
#include "client_fw/swarm/capacity.h"
#include "client_fw/swarm/command.h"
#include "client_fw/swarm/commands.h"
#include "client_fw/swarm/own_server.h"
#include "client_fw/swarm/progress_bar.h"
#include "client_fw/swarm/scenario/report.h"
#include "client_fw/swarm/scenario/run.h"
#include "client_fw/swarm/scenario/scenario.h"
#include "server/base/number_check.h"
#include "server/base/standard_output.h"

namespace pheromone::swarm {
namespace {

struct RunOptions {
  std::string file;
  SwarmWish wish{.robots = 0};  // or so many for one's own server
  std::optional<uint64_t> seed;
  std::vector<std::string> ports;  // of a daemon; none: an engine in process
  std::string keys;                // a file; empty: frames are not signed
  bool medium_access = false;
  std::string out;
};

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
    fmt::print(Unescaped(stdout), "{}{:6.1f} s  {} of {} robots got answers", terminal_ ? "\r" : "",
               static_cast<double>(swarm.now_ms()) / 1000, answered, swarm.robot_count());
    for (size_t i = 0; i < swarm.channel_count(); ++i) {
      fmt::print(Unescaped(stdout), "  channel {} {:4.1f} %{}", i + 1,
                 swarm.medium(i).Utilisation() * 100, live.modem(i).connected() ? "" : " NO MODEM");
    }
    fmt::print(Unescaped(stdout), "{}", terminal_ ? "\x1b[K" : "\n");
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
  EndProgressBar(bar);
  return record;
}

// Says once that robots are stopped because they are too many for the channel.
class StopReason {
 public:
  explicit StopReason(const ChannelLoad& load) : why_(WhyItDoesNotFit(load)) {}

  void Show(const Swarm& swarm) {
    for (size_t i = 0; i < swarm.robot_count() && !why_.empty(); ++i) {
      if (swarm.robot(i).counters().fail_safe_stops != 0) {
        fmt::print(stderr, "{}{}\n", isatty(STDOUT_FILENO) != 0 ? "\n" : "",
                   std::exchange(why_, ""));
      }
    }
  }

 private:
  std::string why_;
};

// A scenario, and its load if it runs against a server.
struct Task {
  Scenario scenario;
  ChannelLoad load;
};

Result<SwarmRecord> RunAgainstDaemon(const Task& task, const RunOptions& options) {
  const auto& [scenario, load] = task;
  if (const std::string frames = FramesForDaemon(scenario); !frames.empty()) {
    fmt::print(stderr,
               "These robots report coordinates relative to where they are switched on. Add their "
               "frames to the server's configuration, with the names of its links:\n{}",
               frames);
  }
  StatusLine line;
  StopReason reason(load);
  Result<SwarmRecord> record = RunScenarioLive(scenario, options.ports, options.keys, load.access,
                                               StopOnSignals(), [&](const LiveSwarm& live) {
                                                 line.Show(live);
                                                 reason.Show(live.swarm());
                                               });
  line.End();
  return record;
}

Result<SwarmRecord> RunOrTellWhyNot(const Task& task, const RunOptions& options) {
  try {
    return options.ports.empty() ? RunInVirtualTime(task.scenario)
                                 : RunAgainstDaemon(task, options);
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

// Of a live run: that robots were stopped, and why.
void TellStops(const SwarmRecord& record, const ChannelLoad& load) {
  uint64_t stops = 0;
  size_t stopped = 0;
  for (const RobotRecord& robot : record.robots) {
    stops += robot.counters.fail_safe_stops;
    stopped += robot.counters.fail_safe_stops != 0 ? 1u : 0u;
  }
  if (stops == 0) {
    return;
  }
  const std::string why = WhyItDoesNotFit(load);
  fmt::print(stderr,
             "{} of {} robots had no answer for {:.2f} s and stopped, {} stops in all. {}\n",
             stopped, record.robots.size(), static_cast<double>(load.fail_safe_ms) / 1000, stops,
             !why.empty() ? why
                          : "The channel has room for so many: frames were lost, or the server was "
                            "late (pheromonectl doctor).");
}

Result<Task> TaskForServer(RunOptions* options) {
  PHEROMONE_TRY(OwnSwarm swarm, SwarmForServer(options->wish));
  options->ports = swarm.ports;
  fmt::print(stderr, "{} robots on {}, {}, asking every {:.2f} s\n", options->wish.robots,
             fmt::join(swarm.links, ", "),
             swarm.load.access == LinkKind::kMediumAccess ? "in rounds" : "by contention",
             static_cast<double>(swarm.load.period_ms) / 1000);
  if (!swarm.why_slower.empty()) {
    fmt::print(stderr, "At 0.2 s, they would stop: {}\n", swarm.why_slower);
  }
  return Task{std::move(swarm.scenario), swarm.load};
}

Result<Task> TaskOf(RunOptions* options) {
  if (options->wish.robots != 0) {
    return TaskForServer(options);
  }
  PHEROMONE_TRY(Scenario scenario, LoadScenario(options->file));
  ChannelLoad load =
      LoadOf(scenario, options->medium_access ? LinkKind::kMediumAccess : LinkKind::kBuffered);
  load.is_signed = options->wish.is_signed;
  return Task{std::move(scenario), load};
}

int Run(RunOptions options) {
  const bool own_server = options.wish.robots != 0;
  if (options.file.empty() != own_server) {
    return Fail(own_server ? "found a scenario and --robots, expected one of them"
                           : "found neither a scenario nor --robots, expected one of them: "
                             "pheromone-swarm run --robots 12 drives on your running server",
                kWrongInput);
  }
  if (!options.keys.empty() && options.ports.empty() && !own_server) {
    return Fail("--keys: a run in virtual time has no signed links, expected --daemon or --robots",
                kWrongInput);
  }
  options.wish.is_signed = !options.keys.empty();
  Result<Task> task = TaskOf(&options);
  if (!task.ok()) {
    return Fail(task.error(), own_server ? kFailed : kWrongInput);
  }
  Scenario& scenario = task.value().scenario;
  scenario.seed = options.seed.value_or(scenario.seed);
  for (const config::Warning& warning : scenario.warnings) {
    fmt::print(stderr, "{}\n", warning.text);
  }
  const Result<SwarmRecord> run = RunOrTellWhyNot(task.value(), options);
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
  if (options.ports.empty()) {
    return 0;
  }
  TellStops(record, task.value().load);
  return CheckAnswers(record);
}

}  // namespace

void AddRunCommand(CLI::App* app, int* status) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command = app->add_subcommand(
      "run",
      "Run a scenario from a file, in virtual time or against a running server; prints a summary");
  command
      ->add_option("scenario", options->file,
                   "A TOML file, pheromone-scenario(5); examples are in "
                   "client_fw/swarm/examples")
      ->type_name("FILE");
  CLI::Option* robots = command->add_option(
      "--robots", options->wish.robots,
      "Instead of a scenario: so many robots on the paths of your running server, which is "
      "asked for its map, its pheromones and its virtual modems");
  robots->check(WholeNumber(1, 254))->type_name("N");
  command
      ->add_option("--socket", options->wish.socket,
                   "The server's control socket (default: as pheromonectl finds it)")
      ->needs(robots)
      ->type_name("PATH");
  command->add_option("--pheromone", options->wish.pheromone, "With --robots: which they follow")
      ->needs(robots)
      ->type_name("N|NAME");
  command
      ->add_option(
          "--period", options->wish.period_s,
          "With --robots: seconds between two requests of a robot (default: 0.2, or the least "
          "that the server's links hold)")
      ->needs(robots)
      ->check(Number(0.02, kMaxPeriodMs / 1000.0))
      ->type_name("S");
  command
      ->add_option("--seconds", options->wish.seconds,
                   "With --robots: stop after this time (default: on Ctrl-C)")
      ->needs(robots)
      ->check(Number(0.1, 1e5))
      ->type_name("S");
  command->add_option("--seed", options->seed, "Override the seed of the file")->type_name("N");
  CLI::Option* daemon =
      command
          ->add_option("--daemon", options->ports,
                       "Run in real time against a running server, until Ctrl-C or the end of the "
                       "scenario: for each channel, the terminal device of its link")
          ->delimiter(',')
          ->check(TerminalDevice())
          ->type_name("PORT[,PORT...]")
          ->excludes(robots);
  command
      ->add_option("--keys", options->keys,
                   "With --daemon or --robots: sign frames with the robots' keys in this file, "
                   "which is like the server's")
      ->type_name("FILE");
  command
      ->add_flag("--medium-access", options->medium_access,
                 "With --daemon: its links have medium_access = true, so robots take turns")
      ->needs(daemon);
  command
      ->add_option("--out", options->out,
                   "Folder for summary.txt, robots.csv, tracks.csv, exchanges.csv and map.svg")
      ->type_name("FOLDER");
  command->callback([options, status] { *status = Run(*options); });
}

}  // namespace pheromone::swarm
