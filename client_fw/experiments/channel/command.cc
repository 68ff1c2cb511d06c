// pheromone-experiments channel: how many robots a radio channel can serve, in virtual time.
#include "client_fw/swarm/command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client_fw/experiments/channel/experiment.h"
#include "client_fw/experiments/channel/report.h"
#include "client_fw/experiments/commands.h"
#include "client_fw/swarm/parallel_runs.h"
#include "server/base/file.h"
#include "server/base/number_check.h"

namespace pheromone::swarm {
namespace {

struct ChannelOptions {
  std::string access = "contention";
  int simple = 0;
  int hidden_pairs = 0;
  double frame_loss_percent = 0;
  double byte_error_percent = 0;
  int fail_safe_ms = 480;
  int period_ms = 200;
  bool is_signed = false;
  bool together = false;
  uint64_t seed = 1;
  bool json = false;
  std::vector<int> robots = {1, 2, 3, 4, 6, 8, 12, 16};
  std::vector<int> turnarounds_ms = {2, 20};
  std::vector<int> server_delays_ms = {2, 8};
  int baud = 9600;
  int seeds = 10;
  double duration_s = 60;
  std::string out;
  std::string link_table;
};

// All at 5 Hz; with the first timing also continuously, and four robots with a hidden pair.
std::vector<ChannelExperiment> PlanOf(const ChannelOptions& options) {
  std::vector<ChannelExperiment> plan;
  ChannelExperiment experiment;
  experiment.duration_ms = static_cast<int64_t>(options.duration_s * 1000);
  experiment.timing.baud = options.baud;
  for (const int turnaround_ms : options.turnarounds_ms) {
    for (const int server_delay_ms : options.server_delays_ms) {
      const bool first = plan.empty();
      experiment.timing.turnaround_ns = int64_t{turnaround_ms} * 1'000'000;
      experiment.timing.server_delay_ns = int64_t{server_delay_ms} * 1'000'000;
      for (const uint16_t period_ms : {uint16_t{200}, uint16_t{0}}) {
        for (const bool carrier_detect : {true, false}) {
          experiment.timing.carrier_detect = carrier_detect;
          experiment.period_ms = period_ms;
          for (const int robots : options.robots) {
            experiment.robots = robots;
            if (period_ms != 0 || first) {
              plan.push_back(experiment);
            }
          }
          if (period_ms != 0 && first) {
            experiment.robots = 4;
            experiment.hidden_pairs = 1;
            plan.push_back(experiment);
            experiment.hidden_pairs = 0;
          }
        }
      }
    }
  }
  return plan;
}

// Rounds beside contention, carrier detect as with the first rows: robots at 5 Hz, then what may go
// wrong.
std::vector<ChannelExperiment> RoundsPlanOf(const ChannelOptions& options) {
  std::vector<ChannelExperiment> plan;
  ChannelExperiment experiment;
  experiment.duration_ms = static_cast<int64_t>(options.duration_s * 1000);
  experiment.timing.baud = options.baud;
  experiment.timing.server_delay_ns = int64_t{options.server_delays_ms.front()} * 1'000'000;
  for (const int turnaround_ms : options.turnarounds_ms) {
    experiment.timing.turnaround_ns = int64_t{turnaround_ms} * 1'000'000;
    for (const Access access : {Access::kContention, Access::kRounds}) {
      experiment.access = access;
      for (const int robots : {2, 4, 8, 12, 16, 20, 30, 40}) {
        experiment.robots = robots;
        plan.push_back(experiment);
      }
    }
  }
  experiment.timing.turnaround_ns = int64_t{options.turnarounds_ms.front()} * 1'000'000;
  for (const Access access : {Access::kContention, Access::kRounds}) {
    ChannelExperiment base = experiment;
    base.access = access;
    base.robots = 16;
    ChannelExperiment changed = base;
    changed.together = true;
    plan.push_back(changed);
    for (const int pairs : {1, 5}) {
      changed = base;
      changed.hidden_pairs = pairs;
      plan.push_back(changed);
    }
    for (const double loss : {0.01, 0.05}) {
      changed = base;
      changed.frame_loss = loss;
      plan.push_back(changed);
    }
    if (access == Access::kRounds) {
      changed = base;
      changed.simple = 8;
      plan.push_back(changed);
    }
  }
  return plan;
}

// Damaged bytes, with rounds and with contention: independent, in bursts, in fades, of one robot,
// in one direction.
std::vector<ChannelExperiment> AirPlanOf(const ChannelOptions& options) {
  std::vector<Air> airs;
  for (const double byte_error : {0.0, 0.001, 0.003, 0.01, 0.03, 0.05}) {
    airs.push_back({.byte_error = byte_error});
  }
  for (const double burst_bytes : {4.0, 8.0}) {
    for (const double byte_error : {0.01, 0.03, 0.05}) {
      airs.push_back({.byte_error = byte_error, .burst_bytes = burst_bytes});
    }
  }
  airs.push_back({.fades = true});
  airs.push_back({.byte_error = 0.01, .fades = true});
  airs.push_back({.bad_robot = 0.05});
  airs.push_back({.from_server = 0.03});
  airs.push_back({.to_server = 0.03});
  std::vector<ChannelExperiment> plan;
  ChannelExperiment experiment;
  experiment.duration_ms = static_cast<int64_t>(options.duration_s * 1000);
  experiment.timing.baud = options.baud;
  for (const int turnaround_ms : options.turnarounds_ms) {
    experiment.timing.turnaround_ns = int64_t{turnaround_ms} * 1'000'000;
    for (const int adapter_ms : {1, 16}) {
      experiment.timing.adapter_ns = int64_t{adapter_ms} * 1'000'000;
      for (const Air& air : airs) {
        experiment.air = air;
        for (const int robots : {4, 8, 16}) {
          experiment.robots = robots;
          for (const Access access : {Access::kContention, Access::kRounds}) {
            experiment.access = access;
            plan.push_back(experiment);
          }
        }
      }
    }
  }
  return plan;
}

// Rounds as a modelled link is to know them.
std::vector<ChannelExperiment> LinkPlanOf(const ChannelOptions& options) {
  std::vector<ChannelExperiment> plan;
  ChannelExperiment experiment;
  experiment.access = Access::kRounds;
  experiment.duration_ms = static_cast<int64_t>(options.duration_s * 1000);
  for (const double loss : {0.0, 0.01, 0.05}) {
    experiment.frame_loss = loss;
    for (int robots = 1; robots <= 40; ++robots) {
      experiment.robots = robots;
      plan.push_back(experiment);
    }
  }
  return plan;
}

// One run, as one line of JSON.
int RunOnce(const ChannelOptions& options) {
  ChannelExperiment experiment;
  experiment.robots = options.robots.front();
  experiment.access = options.access == "rounds" ? Access::kRounds : Access::kContention;
  experiment.simple = options.simple;
  experiment.hidden_pairs = options.hidden_pairs;
  experiment.frame_loss = options.frame_loss_percent / 100;
  experiment.air.byte_error = options.byte_error_percent / 100;
  experiment.fail_safe_ms = static_cast<uint16_t>(options.fail_safe_ms);
  experiment.period_ms = static_cast<uint16_t>(options.period_ms);
  experiment.is_signed = options.is_signed;
  experiment.together = options.together;
  experiment.duration_ms = static_cast<int64_t>(options.duration_s * 1000);
  experiment.timing.baud = options.baud;
  experiment.timing.turnaround_ns = int64_t{options.turnarounds_ms.front()} * 1'000'000;
  experiment.timing.server_delay_ns = int64_t{options.server_delays_ms.front()} * 1'000'000;
  const ChannelSummary row = Summarise(experiment, {MeasureChannel(experiment, options.seed)});
  fmt::print("{}", ToJson(row));
  return 0;
}

using Rows = std::vector<ChannelSummary>;

// Prints each row when it is finished, and hands all so far to `keep`, which may save them in case
// the command is cut off. Returns the exit status.
int RunPlan(const std::vector<ChannelExperiment>& plan,
            const std::function<int(const ChannelExperiment&)>& seeds_of,
            const std::function<int(const Rows&)>& keep) {
  Rows rows;
  for (const ChannelExperiment& experiment : plan) {
    ShowProgress(fmt::format("{}/{}: {} robots", rows.size() + 1, plan.size(), experiment.robots));
    std::vector<ChannelRun> runs(static_cast<size_t>(seeds_of(experiment)));
    RunInParallel(runs.size(), [&](size_t i) { runs[i] = MeasureChannel(experiment, i + 1); });
    ShowProgress("");
    rows.push_back(Summarise(experiment, runs));
    fmt::print("{}", ToTableRow(rows.back()));
    std::fflush(stdout);
    if (const int status = keep(rows); status != 0) {
      return status;
    }
  }
  return 0;
}

int RunChannel(const ChannelOptions& options) {
  if (options.json) {
    return RunOnce(options);
  }
  if (!options.link_table.empty()) {
    fmt::print("{}", TableHead());
    // Channels so full that every robot stops in every round get a third of the runs.
    const auto seeds_of = [&](const ChannelExperiment& experiment) {
      return experiment.robots <= 20 ? options.seeds : std::max(1, options.seeds / 3);
    };
    const std::vector<ChannelExperiment> plan = LinkPlanOf(options);
    return RunPlan(plan, seeds_of, [&](const Rows& rows) {
      if (rows.size() < plan.size()) {
        return 0;  // the lab needs all of them
      }
      const Status written = WriteFile(options.link_table, LinkTableToCsv(rows));
      return written.ok() ? 0 : Fail(written.error(), kFailed);
    });
  }
  const auto write = [&](const std::vector<std::pair<std::string, std::string>>& files) {
    return options.out.empty() ? 0 : WriteFiles(options.out, files);
  };
  const std::vector<ChannelExperiment> plans[] = {PlanOf(options), RoundsPlanOf(options),
                                                  AirPlanOf(options)};
  fmt::print(stderr, "{} rows of {} runs, each of {} s of virtual time\n",
             plans[0].size() + plans[1].size() + plans[2].size(), options.seeds,
             options.duration_s);
  fmt::print("{}", TableHead());
  std::fflush(stdout);
  const auto seeds_of = [&](const ChannelExperiment& /*experiment*/) { return options.seeds; };
  int status = RunPlan(plans[0], seeds_of, [&](const Rows& rows) {
    return write({{"channel.csv", ToCsv(rows)}});
  });
  if (status == 0) {
    status = RunPlan(plans[1], seeds_of, [&](const Rows& rows) {
      return write({{"rounds.csv", ToCsv(rows)}, {"rounds-gaps.csv", GapsToCsv(rows)}});
    });
  }
  return status != 0 ? status : RunPlan(plans[2], seeds_of, [&](const Rows& rows) {
    return write({{"air.csv", AirToCsv(rows)}});
  });
}

}  // namespace

void AddChannelCommand(CLI::App* app, int* status) {
  auto options = std::make_shared<ChannelOptions>();
  CLI::App* command = app->add_subcommand(
      "channel", "The capacity of one radio channel in robots, in virtual time; prints a table");
  command->add_option("--robots", options->robots, "Numbers of robots (default: 1 2 3 4 6 8 12 16)")
      ->check(WholeNumber(1, 100))
      ->type_name("N");
  command
      ->add_option("--turnaround-ms", options->turnarounds_ms,
                   "Modem turnaround times T_t (default: 2 20)")
      ->check(WholeNumber(1, 100))
      ->type_name("MS");
  command
      ->add_option("--server-delay-ms", options->server_delays_ms,
                   "Server delays D_s (default: 2 8)")
      ->check(WholeNumber(0, 100))
      ->type_name("MS");
  CLI::Option* json = command->add_flag(
      "--json", options->json, "Run once, with the first of each list, and print one JSON object");
  command->add_option("--access", options->access, "How robots get to send (default: contention)")
      ->check(CLI::IsMember({"contention", "rounds"}))
      ->needs(json);
  command->add_option("--simple", options->simple, "With rounds: so many robots only contend")
      ->check(WholeNumber(0, 100))
      ->needs(json)
      ->type_name("N");
  command
      ->add_option("--hidden-pairs", options->hidden_pairs,
                   "Pairs of robots that do not hear each other")
      ->check(WholeNumber(0, 50))
      ->needs(json)
      ->type_name("N");
  command
      ->add_option("--frame-loss-percent", options->frame_loss_percent,
                   "Frames that each listener misses")
      ->check(Number(0, 100))
      ->needs(json)
      ->type_name("PERCENT");
  command
      ->add_option("--byte-error-percent", options->byte_error_percent,
                   "Bytes that each listener gets wrong")
      ->check(Number(0, 50))
      ->needs(json)
      ->type_name("PERCENT");
  command->add_option("--fail-safe-ms", options->fail_safe_ms, "Of the robots (default: 480)")
      ->check(WholeNumber(100, 30'000))
      ->needs(json)
      ->type_name("MS");
  command
      ->add_option("--period-ms", options->period_ms, "Between a robot's requests (default: 200)")
      ->check(WholeNumber(0, 30'000))
      ->needs(json)
      ->type_name("MS");
  command
      ->add_flag("--signed", options->is_signed,
                 "All frames are signed (protocol/README.md, section 18)")
      ->needs(json);
  command->add_flag("--together", options->together, "Switch all robots on at the same time")
      ->needs(json);
  command->add_option("--seed", options->seed, "Of the run that --json reports (default: 1)")
      ->needs(json)
      ->type_name("N");
  command->add_option("--baud", options->baud, "Baud rate of the channel (default: 9600)")
      ->check(WholeNumber(1200, 115'200))
      ->type_name("BAUD");
  command->add_option("--seeds", options->seeds, "Runs of each combination (default: 10)")
      ->check(WholeNumber(1, 1000))
      ->excludes(json)
      ->type_name("N");
  command->add_option("--seconds", options->duration_s, "Measured time of each run (default: 60)")
      ->check(Number(2.0, 36'000.0))
      ->type_name("S");
  command
      ->add_option("--out", options->out,
                   "Folder for channel.csv, rounds.csv, rounds-gaps.csv and air.csv, which grow "
                   "with each row")
      ->excludes(json)
      ->type_name("FOLDER");
  command
      ->add_option(
          "--link-table", options->link_table,
          "Instead: rounds of 1 to 40 robots with 0, 1 and 5 % of the frames lost, each at "
          "5 Hz with 9600 baud, as the table of the lab's modelled link; to this file, when all "
          "are done. Beyond 20 robots a third of the runs")
      ->excludes(json)
      ->excludes("--out")
      ->excludes("--robots")
      ->excludes("--turnaround-ms")
      ->excludes("--server-delay-ms")
      ->excludes("--baud")
      ->type_name("FILE");
  command->footer(
      "C_1 is the request rate of a single robot limited by the modems alone. The bound is ideal "
      "slotted CSMA, or the offered load if that is less. A request counts as delivered if it is "
      "answered within 500 ms of its due time. Share: answers of the worst robot divided by the "
      "mean. Latency and the longest gap between answers are in ms; stops are fail-safe stops.");
  command->callback([options, status] { *status = RunChannel(*options); });
}

}  // namespace pheromone::swarm
