// pheromone-experiments laws: the steering laws side by side, and the search that tunes them.
#include "client_fw/swarm/command.h"

#include <fmt/format.h>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client_fw/experiments/commands.h"
#include "client_fw/experiments/laws/experiment.h"
#include "server/base/number_check.h"

namespace pheromone::swarm {
namespace {

constexpr uint64_t kSearchSeed = 1;

struct LawsOptions {
  int budget = 0;
  int seeds = 20;
  std::string out;
};

Tuning TuneAloud(client::Law law, int budget) {
  const std::string name(law == client::Law::kFuzzy ? "fuzzy" : "differential");
  Tuning tuning = Tune(law, budget, kSearchSeed, [&](int i) {
    ShowProgress(fmt::format("searching {}: {} of {}", name, i + 1, budget));
  });
  ShowProgress("");
  const Tunable tunable = TunableOf(law);
  const Merit& merit = tuning.merits[tuning.search.best_index];
  fmt::print("# {}: mean error {:.1f} mm, progress {:.1f} mm/s with", name, merit.error_mm,
             merit.progress_mm_s);
  for (size_t i = 0; i < tunable.names.size(); ++i) {
    fmt::print(" {}={}", tunable.names[i], tuning.search.best().values[i]);
  }
  fmt::print("\n");
  return tuning;
}

// The curve, and the runs of seed 1 and 2 of each law on it.
std::string TracksToCsv(const std::vector<Contender>& contenders, Curve curve) {
  constexpr size_t kEach = 4;  // samples: enough for a figure
  std::string csv = "law,seed,time_s,x_m,y_m\n";
  const field::Path path = PathOf(curve);
  for (size_t i = 0; i < path.points.size() + (path.closed ? 1 : 0); ++i) {
    const field::PointUm point = path.points[i % path.points.size()];
    csv += fmt::format("path,,,{:.3f},{:.3f}\n", static_cast<double>(point.x) / 1e6,
                       static_cast<double>(point.y) / 1e6);
  }
  for (const Contender& contender : contenders) {
    for (uint64_t seed = 1; seed <= 2; ++seed) {
      FollowConditions conditions;
      conditions.curve = curve;
      conditions.steering = contender.steering;
      conditions.duration_ms = 40'000;
      const std::vector<Sample> track = Follow(conditions, seed).track;
      for (size_t i = 0; i < track.size(); i += kEach) {
        csv += fmt::format("{},{},{:g},{:.3f},{:.3f}\n", contender.name, seed,
                           static_cast<double>(track[i].time_ms) / 1000, track[i].pose.x_m,
                           track[i].pose.y_m);
      }
    }
  }
  return csv;
}

int RunLaws(const LawsOptions& options) {
  std::vector<Tuning> tunings;
  Steering differential = TunedDifferential();
  Steering fuzzy = TunedFuzzy();
  if (options.budget > 0) {
    tunings.push_back(TuneAloud(client::Law::kDifferential, options.budget));
    tunings.push_back(TuneAloud(client::Law::kFuzzy, options.budget));
    differential = tunings[0].steering();
    fuzzy = tunings[1].steering();
  }
  const std::vector<Contender> contenders = ContendersOf(differential, fuzzy);
  std::vector<Curve> curves = UnseenCurves();
  curves.insert(curves.begin(), TuningCurves().begin(), TuningCurves().end());
  std::vector<Comparison> rows;
  for (const Curve curve : curves) {
    for (const Contender& contender : contenders) {
      ShowProgress(fmt::format("{}: {}", NameOf(curve), contender.name));
      rows.push_back(Compare(contender, curve, options.seeds));
    }
  }
  ShowProgress("");
  const std::string csv = ToCsv(rows);
  fmt::print("{}", csv);
  if (options.out.empty()) {
    return 0;
  }
  std::vector<std::pair<std::string, std::string>> files = {
      {"laws.csv", csv}, {"laws-tracks.csv", TracksToCsv(contenders, Curve::kEight)}};
  if (!tunings.empty()) {
    files.emplace_back("laws-search.csv", ToCsv(tunings));
  }
  return WriteFiles(options.out, files);
}

}  // namespace

void AddLawsCommand(CLI::App* app, int* status) {
  auto options = std::make_shared<LawsOptions>();
  CLI::App* command = app->add_subcommand(
      "laws",
      "A comparison of the steering laws, on the curves used for tuning and on others, in virtual "
      "time; prints a table as CSV");
  command
      ->add_option(
          "--search", options->budget,
          "Retune the differential and fuzzy laws with this many evaluations each (default: "
          "use the stored parameters)")
      ->check(WholeNumber(0, 100'000));
  command->add_option("--seeds", options->seeds, "Runs of each law on each curve (default: 20)")
      ->check(WholeNumber(1, 10'000));
  command->add_option("--out", options->out,
                      "Folder for laws.csv, laws-tracks.csv (two runs of each law on the figure "
                      "eight) and, with --search, laws-search.csv");
  command->callback([options, status] { *status = RunLaws(*options); });
}

}  // namespace pheromone::swarm
