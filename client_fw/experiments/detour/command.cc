// pheromone-experiments detour: around a repellent on a path, in virtual time.
#include "client_fw/swarm/command.h"

#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "client_fw/experiments/commands.h"
#include "client_fw/experiments/detour/experiment.h"
#include "server/base/number_check.h"

namespace pheromone::swarm {
namespace {

struct DetourOptions {
  double duration_s = 40;
  std::vector<double> offsets_m = {0.2, 0};
  std::vector<double> weights = {DetourExperiment{}.weight};
  int seeds = 20;
  std::string out;
  DetourExperiment experiment;
};

int RunDetour(const DetourOptions& options) {
  std::vector<DetourSeries> all;
  for (const double offset_m : options.offsets_m) {
    DetourExperiment experiment = options.experiment;
    experiment.patch_offset_m = offset_m;
    experiment.sensed_type = DetourExperiment::kPathType;
    all.push_back(MakeDetours(experiment, options.seeds));
    experiment.sensed_type = DetourExperiment::kWayType;
    for (const double weight : options.weights) {
      experiment.weight = weight;
      all.push_back(MakeDetours(experiment, options.seeds));
    }
  }
  fmt::print("{}", ToTable(all));
  if (!options.out.empty()) {
    // Of the first offset: without the repellent, and with the first weight.
    const std::vector<DetourSeries> shown(all.begin(), all.begin() + 2);
    return WriteFiles(options.out, {{"detour.csv", ToCsv(all)},
                                    {"detour-tracks.csv", TracksToCsv(shown)},
                                    {"detour-map.csv", MapToCsv(shown.front().experiment)}});
  }
  return 0;
}

}  // namespace

void AddDetourCommand(CLI::App* app, int* status) {
  auto options = std::make_shared<DetourOptions>();
  CLI::App* detour_command = app->add_subcommand(
      "detour",
      "Driving around a repellent patch across a path and back to the path, with and without the "
      "repellent, in virtual time; prints a table of the worst runs");
  detour_command
      ->add_option("--offset", options->offsets_m,
                   "Centre of the patch, m to the left of the path (default: 0.2 0)")
      ->check(Number(-1.0, 1.0));
  detour_command
      ->add_option("--weight", options->weights,
                   "Weight of the repellent in the blend (default: 0.3)")
      ->check(Number(0.0, 10.0));
  detour_command
      ->add_option("--radius", options->experiment.patch_radius_m,
                   "Radius of the patch, m (default: 0.3)")
      ->check(Number(0.1, 1.0));
  detour_command
      ->add_option("--core", options->experiment.core_m, "c of both pheromones, m (default: 0.1)")
      ->check(Number(0.0, 1.0));
  detour_command
      ->add_option("--sigma", options->experiment.sigma_m, "sigma of both, m (default: 0.8)")
      ->check(Number(0.01, 2.0));
  detour_command
      ->add_option("--bias", options->experiment.antenna_distance_m, "b, m (default: 0.33)")
      ->check(Number(0.01, 2.0));
  detour_command
      ->add_option("--law", options->experiment.law,
                   "differential (default), paper, or careful, the default of robots")
      ->transform(OneOf(LawsByName()))
      ->type_name("NAME");
  detour_command->add_option("--speed", options->experiment.speed_mm_s, "K, mm/s (default: 300)")
      ->check(WholeNumber(20, 2000));
  detour_command->add_option("--seeds", options->seeds, "Runs of each combination (default: 20)")
      ->check(WholeNumber(1, 10'000));
  detour_command
      ->add_option(
          "--seconds", options->duration_s,
          "Maximum length of a run, which also ends near the end of the path (default: 40)")
      ->check(Number(1.0, 3600.0));
  detour_command->add_option("--out", options->out,
                             "Folder for detour.csv (all runs), detour-tracks.csv and "
                             "detour-map.csv (those of the first offset and weight)");
  detour_command->footer(
      "The table has the worst values of each series: runs that entered the patch, smallest "
      "distance to it (negative: inside), longest time inside, largest deviation from the path, "
      "number of runs that returned and how far behind the centre of the patch, and smallest "
      "progress as a share of K t.");
  detour_command->callback([options, status] {
    options->experiment.duration_ms = static_cast<int64_t>(options->duration_s * 1000);
    *status = RunDetour(*options);
  });
}

}  // namespace pheromone::swarm
