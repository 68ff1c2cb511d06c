// pheromone-experiments trails: the two-trail bench, driven or by timetable, in virtual or real
// time.
#include "client_fw/swarm/command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "client_fw/boards/host/real_time.h"
#include "client_fw/experiments/commands.h"
#include "client_fw/experiments/trails/experiment.h"
#include "client_fw/experiments/trails/report.h"
#include "client_fw/experiments/trails/story.h"
#include "client_fw/experiments/trails/sweep.h"
#include "client_fw/experiments/trails/timetable.h"
#include "client_fw/experiments/trails/trips.h"
#include "server/base/number_check.h"
#include "server/base/standard_output.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kSnapshotMs = 60'000;
constexpr size_t kDrawnSnapshot = 4;  // once robots are everywhere

const std::map<std::string, petri::EvaporationLaw>& EvaporationLaws() {
  static const auto& laws = *[] {
    auto* const all = new std::map<std::string, petri::EvaporationLaw>;
    for (int i = 0; i <= static_cast<int>(petri::kLastEvaporationLaw); ++i) {
      const auto law = static_cast<petri::EvaporationLaw>(i);
      all->emplace(petri::NameOf(law), law);
    }
    return all;
  }();
  return laws;
}

struct TrailsOptions {
  std::string bench;
  std::optional<int> robots;
  std::optional<petri::EvaporationLaw> law;
  std::optional<double> rate;
  std::optional<double> dead_band;
  std::optional<uint32_t> source;
  client::DepositRule deposit = client::DepositRule::kEqual;
  int burn_per_s = 1;
  int capacity = 100;
  int explore_percent = 0;
  int speed_mm_s = 400;
  int channels = 0;
  std::optional<double> seconds;
  uint64_t trips = 0;
  int avr_robots = 0;
  int seeds = 25;
  int64_t baud = 9600;
  uint64_t seed = 1;
  double frame_loss_percent = 0;
  double trail_a_s = 20;
  double trail_b_s = 40;
  double stop_s = 0;
  bool timetable = false;
  bool parking = false;
  bool sweep = false;
  bool story = false;
  bool by_robots = false;
  bool frames = false;
  std::vector<std::string> ports;
  std::string keys;
  std::string out;
};

int64_t Ms(double seconds) {
  return std::llround(1000 * seconds);
}

client::NetRobotParameters RobotOf(const TrailsOptions& options) {
  client::NetRobotParameters robot;
  robot.rule = options.deposit;
  robot.burn_per_s = static_cast<uint16_t>(options.burn_per_s);
  robot.capacity = static_cast<uint16_t>(options.capacity);
  robot.explore_percent = static_cast<uint8_t>(options.explore_percent);
  return robot;
}

Result<TrailsRules> RulesOf(const TrailsBench& bench, const TrailsOptions& options) {
  Result<TrailsRules> found = RulesOf(bench);
  if (!found.ok()) {
    return found;
  }
  TrailsRules rules = found.value();
  const auto milli = [](double value) { return static_cast<uint32_t>(std::llround(1000 * value)); };
  rules.robots = options.robots.value_or(rules.robots);
  rules.law = options.law.value_or(rules.law);
  rules.rate_milli = options.rate ? milli(*options.rate) : rules.rate_milli;
  rules.dead_band_milli = options.dead_band ? milli(*options.dead_band) : rules.dead_band_milli;
  if (options.source) {
    rules.has_source = true;
    rules.source = *options.source;
  }
  rules.exploring = options.explore_percent > 0;
  return rules;
}

int Report(const TrailsOptions& options, const TrailsBench& bench, const TrailsRun& run) {
  fmt::print("{}", ToTable(run));
  int written = 0;
  if (!options.out.empty()) {
    std::vector<std::pair<std::string, std::string>> files = {
        {"trails-deposits.csv", DepositsToCsv(run)}};
    if (!run.samples.empty()) {
      files.emplace_back("trails-samples.csv", SamplesToCsv(run.samples));
    }
    if (!run.snapshots.empty()) {
      files.emplace_back(
          "trails-bench.csv",
          BenchToCsv(bench, run.snapshots[std::min(kDrawnSnapshot, run.snapshots.size() - 1)]));
    }
    written = WriteFiles(options.out, files);
  }
  return written;
}

// A line a second, of which the last one stays on a terminal.
class TrailsStatusLine {
 public:
  explicit TrailsStatusLine(int robots) : answers_(static_cast<size_t>(robots)) {}

  void Show(const TrailsMoment& moment) {
    size_t answered = 0;
    for (size_t i = 0; i < answers_.size(); ++i) {
      const uint32_t answers = moment.swarm.robot(i).counters().answers;
      answered += std::exchange(answers_[i], answers) != answers ? 1u : 0u;
    }
    const TrailsLedger& ledger = moment.ledger;
    fmt::print(Unescaped(stdout),
               "{}{:7.1f} s  {} of {} robots got answers  {} round trips  {} deposits of {} units"
               "  on A {}, on B {}  {} refusals{}",
               terminal_ ? "\r" : "", static_cast<double>(moment.time_ms) / 1000, answered,
               answers_.size(), ledger.trips(), ledger.deposits().size(), ledger.deposited(),
               ledger.robots_on(BenchTrail::kA), ledger.robots_on(BenchTrail::kB),
               ledger.refusals(), terminal_ ? "\x1b[K" : "\n");
  }
  void End() const { fmt::print("{}", terminal_ ? "\n" : ""); }

 private:
  bool terminal_ = isatty(STDOUT_FILENO) != 0;
  std::vector<uint32_t> answers_;  // of each robot, a second ago
};

TrailsExperiment ExperimentOf(const TrailsOptions& options, const TrailsRules& rules) {
  TrailsExperiment experiment;
  experiment.rules = rules;
  experiment.robot = RobotOf(options);
  experiment.speed_mm_s = static_cast<int16_t>(options.speed_mm_s);
  experiment.timing.baud = options.baud;
  experiment.channels = options.channels;
  experiment.frame_loss = options.frame_loss_percent / 100;
  experiment.avr_robots = options.avr_robots;
  experiment.trips = options.trips;
  experiment.duration_ms = options.seconds ? Ms(*options.seconds)
                           : options.trips ? INT64_MAX
                                           : experiment.duration_ms;
  return experiment;
}

int RunDriven(const TrailsOptions& options, const TrailsBench& bench, const TrailsRules& rules) {
  TrailsExperiment experiment = ExperimentOf(options, rules);
  experiment.snapshot_ms = options.out.empty() ? 0 : kSnapshotMs;
  if (const std::string wrong = WhatIsWrong(bench, experiment); !wrong.empty()) {
    return Fail(wrong, kWrongInput);
  }
  if (options.frames) {
    for (const engine::RobotFrame& frame : FramesOf(bench, experiment)) {
      fmt::print(
          "[[frame]]\nlink = \"{}\"\nid = {}\nx_m = {:.6f}\ny_m = {:.6f}\n"
          "heading_deg = {:.3f}\n",
          frame.link, frame.id, static_cast<double>(frame.x_um) / 1e6,
          static_cast<double>(frame.y_um) / 1e6, frame.heading * 360.0 / 65536);
    }
    return 0;
  }
  TrailsStatusLine line(rules.robots);
  const bool live = !options.ports.empty();
  const bool shown = live || isatty(STDOUT_FILENO) != 0;
  const auto show = [&](const TrailsMoment& moment) {
    if (shown) {
      line.Show(moment);
    }
  };
  const Result<TrailsRun> run =
      live ? RunTrailsLive(bench, experiment, options.ports, options.keys, StopOnSignals(), show)
           : RunTrails(bench, experiment, options.seed, show);
  if (shown) {
    line.End();
  }
  if (!run.ok()) {
    return Fail(run.error(), kFailed);
  }
  const int written = Report(options, bench, run.value());
  const bool sound = live ? IsSoundByRobots(run.value()) : IsSound(run.value());
  return sound ? written
               : Fail("robots touched, records were refused, or deposits were lost", kFailed);
}

int RunByTimetable(const TrailsOptions& options, const TrailsBench& bench,
                   const TrailsRules& rules) {
  Timetable timetable;
  timetable.rules = rules;
  timetable.robot = RobotOf(options);
  timetable.trail_s = {options.trail_a_s, options.trail_b_s};
  timetable.parking = options.parking;
  timetable.duration_ms = options.seconds ? Ms(*options.seconds) : timetable.duration_ms;
  timetable.sample_ms = 1000;
  if (options.stop_s > 0) {
    timetable.stop = {0, Ms(options.stop_s)};
  }
  const Result<TrailsRun> run = RunTimetable(bench, timetable, options.seed);
  if (!run.ok()) {
    return Fail(run.error(), kFailed);
  }
  const int written = Report(options, bench, run.value());
  return IsSound(run.value()) ? written : Fail("records were refused", kFailed);
}

int RunSweep(const TrailsOptions& options, const TrailsBench& bench) {
  const std::vector<LockInCase> cases = LockInCases();
  const size_t runs = cases.size() * static_cast<size_t>(options.seeds);
  const Result<std::vector<LockInRow>> rows =
      CountLockIn(bench, cases, options.seeds,
                  [&](size_t done) { ShowProgress(fmt::format("{} of {} runs", done, runs)); });
  ShowProgress("");
  if (!rows.ok()) {
    return Fail(rows.error(), kFailed);
  }
  fmt::print("{}", LockInToTable(rows.value()));
  if (!options.out.empty()) {
    const int written =
        WriteFiles(options.out, {{"trails-lock-in.csv", LockInToCsv(rows.value())}});
    if (written != 0) {
      return written;
    }
  }
  const LockInRow all = Sum(rows.value(), [](const LockInCase&) { return true; });
  return all.exceptions == 0 ? 0 : Fail(fmt::format("{} exceptions", all.exceptions), kFailed);
}

int RunByRobots(const TrailsOptions& options, const TrailsBench& bench, const TrailsRules& rules) {
  const Result<std::vector<TripsPoint>> points =
      CountTrips(bench, ExperimentOf(options, rules), options.seeds, [](const TripsPoint& point) {
        fmt::print(
            "{} robots, round trips an hour on A and B: driven {:.0f}, {:.0f}; by timetable "
            "{:.0f}, "
            "{:.0f}\n",
            point.robots, point.driven[0], point.driven[1], point.timetable[0], point.timetable[1]);
        std::fflush(stdout);
      });
  if (!points.ok()) {
    return Fail(points.error(), kFailed);
  }
  return options.out.empty()
             ? 0
             : WriteFiles(options.out, {{"trails-trips.csv", TripsToCsv(points.value())}});
}

int RunStory(const TrailsOptions& options, const TrailsBench& bench) {
  const Result<TrailsStory> story = TellStory(bench);
  if (!story.ok()) {
    return Fail(story.error(), kFailed);
  }
  for (const StoryMark& mark : story.value().marks) {
    fmt::print("{:6.1f} s  {}\n", static_cast<double>(mark.time_ms) / 1000, mark.label);
  }
  return options.out.empty()
             ? 0
             : WriteFiles(options.out,
                          {{"trails-story.csv", SamplesToCsv(story.value().samples)},
                           {"trails-story-marks.csv", MarksToCsv(story.value().marks)}});
}

int Run(const TrailsOptions& options) {
  const Result<TrailsBench> bench = LoadBench(options.bench);
  if (!bench.ok()) {
    return Fail(bench.error(), kWrongInput);
  }
  const Result<TrailsRules> rules = RulesOf(bench.value(), options);
  if (!rules.ok()) {
    return Fail(rules.error(), kWrongInput);
  }
  try {
    return options.story       ? RunStory(options, bench.value())
           : options.sweep     ? RunSweep(options, bench.value())
           : options.by_robots ? RunByRobots(options, bench.value(), rules.value())
           : options.timetable ? RunByTimetable(options, bench.value(), rules.value())
                               : RunDriven(options, bench.value(), rules.value());
  } catch (const std::runtime_error& error) {  // an AVR's image
    return Fail(error.what(), kFailed);
  }
}

}  // namespace

void AddTrailsCommand(CLI::App* app, int* status) {
  auto options = std::make_shared<TrailsOptions>();
  CLI::App* command = app->add_subcommand(
      "trails",
      "Robots that carry energy by a short or a long trail, guided by Petri nets on tags: driven "
      "over the radio, in virtual time or against a running pheromoned, or by timetable");
  command
      ->add_option("--bench", options->bench,
                   "The server's configuration with floor, trails, tags and nets, such as "
                   "deploy/examples/bench.toml")
      ->required();
  command->add_option("--robots", options->robots, "Robots (default: the file's)")
      ->check(WholeNumber(1, 254));
  command
      ->add_option("--law", options->law,
                   "Evaporation: e1, e2, e3, e4, exponential or counter (default: the file's)")
      ->transform(OneOf(EvaporationLaws()))
      ->type_name("NAME");
  command->add_option("--rate", options->rate, "Its rate k (default: the file's)")
      ->check(Number(0.0, 1e6));
  command
      ->add_option("--dead-band", options->dead_band,
                   "A trail is better by more than so many units (default: the file's)")
      ->check(Number(0.0, 1e6));
  command->add_option("--source", options->source,
                      "Energy in the source (default: the file's; not given there: without end)");
  const std::map<std::string, client::DepositRule> rules = {
      {"equal", client::DepositRule::kEqual}, {"scaled", client::DepositRule::kScaled}};
  command
      ->add_option("--deposit", options->deposit,
                   "equal: what was taken; scaled: less what is burned on the way (default: equal)")
      ->transform(OneOf(rules))
      ->type_name("NAME");
  command->add_option("--burn", options->burn_per_s, "Scaled: units burned a second (default: 1)")
      ->check(WholeNumber(0, 1000));
  command->add_option("--capacity", options->capacity, "Units that a robot takes (default: 100)")
      ->check(WholeNumber(1, 65'535));
  command
      ->add_option(
          "--explore-percent", options->explore_percent,
          "How often, at the fork, a robot ignores the advice and draws a trail (default: 0)")
      ->check(WholeNumber(0, 100));
  command->add_option("--speed", options->speed_mm_s, "Speed, mm/s (default: 400)")
      ->check(WholeNumber(50, 1000));
  command
      ->add_option("--seconds", options->seconds,
                   "Length of the run (default: 1800; by timetable 7200; with --trips: none)")
      ->check(Number(1.0, 1e7));
  command->add_option("--trips", options->trips, "End after so many round trips");
  command
      ->add_option("--channels", options->channels, "Radio channels (default: one for each robot)")
      ->check(WholeNumber(1, 64));
  command->add_option("--baud", options->baud, "Baud rate of each channel (default: 9600)")
      ->check(WholeNumber(1200, 115'200));
  command
      ->add_option("--frame-loss-percent", options->frame_loss_percent,
                   "Frames that each listener misses")
      ->check(Number(0.0, 90.0));
  command->add_option("--avr", options->avr_robots, "The last so many robots run the AVR's image")
      ->check(WholeNumber(0, 254));
  command->add_option("--seed", options->seed, "Of all that is random (default: 1)");
  CLI::Option* timetable = command->add_flag("--timetable", options->timetable,
                                             "Robots do not drive, but arrive when they would");
  command->add_option("--trail-a", options->trail_a_s, "By timetable: s on trail A (default: 20)")
      ->check(Number(1.0, 3600.0))
      ->needs(timetable);
  command->add_option("--trail-b", options->trail_b_s, "By timetable: s on trail B (default: 40)")
      ->check(Number(1.0, 3600.0))
      ->needs(timetable);
  command
      ->add_flag("--parking", options->parking,
                 "By timetable: robots in the nest do not stand in each other's way")
      ->needs(timetable);
  command
      ->add_option("--stop-s", options->stop_s,
                   "By timetable: robot 1 stands for good once it is in the nest after that time")
      ->check(Number(0.0, 1e7))
      ->needs(timetable);
  CLI::Option* sweep =
      command
          ->add_flag("--sweep", options->sweep,
                     "Count how often robots lock in on a trail, over laws, deposits, "
                     "exploration, numbers of robots and lifetimes")
          ->excludes(timetable);
  command
      ->add_option("--seeds", options->seeds,
                   "With --sweep and --by-robots: runs of each (default: 25)")
      ->check(WholeNumber(1, 10'000));
  command
      ->add_flag("--story", options->story,
                 "Seven robots whose timing is given: Fig. 5 of Ferreira, Tavares and Silva (2018)")
      ->excludes(timetable)
      ->excludes(sweep);
  command
      ->add_flag("--by-robots", options->by_robots,
                 "One to seven robots, driven and by a timetable of the same ways")
      ->excludes(timetable)
      ->excludes(sweep);
  command->add_flag("--frames", options->frames,
                    "Print the [[frame]] that a server needs for each AVR robot");
  CLI::Option* daemon = command->add_option(
      "--daemon", options->ports,
      "Run in real time against a running server of the same configuration: for each channel, the "
      "terminal device of its link");
  daemon->delimiter(',')
      ->check(TerminalDevice())
      ->type_name("PORT[,PORT...]")
      ->excludes(timetable)
      ->excludes(sweep);
  command
      ->add_option("--keys", options->keys,
                   "With --daemon: sign frames with the robots' keys in this file, which is like "
                   "the server's")
      ->type_name("FILE")
      ->needs(daemon);
  command->add_option("--out", options->out, "Folder for CSV files");
  command->footer("Exit status 1: robots touched, a record was refused, or a deposit was lost.");
  command->callback([=] { *status = Run(*options); });
}

}  // namespace pheromone::swarm
