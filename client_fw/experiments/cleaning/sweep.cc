#include "client_fw/experiments/cleaning/sweep.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>

#include "client_fw/experiments/cleaning/model.h"
#include "client_fw/swarm/parallel_runs.h"

namespace pheromone::swarm {
namespace {

struct Size {
  int columns;
  int rows;
  int robots;
};
constexpr Size kSizes[] = {{4, 3, 2}, {6, 6, 6}, {10, 10, 16}, {15, 15, 37}, {20, 20, 66}};

// Mean, least and most over the runs.
struct Range {
  double mean = 0;
  double least = 0;
  double most = 0;
};

Range RangeOf(const std::vector<double>& values) {
  Range range;
  for (const double value : values) {
    range.mean += value / static_cast<double>(values.size());
  }
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  range.least = *least;
  range.most = *most;
  return range;
}

Range RangeOver(const CleaningSeries& series,
                const std::function<double(const CleaningRun&)>& figure) {
  std::vector<double> values;
  for (const CleaningRun& run : series.runs) {
    values.push_back(figure(run));
  }
  return RangeOf(values);
}

// The worst gap in ideal cycles, and in cycles as long as they were.
double ByIdeal(const CleaningExperiment& experiment, const CleaningRun& run) {
  return Summarise(experiment, run).worst_gap_s / experiment.IdealCycleSeconds();
}
double ByTrue(const CleaningExperiment& experiment, const CleaningRun& run) {
  const CleaningSummary summary = Summarise(experiment, run);
  return summary.cycle_s > 0 ? summary.worst_gap_s / summary.cycle_s : NAN;
}

std::string NameOf(const CleaningGrid& grid) {
  return fmt::format("{}×{}", grid.columns, grid.rows);
}

}  // namespace

std::vector<CleaningExperiment> CleaningSizes(const CleaningExperiment& base) {
  std::vector<CleaningExperiment> all;
  for (const Size& size : kSizes) {
    CleaningExperiment experiment = base;
    experiment.grid.columns = size.columns;
    experiment.grid.rows = size.rows;
    experiment.robots = size.robots;
    experiment.channels = (size.robots + kRobotsOfChannel - 1) / kRobotsOfChannel;
    all.push_back(experiment);
  }
  return all;
}

CleaningSeries RunSeries(const CleaningExperiment& experiment, int cycles, int seeds,
                         const std::function<void(int done, int64_t second)>& on_second) {
  CleaningSeries series{experiment, std::vector<CleaningRun>(static_cast<size_t>(seeds)), {}};
  series.experiment.duration_ms = std::llround(1000 * cycles * experiment.IdealCycleSeconds());
  for (int seed = 1; seed <= seeds; ++seed) {
    series.model_gaps.push_back(
        ModelWorstGap(experiment.grid, experiment.robots, cycles, static_cast<uint64_t>(seed)));
  }
  std::atomic<int> done = 0;
  std::mutex told;
  RunInParallel(series.runs.size(), [&](size_t i) {
    series.runs[i] = RunCleaning(series.experiment, i + 1, [&](int64_t second) {
      if (on_second) {
        const std::lock_guard lock(told);
        on_second(done, second);
      }
    });
    ++done;
  });
  return series;
}

std::string ToTableHead() {
  return "zones  robots  channels  ideal cycle  cycle  worst gap, mean (most)  by ideal cycle  "
         "by cycle  model        together\n";
}

std::string ToTableRow(const CleaningSeries& series) {
  const CleaningExperiment& it = series.experiment;
  const Range gap =
      RangeOver(series, [&](const CleaningRun& run) { return Summarise(it, run).worst_gap_s; });
  const Range cycle =
      RangeOver(series, [&](const CleaningRun& run) { return Summarise(it, run).cycle_s; });
  const Range by_ideal =
      RangeOver(series, [&](const CleaningRun& run) { return ByIdeal(it, run); });
  const Range by_true = RangeOver(series, [&](const CleaningRun& run) { return ByTrue(it, run); });
  const Range model = RangeOf(series.model_gaps);
  int64_t together_ms = 0;
  for (const CleaningRun& run : series.runs) {
    together_ms += run.together_ms;
  }
  return fmt::format(
      "{:>5}  {:6}  {:8}  {:9.1f} s  {:3.0f} s  {:7.0f} s ({:.0f} s)        {:4.2f} ({:.2f})     "
      "{:4.2f} ({:.2f})  {:4.2f} ({:.2f})  {}\n",
      NameOf(it.grid), it.robots, it.channels, it.IdealCycleSeconds(), cycle.mean, gap.mean,
      gap.most, by_ideal.mean, by_ideal.most, by_true.mean, by_true.most, model.mean, model.most,
      together_ms == 0 ? "never" : fmt::format("{} ms", together_ms));
}

std::string ToCsv(const std::vector<CleaningSeries>& all) {
  std::string csv =
      "columns,rows,robots,channels,baud,seed,seconds,cleanings,ideal_cycle_s,cycle_s,turn_s,"
      "worst_gap_s,mean_gap_s,by_ideal_cycle,by_cycle,model_by_ideal_cycle,together_ms,misplaced,"
      "lost_claims,tag_requests,fail_safe_stops,utilisation,state_hash\n";
  for (const CleaningSeries& series : all) {
    const CleaningExperiment& it = series.experiment;
    for (size_t i = 0; i < series.runs.size(); ++i) {
      const CleaningRun& run = series.runs[i];
      const CleaningSummary s = Summarise(it, run);
      csv += fmt::format(
          "{},{},{},{},{},{},{:.0f},{},{:.2f},{:.2f},{:.2f},{:.2f},{:.2f},{:.3f},{:.3f},{:.3f},{},"
          "{},{},{},{},{:.3f},{:016x}\n",
          it.grid.columns, it.grid.rows, it.robots, it.channels, it.timing.baud, i + 1,
          static_cast<double>(it.duration_ms) / 1000, s.done, it.IdealCycleSeconds(), s.cycle_s,
          s.turn_s, s.worst_gap_s, s.mean_gap_s, ByIdeal(it, run), ByTrue(it, run),
          series.model_gaps[i], run.together_ms, run.misplaced, run.lost_claims, run.tag_requests,
          run.fail_safe_stops, run.utilisation, run.state_hash);
    }
  }
  return csv;
}

}  // namespace pheromone::swarm
