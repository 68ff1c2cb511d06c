#include "client_fw/experiments/bridge/experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>

#include "client_fw/swarm/parallel_runs.h"
#include "server/base/hash.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kMinuteMs = 60'000;

ShareSpread SpreadOf(const std::vector<double>& values) {
  ShareSpread spread;
  const auto n = static_cast<double>(values.size());
  for (const double value : values) {
    spread.mean += value / n;
  }
  double squares = 0;
  for (const double value : values) {
    squares += (value - spread.mean) * (value - spread.mean);
  }
  if (values.size() > 1) {
    spread.deviation = std::sqrt(squares / (n - 1));
  }
  return spread;
}

// Wilson 1927: the probabilities of which `successes` of `n` is less than 1.96 deviations away.
void SetWilson(int successes, int runs, double* least, double* most) {
  constexpr double kZ = 1.96;
  const double n = runs;
  const double share = successes / n;
  const double centre = (share + kZ * kZ / (2 * n)) / (1 + kZ * kZ / n);
  const double half =
      kZ * std::sqrt(share * (1 - share) / n + kZ * kZ / (4 * n * n)) / (1 + kZ * kZ / n);
  *least = std::max(0.0, centre - half);
  *most = std::min(1.0, centre + half);
}

std::string_view EvaporationOf(const BridgeExperiment& experiment) {
  if (!experiment.lay_trail) {
    return "no trail";
  }
  if (experiment.tau_ms == 0) {
    return "none";
  }
  return experiment.evaporation == field::Evaporation::kExponential ? "exponential" : "counter";
}

double TauSeconds(const BridgeExperiment& experiment) {
  return static_cast<double>(experiment.tau_ms) / 1000;
}

}  // namespace

std::string_view NameOf(Outcome outcome) {
  switch (outcome) {
    case Outcome::kShort:
      return "short";
    case Outcome::kLong:
      return "long";
    case Outcome::kUndecided:
      return "undecided";
  }
  return "";
}

Outcome OutcomeOf(double final_share) {
  if (final_share >= kMaxOfAll) {
    return Outcome::kShort;
  }
  return 1 - final_share >= kMaxOfAll ? Outcome::kLong : Outcome::kUndecided;
}

std::optional<double> ShortShare(const std::vector<Choice>& choices, int64_t from_ms,
                                 int64_t to_ms) {
  int all = 0;
  int took_short = 0;
  for (const Choice& choice : choices) {
    if (choice.time_ms >= from_ms && choice.time_ms < to_ms) {
      ++all;
      took_short += choice.branch == Branch::kShort ? 1 : 0;
    }
  }
  return all > 0 ? std::optional(static_cast<double>(took_short) / all) : std::nullopt;
}

BridgeRun RunBridge(const BridgeExperiment& experiment, uint64_t seed) {
  BridgeSimulation simulation(experiment, seed);
  simulation.RunTo(experiment.duration_ms);
  BridgeRun run;
  run.choices = simulation.choices();
  run.final_share =
      ShortShare(run.choices, experiment.duration_ms * 3 / 4, experiment.duration_ms + 1)
          .value_or(0.5);
  run.outcome = OutcomeOf(run.final_share);
  const auto short_ms = static_cast<double>(simulation.time_on_ms(Branch::kShort));
  const auto long_ms = static_cast<double>(simulation.time_on_ms(Branch::kLong));
  run.presence = short_ms + long_ms > 0 ? short_ms / (short_ms + long_ms) : 0.5;
  for (const BridgeRobot& robot : simulation.robots()) {
    run.fail_safe_stops += robot.conversation().counters().fail_safe_stops;
  }
  run.state_hash = simulation.service().StateHash();
  return run;
}

BridgeSeries RunBridges(const BridgeExperiment& experiment, int seeds,
                        const std::function<void()>& on_run) {
  BridgeSeries series{experiment, std::vector<BridgeRun>(static_cast<size_t>(seeds))};
  std::mutex told;
  RunInParallel(series.runs.size(), [&](size_t i) {
    series.runs[i] = RunBridge(experiment, i + 1);
    if (on_run) {
      const std::lock_guard lock(told);
      on_run();
    }
  });
  return series;
}

std::vector<BridgeExperiment> BridgeExperiments(const BridgeExperiment& base) {
  std::vector<BridgeExperiment> all = {base};
  const auto add = [&all, &base](std::string name, const auto& vary) {
    BridgeExperiment experiment = base;
    experiment.name = std::move(name);
    vary(&experiment);
    all.push_back(std::move(experiment));
  };
  add("no evaporation", [](BridgeExperiment* it) { it->tau_ms = 0; });
  add("no pheromone", [](BridgeExperiment* it) { it->lay_trail = false; });
  add("equal branches", [](BridgeExperiment* it) { it->shape.ratio = 1; });
  add("short opens late", [](BridgeExperiment* it) { it->short_opens_ms = it->duration_ms / 4; });
  add("late, no evaporation", [](BridgeExperiment* it) {
    it->short_opens_ms = it->duration_ms / 4;
    it->tau_ms = 0;
  });
  add("over the radio", [](BridgeExperiment* it) { it->radio = true; });
  for (const int64_t tau_s : {5, 10, 40, 80}) {
    add(fmt::format("tau {} s", tau_s), [=](BridgeExperiment* it) { it->tau_ms = tau_s * 1000; });
  }
  for (const int64_t half_life_s : {10, 20, 60}) {
    add(fmt::format("half-life {} s", half_life_s), [=](BridgeExperiment* it) {
      it->evaporation = field::Evaporation::kExponential;
      it->tau_ms = half_life_s * 1000;
    });
  }
  for (const int count : {8, 16, 64, 125}) {
    add(fmt::format("Q = 1/{}", count),
        [=](BridgeExperiment* it) { it->max_count = static_cast<uint16_t>(count); });
  }
  for (const int robots : {4, 6, 10}) {
    add(fmt::format("{} robots", robots), [=](BridgeExperiment* it) { it->robots = robots; });
  }
  return all;
}

ShareSpread ShareOf(const BridgeSeries& series, int64_t from_ms, int64_t to_ms) {
  std::vector<double> shares;
  for (const BridgeRun& run : series.runs) {
    if (const std::optional<double> share = ShortShare(run.choices, from_ms, to_ms)) {
      shares.push_back(*share);
    }
  }
  return SpreadOf(shares);
}

BridgeSummary Summarise(const BridgeSeries& series) {
  BridgeSummary summary;
  summary.runs = static_cast<int>(series.runs.size());
  std::vector<double> shares;
  for (const BridgeRun& run : series.runs) {
    shares.push_back(run.final_share);
    summary.ended_short += run.outcome == Outcome::kShort ? 1 : 0;
    summary.ended_long += run.outcome == Outcome::kLong ? 1 : 0;
    summary.presence += run.presence / summary.runs;
    summary.choices += static_cast<double>(run.choices.size()) / summary.runs;
    summary.fail_safe_stops += run.fail_safe_stops;
    summary.state_hash = HashStep(summary.state_hash, run.state_hash);
  }
  summary.final_share = SpreadOf(shares);
  SetWilson(summary.ended_short, std::max(1, summary.runs), &summary.least_probability,
            &summary.most_probability);
  return summary;
}

std::string BridgeTableHead() {
  return "experiment            runs  short  long  undecided  final share  presence  choices\n";
}

std::string BridgeTableRow(const BridgeSeries& series) {
  const BridgeSummary s = Summarise(series);
  return fmt::format("{:<20}  {:4}  {:5}  {:4}  {:9}  {:.2f} ± {:.2f}  {:8.2f}  {:7.0f}\n",
                     series.experiment.name, s.runs, s.ended_short, s.ended_long,
                     s.runs - s.ended_short - s.ended_long, s.final_share.mean,
                     s.final_share.deviation, s.presence, s.choices);
}

std::string ToCsv(const std::vector<BridgeSeries>& all) {
  std::string csv =
      "experiment,robots,evaporation,tau_s,c_max,link,runs,short,long,undecided,p_short,"
      "p_short_least,p_short_most,final_share,final_share_deviation,presence,choices,"
      "fail_safe_stops,state_hash\n";
  for (const BridgeSeries& series : all) {
    const BridgeExperiment& it = series.experiment;
    const BridgeSummary s = Summarise(series);
    csv += fmt::format(
        "\"{}\",{},{},{:.0f},{},{},{},{},{},{},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},"
        "{:.3f},{:.0f},{},{:016x}\n",
        it.name, it.robots, EvaporationOf(it), TauSeconds(it), it.max_count,
        it.radio ? "radio" : "ideal", s.runs, s.ended_short, s.ended_long,
        s.runs - s.ended_short - s.ended_long,
        static_cast<double>(s.ended_short) / std::max(1, s.runs), s.least_probability,
        s.most_probability, s.final_share.mean, s.final_share.deviation, s.presence, s.choices,
        s.fail_safe_stops, s.state_hash);
  }
  return csv;
}

std::string RunsToCsv(const std::vector<BridgeSeries>& all) {
  std::string csv = "experiment,seed,choices,final_share,outcome,presence,state_hash\n";
  for (const BridgeSeries& series : all) {
    for (size_t i = 0; i < series.runs.size(); ++i) {
      const BridgeRun& run = series.runs[i];
      csv += fmt::format("\"{}\",{},{},{:.3f},{},{:.3f},{:016x}\n", series.experiment.name, i + 1,
                         run.choices.size(), run.final_share, NameOf(run.outcome), run.presence,
                         run.state_hash);
    }
  }
  return csv;
}

std::string SharesToCsv(const std::vector<BridgeSeries>& all) {
  std::string csv = "experiment,minute,share,deviation\n";
  for (const BridgeSeries& series : all) {
    for (int64_t ms = 0; ms < series.experiment.duration_ms; ms += kMinuteMs) {
      const ShareSpread share = ShareOf(series, ms, ms + kMinuteMs);
      csv += fmt::format("\"{}\",{},{:.3f},{:.3f}\n", series.experiment.name, ms / kMinuteMs,
                         share.mean, share.deviation);
    }
  }
  return csv;
}

std::string ChoicesToCsv(const BridgeSeries& series) {
  constexpr size_t kBins = 20;
  std::array<int, kBins> all{};
  std::array<int, kBins> took_short{};
  for (const BridgeRun& run : series.runs) {
    for (const Choice& choice : run.choices) {
      const size_t bin = std::min(kBins - 1, static_cast<size_t>(choice.short_trail * kBins));
      ++all[bin];
      took_short[bin] += choice.branch == Branch::kShort ? 1 : 0;
    }
  }
  std::string csv = "trail_from,trail_to,choices,took_short\n";
  for (size_t bin = 0; bin < kBins; ++bin) {
    csv += fmt::format("{:.2f},{:.2f},{},{}\n", static_cast<double>(bin) / kBins,
                       static_cast<double>(bin + 1) / kBins, all[bin], took_short[bin]);
  }
  return csv;
}

}  // namespace pheromone::swarm
