#include "client_fw/experiments/laws/experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace pheromone::swarm {
namespace {

constexpr int64_t kTuningMs = 20'000;
constexpr int64_t kComparisonMs = 40'000;
constexpr uint64_t kFirstTuningSeed = 1001;  // far from those of a comparison, which begin at 1
constexpr int kTuningSeeds = 4;

int8_t Byte(int value) {
  return static_cast<int8_t>(value);
}

std::string JoinedNames(const Tunable& tunable, const std::vector<int>& values) {
  std::string text;
  for (size_t i = 0; i < values.size(); ++i) {
    text += fmt::format("{}{}={}", i == 0 ? "" : " ", tunable.names[i], values[i]);
  }
  return text;
}

}  // namespace

Steering TunedDifferential() {
  return {.law = client::Law::kDifferential, .speed_mm_s = 297, .gain_8 = 12};
}

Steering TunedFuzzy() {
  return {.law = client::Law::kFuzzy, .speed_mm_s = 300, .fuzzy = client::kTunedFuzzy};
}

std::vector<Contender> ContendersOf(const Steering& differential, const Steering& fuzzy) {
  return {{"paper", {.law = client::Law::kPaper}},
          {"differential (gain 1)", {}},
          {"differential (tuned)", differential},
          {"fuzzy (tuned)", fuzzy}};
}

Tunable TunableOf(client::Law law) {
  if (law == client::Law::kFuzzy) {
    return {{"speed", "error", "z_change", "p_turn", "p_change", "p_speed", "pb_more_turn",
             "pb_change", "pb_speed"},
            {{150, 300},
             {4, 127},
             {-64, 127},
             {0, 127},
             {-64, 127},
             {32, 127},
             {0, 127},
             {-64, 127},
             {32, 127}},
            // The differential law at gain 1, in fuzzy rules: u = e/2.
            {300, 32, 0, 32, 0, 127, 32, 0, 127}};
  }
  return {{"speed", "gain"}, {{150, 300}, {2, client::kMaxGain}}, {300, client::kUnitGain}};
}

Steering SteeringOf(client::Law law, const std::vector<int>& values) {
  Steering steering;
  steering.law = law;
  steering.speed_mm_s = static_cast<int16_t>(values[0]);
  if (law == client::Law::kFuzzy) {
    // PB turns at least as much as P: more error, more turn.
    const int pb_turn = std::min(127, values[3] + values[6]);
    steering.fuzzy = {Byte(values[1]),
                      {{0, Byte(values[2]), 127},
                       {Byte(values[3]), Byte(values[4]), Byte(values[5])},
                       {Byte(pb_turn), Byte(values[7]), Byte(values[8])}}};
  } else {
    steering.gain_8 = static_cast<uint8_t>(values[1]);
  }
  return steering;
}

Merit MeritOf(const Steering& steering) {
  Merit merit;
  const auto curves = static_cast<double>(TuningCurves().size());
  for (const Curve curve : TuningCurves()) {
    const FollowSummary summary =
        FollowSeeds({.curve = curve, .steering = steering, .duration_ms = kTuningMs},
                    kFirstTuningSeed, kTuningSeeds);
    merit.error_mm += summary.error_mm.mean / curves;
    merit.progress_mm_s += summary.progress_mm_s.mean / curves;
  }
  return merit;
}

Tuning Tune(client::Law law, int budget, uint64_t seed, const std::function<void(int)>& shown) {
  const Tunable tunable = TunableOf(law);
  Tuning tuning;
  tuning.law = law;
  tuning.search =
      Search(tunable.ranges, tunable.start, budget, seed, [&](const std::vector<int>& values) {
        shown(static_cast<int>(tuning.merits.size()));
        tuning.merits.push_back(MeritOf(SteeringOf(law, values)));
        return tuning.merits.back().cost();
      });
  return tuning;
}

Comparison Compare(const Contender& contender, Curve curve, int seeds) {
  return {
      contender,
      FollowSeeds({.curve = curve, .steering = contender.steering, .duration_ms = kComparisonMs}, 1,
                  seeds)};
}

std::string ToCsv(const std::vector<Comparison>& rows) {
  std::string csv =
      "curve,law,runs,mean_error_mm,error_deviation_mm,worst_error_mm,late_mean_error_mm,"
      "late_error_deviation_mm,progress_mm_s,progress_deviation_mm_s,worst_progress_mm_s\n";
  for (const Comparison& row : rows) {
    const FollowSummary& s = row.summary;
    csv += fmt::format("{},{},{},{:.1f},{:.1f},{:.1f},{:.1f},{:.1f},{:.1f},{:.1f},{:.1f}\n",
                       NameOf(s.conditions.curve), row.contender.name, s.runs, s.error_mm.mean,
                       s.error_mm.deviation, s.error_mm.most, s.late_error_mm.mean,
                       s.late_error_mm.deviation, s.progress_mm_s.mean, s.progress_mm_s.deviation,
                       s.progress_mm_s.least);
  }
  return csv;
}

std::string ToCsv(const std::vector<Tuning>& tunings) {
  std::string csv = "law,evaluation,cost,mean_error_mm,progress_mm_s,best,parameters\n";
  for (const Tuning& tuning : tunings) {
    const Tunable tunable = TunableOf(tuning.law);
    for (size_t i = 0; i < tuning.merits.size(); ++i) {
      csv += fmt::format("{},{},{:.2f},{:.2f},{:.2f},{},{}\n",
                         tuning.law == client::Law::kFuzzy ? "fuzzy" : "differential", i,
                         tuning.merits[i].cost(), tuning.merits[i].error_mm,
                         tuning.merits[i].progress_mm_s, i == tuning.search.best_index ? 1 : 0,
                         JoinedNames(tunable, tuning.search.evaluations[i].values));
    }
  }
  return csv;
}

}  // namespace pheromone::swarm
