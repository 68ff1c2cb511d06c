// pheromone-experiments cleaning: robots that clean a grid of zones, in virtual time.
#include "client_fw/swarm/command.h"

#include <fmt/format.h>

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "client_fw/boards/host/real_time.h"
#include "client_fw/experiments/cleaning/experiment.h"
#include "client_fw/experiments/cleaning/floor.h"
#include "client_fw/experiments/cleaning/prove.h"
#include "client_fw/experiments/cleaning/report.h"
#include "client_fw/experiments/cleaning/sweep.h"
#include "client_fw/experiments/commands.h"
#include "server/base/number_check.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kTrackSampleMs = 1000;
constexpr char kKeysHelp[] =
    "With --daemon: sign frames with the robots' keys in this file, which is like the server's";

struct CleaningOptions {
  CleaningExperiment base;
  double cleaning_s = 10;
  double seconds = 1200;
  double unit_s = 3;
  double frame_loss_percent = 0;
  int turnaround_ms = 2;
  int server_delay_ms = 2;
  uint64_t seed = 1;
  int switched_off = 1;
  double switch_off_s = 0;
  bool sweep = false;
  int seeds = 5;
  int cycles = 20;
  std::string floor;
  bool server_config = false;
  std::vector<std::string> ports;
  std::string keys;
  ProveOptions prove;
  std::string out;
};

CleaningExperiment ExperimentOf(const CleaningOptions& options) {
  CleaningExperiment experiment = options.base;
  const auto ms = [](double seconds) { return static_cast<int64_t>(seconds * 1000); };
  experiment.cleaning_ms = ms(options.cleaning_s);
  experiment.duration_ms = ms(options.seconds);
  experiment.soil.unit_ms = ms(options.unit_s);
  experiment.frame_loss = options.frame_loss_percent / 100;
  experiment.timing.turnaround_ns = int64_t{options.turnaround_ms} * 1'000'000;
  experiment.timing.server_delay_ns = int64_t{options.server_delay_ms} * 1'000'000;
  if (options.switch_off_s > 0) {
    experiment.switch_off = {options.switched_off - 1, ms(options.switch_off_s)};
  }
  return experiment;
}

// The exit status: what must never happen is an error of the run.
int StatusOf(const std::vector<CleaningRun>& runs) {
  for (const CleaningRun& run : runs) {
    if (run.together_ms != 0) {
      return Fail(fmt::format("two robots cleaned one zone at the same time, for {} ms in all",
                              run.together_ms),
                  kFailed);
    }
    if (run.misplaced != 0) {
      return Fail(fmt::format("robots cleaned another zone than the one that they had claimed, {} "
                              "times",
                              run.misplaced),
                  kFailed);
    }
  }
  return 0;
}

int RunOnce(const CleaningOptions& options) {
  CleaningExperiment experiment = ExperimentOf(options);
  if (!options.floor.empty()) {
    const Result<CleaningFloor> floor = LoadFloor(options.floor);
    if (!floor.ok()) {
      return Fail(floor.error(), kWrongInput);
    }
    const Result<CleaningExperiment> own = ExperimentOf(floor.value(), experiment);
    if (!own.ok()) {
      return Fail(own.error(), kWrongInput);
    }
    experiment = own.value();
  }
  const std::string wrong = WhatIsWrong(experiment);
  if (!wrong.empty()) {
    return Fail(wrong, kWrongInput);
  }
  if (options.server_config) {
    fmt::print("{}", ServerText(experiment));
    return 0;
  }
  experiment.sample_ms = kTrackSampleMs;
  const auto on_second = [&](int64_t second) {
    if (second % 10 == 0 || !options.ports.empty()) {
      ShowProgress(fmt::format("{} of {:.0f} s", second, options.seconds));
    }
  };
  const Result<CleaningRun> done = options.ports.empty()
                                       ? RunCleaning(experiment, options.seed, on_second)
                                       : RunCleaningLive(experiment, options.seed, options.ports,
                                                         options.keys, StopOnSignals(), on_second);
  ShowProgress("");
  if (!done.ok()) {
    return Fail(done.error(), kFailed);
  }
  const CleaningRun& run = done.value();
  experiment.duration_ms = run.end_ms;
  fmt::print("{}", ToTable(experiment, run));
  int written = 0;
  if (!options.out.empty()) {
    written = WriteFiles(options.out, {{"cleaning-zones.csv", ZonesToCsv(experiment, run)},
                                       {"cleaning-cleanings.csv", CleaningsToCsv(run)},
                                       {"cleaning-soil.csv", SoilToCsv(experiment, run)},
                                       {"cleaning-tracks.csv", TracksToCsv(experiment, run)}});
  }
  const int status = StatusOf({run});
  return status != 0 ? status : written;
}

int RunSweepOfSizes(const CleaningOptions& options) {
  const std::vector<CleaningExperiment> sizes = CleaningSizes(ExperimentOf(options));
  for (const CleaningExperiment& size : sizes) {
    const std::string wrong = WhatIsWrong(size);
    if (!wrong.empty()) {
      return Fail(wrong, kWrongInput);
    }
  }
  std::vector<CleaningSeries> all;
  fmt::print("{}", ToTableHead());
  int status = 0;
  for (const CleaningExperiment& size : sizes) {
    all.push_back(RunSeries(size, options.cycles, options.seeds, [&](int done, int64_t second) {
      if (second % 10 == 0) {
        ShowProgress(fmt::format("{}/{} {} x {}: {} of {} runs, {} s", all.size() + 1, sizes.size(),
                                 size.grid.columns, size.grid.rows, done, options.seeds, second));
      }
    }));
    ShowProgress("");
    fmt::print("{}", ToTableRow(all.back()));
    std::fflush(stdout);
    status = status != 0 ? status : StatusOf(all.back().runs);
  }
  const int written =
      options.out.empty() ? 0 : WriteFiles(options.out, {{"cleaning-sweep.csv", ToCsv(all)}});
  return status != 0 ? status : written;
}

}  // namespace

// What a floor's file says instead.
void AddFloorOptions(CLI::App* command, const std::vector<CLI::Option*>& in_file,
                     CLI::Option* sweep, CleaningOptions* options) {
  CLI::Option* floor = command->add_option(
      "--floor", options->floor, "Simulate the floor of this file: zones, soil, robots and times");
  CLI::Option* prove = command->add_option(
      "--prove", options->prove.file,
      "Prove what robots do on the floor of this file, in all states that they can come to");
  floor->type_name("FILE")->excludes(sweep);
  prove->type_name("FILE");
  for (CLI::Option* option : in_file) {
    option->excludes(floor);
  }
  CLI::Option* server = command->add_flag(
      "--server-config", options->server_config,
      "Print the configuration of a server for --daemon, with a tag in each zone, and end");
  server->excludes(sweep);
  CLI::Option* daemon = command->add_option(
      "--daemon", options->ports,
      "Run in real time against a running server of that configuration: for each channel, the "
      "terminal device of its link");
  daemon->delimiter(',')
      ->check(TerminalDevice())
      ->type_name("PORT[,PORT...]")
      ->excludes(sweep)
      ->excludes(server);
  command->add_option("--keys", options->keys, kKeysHelp)->type_name("FILE")->needs(daemon);
  // A proof is about what the file says.
  for (CLI::Option* option : command->get_options()) {
    if (option != prove && option != command->get_help_ptr() && option->get_name() != "--out") {
      option->excludes(prove);
    }
  }
  command
      ->add_option("--query", options->prove.queries,
                   "With --prove: of clean, bounded, for-ever, forgotten and crash only these")
      ->delimiter(',')
      ->check(CLI::IsMember({"clean", "bounded", "for-ever", "forgotten", "crash"}))
      ->needs(prove);
  command
      ->add_option("--memory-mib", options->prove.memory_mib,
                   "With --prove: memory after which a verdict is unknown (default: 2048)")
      ->check(WholeNumber(1, 1'000'000))
      ->needs(prove);
}

void AddCleaningCommand(CLI::App* app, int* status) {
  auto options = std::make_shared<CleaningOptions>();
  CleaningExperiment& base = options->base;
  CLI::App* command = app->add_subcommand(
      "cleaning",
      "Robots that clean a grid of zones, coordinated by virtual tags alone, in virtual time; "
      "prints how long zones wait and how much they soil");
  std::vector<CLI::Option*> single;  // that --sweep decides itself
  const auto add = [&](auto* option) { single.push_back(option); };
  std::vector<CLI::Option*> in_file;  // that a floor's file says
  const auto add_in_file = [&](auto* option) { in_file.push_back(option); };
  add_in_file(command->add_option("--columns", base.grid.columns, "Columns of zones (default: 4)")
                  ->check(WholeNumber(1, 50)));
  add_in_file(command->add_option("--rows", base.grid.rows, "Rows of zones (default: 3)")
                  ->check(WholeNumber(1, 50)));
  add_in_file(
      command->add_option("--robots", base.robots, "Robots, at most one a zone (default: 2)")
          ->check(WholeNumber(1, 254)));
  single = in_file;
  add_in_file(command->add_option("--zone", base.grid.zone_m, "Side of a zone, m (default: 1)")
                  ->check(Number(1.0, 4.0)));
  add_in_file(
      command->add_option("--cleaning-s", options->cleaning_s, "Time to clean a zone (default: 10)")
          ->check(Number(0.1, 60.0)));
  add_in_file(command
                  ->add_option("--lease-s", base.lease_s,
                               "Lease of a claim (default: twice the time to clean, and 2)")
                  ->check(WholeNumber(2, 3600)));
  command->add_option("--speed", base.speed_mm_s, "Speed, mm/s (default: 300)")
      ->check(WholeNumber(50, 1000));
  CLI::Option* slots =
      command->add_option("--slots", base.slots, "Slots of each tag (default: 8; --sweep: 2)")
          ->check(WholeNumber(2, 64));
  add(command->add_option("--seconds", options->seconds, "Length of the run (default: 1200)")
          ->check(Number(1.0, 360'000.0)));
  add_in_file(command
                  ->add_option("--unit-s", options->unit_s,
                               "Unit of time in which zones soil: 5 or 10 % every 15 (default: 3)")
                  ->check(Number(0.01, 3600.0)));
  add_in_file(
      command->add_option("--soil", base.soil.start_percent, "Soil at the start, % (default: 20)")
          ->check(Number(0.0, 100.0)));
  add_in_file(command
                  ->add_option("--threshold", base.soil.threshold_percent,
                               "Soil to stay below, % (default: 51)")
                  ->check(Number(0.0, 100.0)));
  add(command->add_option("--seed", options->seed, "Of all that is random (default: 1)"));
  add(command
          ->add_option("--switch-off-s", options->switch_off_s,
                       "Switch a robot off after so many seconds")
          ->check(Number(0.001, 360'000.0)));
  add(command->add_option("--switched-off", options->switched_off, "Which robot (default: 1)")
          ->check(WholeNumber(1, 254)));
  CLI::Option* baud = command
                          ->add_option("--baud", base.timing.baud,
                                       "Baud rate of each channel (default: 9600; --sweep: 57600)")
                          ->check(WholeNumber(1200, 115'200));
  add(command->add_option("--channels", base.channels, "Radio channels (default: 1)")
          ->check(WholeNumber(1, 64)));
  command
      ->add_option("--frame-loss-percent", options->frame_loss_percent,
                   "Frames that each listener misses")
      ->check(Number(0.0, 90.0));
  command
      ->add_option("--turnaround-ms", options->turnaround_ms,
                   "Modem turnaround time T_t (default: 2)")
      ->check(WholeNumber(1, 100));
  command
      ->add_option("--server-delay-ms", options->server_delay_ms, "Server delay D_s (default: 2)")
      ->check(WholeNumber(0, 100));
  CLI::Option* period =
      command
          ->add_option("--period-ms", base.period_ms,
                       "Between a robot's requests for intensities (default: 200; --sweep: 100)")
          ->check(WholeNumber(20, 5000));
  CLI::Option* sweep = command->add_flag(
      "--sweep", options->sweep, "Grids from 4 x 3 with 2 robots to 20 x 20 with 66 instead");
  for (CLI::Option* option : single) {
    option->excludes(sweep);
  }
  command->add_option("--seeds", options->seeds, "With --sweep: runs of each size (default: 5)")
      ->check(WholeNumber(1, 1000))
      ->needs(sweep);
  command
      ->add_option("--cycles", options->cycles,
                   "With --sweep: length of a run in ideal cycles (default: 20)")
      ->check(WholeNumber(1, 100'000))
      ->needs(sweep);
  command->add_option(
      "--out", options->out,
      "Folder for cleaning-zones.csv, cleaning-cleanings.csv, cleaning-soil.csv and "
      "cleaning-tracks.csv; with --sweep for cleaning-sweep.csv, with --prove for "
      "cleaning-proof.csv, cleaning-proved-zones.csv and a picture of each trace");
  AddFloorOptions(command, in_file, sweep, options.get());
  command->footer(
      "A gap is the time from the end of a zone's cleaning to the begin of the next. An ideal "
      "cycle "
      "is the time in which the robots would clean all zones once if they did nothing but drive at "
      "full speed and clean. Exit status 1: two robots cleaned one zone, or --prove found a claim "
      "refuted; 3: its memory was not "
      "enough for a verdict.");
  command->callback([=] {
    if (!options->prove.file.empty()) {
      options->prove.out = options->out;
      *status = Prove(options->prove);
      return;
    }
    if (options->sweep) {  // many robots on a channel, on the tags of many authors
      CleaningExperiment& swept = options->base;
      swept.slots = slots->count() != 0 ? swept.slots : 2;
      swept.timing.baud = baud->count() != 0 ? swept.timing.baud : 57'600;
      swept.period_ms = period->count() != 0 ? swept.period_ms : uint16_t{100};
    }
    *status = options->sweep ? RunSweepOfSizes(*options) : RunOnce(*options);
  });
}

}  // namespace pheromone::swarm
