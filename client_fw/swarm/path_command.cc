// pheromone-swarm path: the paper's path-following experiment, in virtual time.
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client_fw/swarm/command.h"
#include "client_fw/swarm/commands.h"
#include "client_fw/swarm/fit.h"
#include "client_fw/swarm/path_experiment.h"
#include "client_fw/swarm/picture.h"
#include "client_fw/swarm/robots.h"
#include "server/base/number_check.h"

namespace pheromone::swarm {
namespace {

struct PathOptions {
  double duration_s = 10;
  std::vector<Shape> shapes = {Shape::kLine, Shape::kCircle, Shape::kSCurve};
  std::vector<client::Law> laws = {client::Law::kDifferential, client::Law::kPaper};
  int seeds = 20;
  std::string out;
  std::string drive = "ideal";
  std::string client = "core";
  PathExperiment experiment;
};

// The robot of the command line. Returns an error, or nothing.
std::string ChooseRobot(PathOptions* options) {
  PathExperiment& experiment = options->experiment;
  experiment.pioneer = sim::FindPioneerModel(options->drive);
  if (options->client == "core") {
    return "";
  }
  if (!HasAvrRobots()) {
    return "--client avr: this program was built without libsimavr, expected core";
  }
  if (experiment.pioneer == nullptr) {
    return "--client avr: the image drives a Pioneer, expected --drive p3dx, p3dx-sh or "
           "peoplebot-sh";
  }
  if (experiment.frame_loss > 0) {
    return "--client avr: the image passes single bytes to its modem, expected --loss 0";
  }
  experiment.image = BuiltAvrImage();
  return "";
}

void WarnOfSpeed(const PathExperiment& experiment) {
  const auto warning =
      SpeedWarning({.speed_mm_s = experiment.speed_mm_s,
                    .period_ms = experiment.period_ms,
                    .reach_m = experiment.core_m + experiment.sigma_m,
                    .drive = experiment.pioneer != nullptr ? LimitsOf(*experiment.pioneer)
                                                           : LimitsOf(sim::DriveConfig())});
  if (warning) {
    fmt::print(stderr, "--speed {}: {}\n", experiment.speed_mm_s, *warning);
  }
}

const char* ColourOf(client::Law law) {
  return law == client::Law::kPaper     ? "#b2182b"
         : law == client::Law::kCareful ? "#1b7837"
                                        : "#2166ac";
}

int RunPath(PathOptions options) {
  if (const std::string error = ChooseRobot(&options); !error.empty()) {
    return Fail(error, kWrongInput);
  }
  WarnOfSpeed(options.experiment);
  std::vector<PathSummary> summaries;
  std::string runs_csv = "path,law,seed,mean_error_mm,late_mean_error_mm,progress_percent\n";
  const size_t all = options.shapes.size() * options.laws.size();
  for (const Shape shape : options.shapes) {
    std::vector<Way> ways;
    PathExperiment experiment = options.experiment;
    experiment.shape = shape;
    for (const client::Law law : options.laws) {
      experiment.law = law;
      std::vector<PathRun> runs;
      for (int seed = 1; seed <= options.seeds; ++seed) {
        ShowProgress(fmt::format("{}/{} {} {}: seed {} of {}", summaries.size() + 1, all,
                                 NameOf(shape), NameOf(law), seed, options.seeds));
        runs.push_back(FollowPath(experiment, static_cast<uint64_t>(seed)));
        const PathRun& run = runs.back();
        runs_csv +=
            fmt::format("{},{},{},{:.1f},{:.1f},{:.1f}\n", NameOf(shape), NameOf(law), seed,
                        run.mean_error_m * 1000, run.late_mean_error_m * 1000, run.progress * 100);
        ways.push_back({fmt::format("law {}: {} runs of {:.0f} s", NameOf(law), options.seeds,
                                    static_cast<double>(experiment.duration_ms) / 1000),
                        ColourOf(law), run.track, seed == 1});
      }
      summaries.push_back(Summarise(experiment, runs));
    }
    if (!options.out.empty()) {
      const field::Field field(EngineConfigOf(experiment).field);
      const std::string name(NameOf(shape));
      const int status = WriteFiles(
          options.out, {{"path-" + name + ".svg", DrawPathPicture("Path following: " + name, field,
                                                                  PathOf(shape), ways, 0)}});
      if (status != 0) {
        return status;
      }
    }
  }
  ShowProgress("");
  const std::string csv = ToCsv(summaries);
  fmt::print("{}", csv);
  if (!options.out.empty()) {
    return WriteFiles(options.out, {{"path.csv", csv}, {"path-runs.csv", runs_csv}});
  }
  return 0;
}

}  // namespace

void AddPathCommand(CLI::App* app, int* status) {
  static const std::map<std::string, Shape> shapes = {{"line", Shape::kLine},
                                                      {"circle", Shape::kCircle},
                                                      {"s-curve", Shape::kSCurve},
                                                      {"circuit", Shape::kCircuit}};
  auto options = std::make_shared<PathOptions>();
  PathExperiment& experiment = options->experiment;
  CLI::App* path_command = app->add_subcommand(
      "path", "The paper's path-following experiment, in virtual time; prints a table as CSV");
  path_command
      ->add_option(
          "--path", options->shapes,
          "line, circle, s-curve (default: these), or circuit, that of pheromoned's default "
          "configuration")
      ->transform(OneOf(shapes))
      ->type_name("NAME");
  path_command
      ->add_option("--law", options->laws,
                   "differential, paper (default: both), or careful, the default of robots")
      ->transform(OneOf(LawsByName()))
      ->type_name("NAME");
  path_command->add_option("--seeds", options->seeds, "Runs of each combination (default: 20)")
      ->check(WholeNumber(1, 10'000))
      ->type_name("N");
  path_command->add_option("--seconds", options->duration_s, "Length of a run (default: 10)")
      ->check(Number(1.0, 3600.0))
      ->type_name("S");
  path_command->add_option("--speed", experiment.speed_mm_s, "K, mm/s (default: 300)")
      ->check(WholeNumber(20, 2000))
      ->type_name("MM_PER_S");
  path_command
      ->add_option("--period-ms", experiment.period_ms, "Time between requests, ms (default: 200)")
      ->check(WholeNumber(50, 5000))
      ->type_name("MS");
  path_command->add_option("--cell", experiment.cell_m, "Side of a cell, a, m (default: 0.1)")
      ->check(Number(0.01, 1.0))
      ->type_name("METRES");
  path_command->add_option("--core", experiment.core_m, "Core radius, c, m (default: 0.1)")
      ->check(Number(0.0, 2.0))
      ->type_name("METRES");
  path_command
      ->add_option("--sigma", experiment.sigma_m, "Width of the slope, sigma, m (default: 0.4)")
      ->check(Number(0.01, 5.0))
      ->type_name("METRES");
  path_command
      ->add_option("--bias", experiment.antenna_distance_m,
                   "Distance of the antennas, b, m (default: 0.33)")
      ->check(Number(0.01, 2.0))
      ->type_name("METRES");
  path_command
      ->add_option("--drive", options->drive,
                   "ideal (default), or a simulated Pioneer: p3dx, p3dx-sh, peoplebot-sh")
      ->check(CLI::IsMember({"ideal", "p3dx", "p3dx-sh", "peoplebot-sh"}))
      ->type_name("NAME");
  path_command
      ->add_option("--client", options->client,
                   "core (default), or avr: the image that one would flash, on a Pioneer")
      ->check(CLI::IsMember({"core", "avr"}))
      ->type_name("NAME");
  path_command->add_option("--loss", experiment.frame_loss, "Fraction of frames lost (default: 0)")
      ->check(Number(0.0, 1.0))
      ->type_name("FRACTION");
  path_command->add_option("--out", options->out, "Folder for path.csv, path-runs.csv and pictures")
      ->type_name("FOLDER");
  path_command->callback([options, status] {
    options->experiment.duration_ms = static_cast<int64_t>(options->duration_s * 1000);
    *status = RunPath(*options);
  });
}

}  // namespace pheromone::swarm
