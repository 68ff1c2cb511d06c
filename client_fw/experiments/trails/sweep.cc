#include "client_fw/experiments/trails/sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <mutex>
#include <set>

#include "client_fw/swarm/parallel_runs.h"

namespace pheromone::swarm {
namespace {

using client::DepositRule;
using petri::EvaporationLaw;

constexpr std::array kLaws = {EvaporationLaw::kE1,          EvaporationLaw::kE2,
                              EvaporationLaw::kE3,          EvaporationLaw::kE4,
                              EvaporationLaw::kExponential, EvaporationLaw::kCounter};
constexpr std::array kRules = {DepositRule::kEqual, DepositRule::kScaled};
constexpr std::array kExplored = {0, 5};
constexpr std::array kSweptRobots = {2, 4, 7};
constexpr std::array kLifetimesS = {30, 60, 120, 300};

const char* NameOf(DepositRule rule) {
  return rule == DepositRule::kEqual ? "equal" : "scaled";
}

double PercentOnB(const LockInRow& row) {
  return row.runs == 0 ? 0 : 100.0 * row.on_b / row.runs;
}

LockInRow RowOf(const std::vector<LockInRow>& rows, EvaporationLaw law, DepositRule rule,
                int explored, int robots) {
  return Sum(rows, [&](const LockInCase& its) {
    return its.law == law && its.rule == rule && its.explore_percent == explored &&
           its.robots == robots;
  });
}

}  // namespace

DepositScale ScaleOf(DepositRule rule) {
  return rule == DepositRule::kEqual ? DepositScale{}
                                     : DepositScale{.capacity = 72, .burn_per_s = 1, .by_a = 40};
}

Timetable TimetableOf(const LockInCase& its) {
  const DepositScale scale = ScaleOf(its.rule);
  Timetable timetable;
  timetable.rules = {.robots = its.robots,
                     .law = its.law,
                     .rate_milli = RateForLifetime(its.law, scale.by_a, its.lifetime_s),
                     .exploring = its.explore_percent > 0};
  timetable.robot.rule = its.rule;
  timetable.robot.capacity = scale.capacity;
  timetable.robot.burn_per_s = scale.burn_per_s;
  timetable.robot.explore_percent = static_cast<uint8_t>(its.explore_percent);
  timetable.duration_ms = its.duration_ms;
  return timetable;
}

std::vector<LockInCase> LockInCases() {
  std::vector<LockInCase> cases;
  for (const EvaporationLaw law : kLaws) {
    for (const DepositRule rule : kRules) {
      for (const int explored : kExplored) {
        for (const int robots : kSweptRobots) {
          for (const int lifetime_s : kLifetimesS) {
            if (law != EvaporationLaw::kCounter || lifetime_s == kLifetimesS.front()) {
              cases.push_back({law, rule, explored, robots, lifetime_s});
            }
          }
        }
      }
    }
  }
  return cases;
}

Result<std::vector<LockInRow>> CountLockIn(const TrailsBench& bench,
                                           const std::vector<LockInCase>& cases, int seeds,
                                           const std::function<void(size_t done)>& on_run) {
  struct Outcome {
    TrailsSummary summary;
    uint64_t exceptions = 0;
    std::string error;
  };
  const auto each = static_cast<size_t>(seeds);
  std::vector<Outcome> outcomes(cases.size() * each);
  std::mutex mutex;
  size_t done = 0;
  RunInParallel(outcomes.size(), [&](size_t i) {
    const Result<TrailsRun> run =
        RunTimetable(bench, TimetableOf(cases[i / each]), static_cast<uint64_t>(i % each) + 1);
    if (run.ok()) {
      outcomes[i] = {
          Summarise(run.value()), run.value().server.exceptions + run.value().robot_exceptions, {}};
    } else {
      outcomes[i].error = run.error();
    }
    const std::lock_guard lock(mutex);
    ++done;
    if (on_run) {
      on_run(done);
    }
  });
  std::vector<LockInRow> rows;
  for (size_t i = 0; i < outcomes.size(); ++i) {
    const Outcome& outcome = outcomes[i];
    if (!outcome.error.empty()) {
      return Error{outcome.error};
    }
    if (i % each == 0) {
      rows.push_back({.its = cases[i / each]});
    }
    LockInRow& row = rows.back();
    ++row.runs;
    row.on_a += outcome.summary.locked_on_a ? 1 : 0;
    row.on_b += outcome.summary.locked_on_b ? 1 : 0;
    row.trips_per_hour += outcome.summary.trips_per_hour / seeds;
    const auto choices =
        static_cast<double>(outcome.summary.choices[0] + outcome.summary.choices[1]);
    row.share_b +=
        choices > 0 ? static_cast<double>(outcome.summary.choices[1]) / choices / seeds : 0;
    row.exceptions += outcome.exceptions;
  }
  return rows;
}

LockInRow Sum(const std::vector<LockInRow>& rows,
              const std::function<bool(const LockInCase&)>& belongs) {
  LockInRow sum;
  for (const LockInRow& row : rows) {
    if (belongs(row.its)) {
      sum.its = row.its;
      sum.trips_per_hour += row.trips_per_hour * row.runs;
      sum.share_b += row.share_b * row.runs;
      sum.runs += row.runs;
      sum.on_a += row.on_a;
      sum.on_b += row.on_b;
      sum.exceptions += row.exceptions;
    }
  }
  if (sum.runs > 0) {
    sum.trips_per_hour /= sum.runs;
    sum.share_b /= sum.runs;
  }
  return sum;
}

std::string LockInToCsv(const std::vector<LockInRow>& rows) {
  std::string csv =
      "law,deposit,explore_percent,robots,lifetime_s,runs,locked_on_short,locked_on_long,"
      "trips_per_hour,share_of_long,exceptions\n";
  for (const LockInRow& row : rows) {
    csv +=
        fmt::format("{},{},{},{},{},{},{},{},{:.1f},{:.3f},{}\n", petri::NameOf(row.its.law),
                    NameOf(row.its.rule), row.its.explore_percent, row.its.robots,
                    row.its.law == EvaporationLaw::kCounter ? std::string()
                                                            : fmt::format("{}", row.its.lifetime_s),
                    row.runs, row.on_a, row.on_b, row.trips_per_hour, row.share_b, row.exceptions);
  }
  return csv;
}

std::string LockInToTable(const std::vector<LockInRow>& rows) {
  std::string table = fmt::format("{:<12} {:<8} {:>8}", "law", "deposit", "explore");
  for (const int robots : kSweptRobots) {
    table += fmt::format("  N={}: long  short    /h", robots);
  }
  table += '\n';
  for (const EvaporationLaw law : kLaws) {
    for (const DepositRule rule : kRules) {
      for (const int explored : kExplored) {
        std::string line =
            fmt::format("{:<12} {:<8} {:>6} %", petri::NameOf(law), NameOf(rule), explored);
        bool any = false;
        for (const int robots : kSweptRobots) {
          const LockInRow row = RowOf(rows, law, rule, explored, robots);
          any = any || row.runs > 0;
          line += row.runs == 0 ? fmt::format("{:>24}", "")
                                : fmt::format("    {:>4.0f} % {:>4.0f} % {:>5.0f}", PercentOnB(row),
                                              100.0 * row.on_a / row.runs, row.trips_per_hour);
        }
        table += any ? line + '\n' : std::string();
      }
    }
  }
  return table;
}

}  // namespace pheromone::swarm
