// pheromone-swarm: experiments with simulated robots.
//
//   pheromone-swarm path     the paper's path-following experiment, in virtual time
//   pheromone-swarm detour   round a repellent that lies across a path, in virtual time
//   pheromone-swarm live     one robot against a running pheromoned, in real time
//
// Exit status: 0 done; 1 the experiment could not be run; 2 the command line or a file is wrong.

#include <fmt/format.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "client_fw/swarm/detour_experiment.h"
#include "client_fw/swarm/live.h"
#include "client_fw/swarm/path_experiment.h"
#include "client_fw/swarm/picture.h"
#include "server/config/config.h"

namespace pheromone::swarm {
namespace {

constexpr int kFailed = 1;
constexpr int kWrongInput = 2;

volatile std::sig_atomic_t stop_requested = 0;

void OnStopSignal(int /*signal*/) {
  stop_requested = 1;
}

int Fail(const std::string& message, int status) {
  fmt::print(stderr, "pheromone-swarm: {}\n", message);
  return status;
}

// The exit status: 0, or kFailed at the first file that cannot be written.
int WriteFiles(const std::filesystem::path& folder,
               const std::vector<std::pair<std::string, std::string>>& contents) {
  for (const auto& [name, content] : contents) {
    std::ofstream file(folder / name, std::ios::binary);
    file << content;
    file.close();
    if (!file) {
      return Fail((folder / name).string() + ": cannot be written", kFailed);
    }
  }
  return 0;
}

// CLI::Range lets "nan" through.
CLI::Validator Between(double least, double most) {
  return {[=](std::string& text) {
            double value = 0;
            const bool good =
                CLI::detail::lexical_cast(text, value) && value >= least && value <= most;
            return good ? std::string()
                        : fmt::format("{} is not a number from {} to {}", text, least, most);
          },
          fmt::format("{} to {}", least, most)};
}

struct PathOptions {
  std::vector<Shape> shapes = {Shape::kLine, Shape::kCircle, Shape::kSCurve};
  std::vector<client::Law> laws = {client::Law::kDifferential, client::Law::kPaper};
  int seeds = 20;
  std::string out;
  PathExperiment experiment;
};

int RunPath(const PathOptions& options) {
  std::vector<PathSummary> summaries;
  std::string runs_csv = "path,law,seed,mean_error_mm,late_mean_error_mm,progress_percent\n";
  const size_t all = options.shapes.size() * options.laws.size();
  const bool progress = isatty(STDERR_FILENO) != 0;
  for (const Shape shape : options.shapes) {
    std::vector<Way> ways;
    PathExperiment experiment = options.experiment;
    experiment.shape = shape;
    for (const client::Law law : options.laws) {
      experiment.law = law;
      std::vector<PathRun> runs;
      for (int seed = 1; seed <= options.seeds; ++seed) {
        if (progress) {
          fmt::print(stderr, "\r{}/{} {} {}: seed {} of {}   ", summaries.size() + 1, all,
                     NameOf(shape), NameOf(law), seed, options.seeds);
        }
        runs.push_back(FollowPath(experiment, static_cast<uint64_t>(seed)));
        const PathRun& run = runs.back();
        runs_csv +=
            fmt::format("{},{},{},{:.1f},{:.1f},{:.1f}\n", NameOf(shape), NameOf(law), seed,
                        run.mean_error_m * 1000, run.late_mean_error_m * 1000, run.progress * 100);
        ways.push_back({fmt::format("law {}: {} runs of {:.0f} s", NameOf(law), options.seeds,
                                    static_cast<double>(experiment.duration_ms) / 1000),
                        law == client::Law::kDifferential ? "#2166ac" : "#b2182b", run.track,
                        seed == 1});
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
  if (progress) {
    fmt::print(stderr, "\r{:60}\r", "");
  }
  const std::string csv = ToCsv(summaries);
  fmt::print("{}", csv);
  if (!options.out.empty()) {
    return WriteFiles(options.out, {{"path.csv", csv}, {"path-runs.csv", runs_csv}});
  }
  return 0;
}

struct DetourOptions {
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
    const std::vector<DetourSeries> pictured(all.begin(), all.begin() + 2);
    const field::Field field(EngineConfigOf(pictured.front().experiment).field);
    return WriteFiles(options.out, {{"detour.csv", ToCsv(all)},
                                    {"detour.svg", Draw(PictureOf(pictured), field, 0)}});
  }
  return 0;
}

struct LiveOptions {
  std::string modem;
  std::string config;
  std::string out = ".";
  double seconds = 0;
  int speed_mm_s = 300;
  client::Law law = client::Law::kDifferential;
  int id = 1;
};

void ShowStatus(const LiveStatus& status) {
  const Sample& s = status.sample;
  const bool terminal = isatty(STDOUT_FILENO) != 0;
  // On a terminal one line is renewed, cut at the right edge rather than wrapped; elsewhere a line
  // a second is enough.
  if (!terminal && s.time_ms % 1000 != 0) {
    return;
  }
  fmt::print(
      "{}{:6.1f} s  pose {:5.2f} {:5.2f} m {:4.0f}°  P {:5.2f} {:5.2f}  wheels {:4d} {:4d} mm/s"
      "  off path {:4.0f} mm  {:3.1f} exch/s  channel {:4.1f} %{}{}",
      terminal ? "\r\x1b[?7l" : "", status.seconds, s.pose.x_m, s.pose.y_m,
      std::remainder(s.pose.heading_rad * 180 / std::numbers::pi, 360.0), s.p_left / 4096.0,
      s.p_right / 4096.0, s.wheels.left_mm_s, s.wheels.right_mm_s, s.distance_m * 1000,
      status.exchanges_per_s, status.utilisation * 100,
      status.connected ? (status.flags != 0 ? "  STOPPED" : "") : "  NO MODEM",
      terminal ? "\x1b[K\x1b[?7h" : "\n");
  std::fflush(stdout);
}

void PrintSummary(const LiveResult& result, const field::Path& path) {
  const client::Counters& c = result.last.counters;
  fmt::print(
      "\n{:.1f} s, {:.2f} m along the path; {} requests, {} hellos, {} resynchronisations; {} "
      "answers, "
      "{} greetings and echoes, {} timeouts, {} errors, {} late answers; {} fail-safe stops, {} "
      "reconnects; channel in use {:.1f} %\n",
      result.last.seconds, Progress(result.track, path), c.requests, c.hellos, c.resyncs, c.answers,
      c.hello_answers + c.echoes, c.timeouts, c.errors, c.late_answers, c.fail_safe_stops,
      result.reconnects, result.last.utilisation * 100);
  constexpr int64_t kSettledMs = 5000;
  fmt::print("mean distance from the path: {:.1f} mm", MeanDistance(result.track, 0) * 1000);
  if (result.last.sample.time_ms > kSettledMs) {
    fmt::print(", {:.1f} mm after the first 5 s", MeanDistance(result.track, kSettledMs) * 1000);
  }
  fmt::print("\n");
}

// 0.2 m to the left of the path's first point and 20 degrees off, as in the paper's experiment.
sim::PlanePose StartBeside(const field::Path& path) {
  const field::PointUm a = path.points[0];
  const field::PointUm b = path.points[1];
  const double heading = std::atan2(static_cast<double>(b.y - a.y), static_cast<double>(b.x - a.x));
  return {static_cast<double>(a.x) / 1e6 - 0.2 * std::sin(heading),
          static_cast<double>(a.y) / 1e6 + 0.2 * std::cos(heading),
          heading + 20 * std::numbers::pi / 180};
}

int RunLiveCommand(const LiveOptions& options) {
  const Result<config::Config> loaded =
      options.config.empty()
          ? config::ParseConfig(config::DefaultConfigText(), "default configuration")
          : config::LoadConfig(options.config);
  if (!loaded.ok()) {
    return Fail(loaded.error(), kWrongInput);
  }
  const field::FieldConfig& field_config = loaded.value().engine.field;
  if (field_config.paths.empty() || field_config.paths.front().points.size() < 2) {
    return Fail("the configuration has no [[path]] to follow", kWrongInput);
  }
  LiveConfig live;
  live.device = options.modem;
  live.path = field_config.paths.front();
  live.robot.client.id = static_cast<uint8_t>(options.id);
  live.robot.client.type = live.path.type;
  live.robot.client.law = options.law;
  live.robot.client.speed_mm_s = static_cast<int16_t>(options.speed_mm_s);
  live.robot.client.boot_counter = static_cast<uint16_t>(std::random_device{}());
  live.robot.client.buffered_link = true;
  live.robot.client.gap_timeout_ms = 50;
  live.robot.start = StartBeside(live.path);

  struct sigaction action {};
  action.sa_handler = OnStopSignal;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  const Result<LiveResult> result = RunLive(live, options.seconds, &stop_requested, ShowStatus);
  if (!result.ok()) {
    return Fail(result.error(), kFailed);
  }
  PrintSummary(result.value(), live.path);

  const field::Field field(field_config);
  const std::filesystem::path out(options.out);
  const Way way{fmt::format("robot {}, law {}, {:.0f} s", options.id, NameOf(options.law),
                            result.value().last.seconds),
                "#2166ac", result.value().track};
  const int status = WriteFiles(
      out, {{"track.csv", ToCsv(result.value().track)},
            {"track.svg",
             DrawPathPicture("A robot on a virtual pheromone path", field, live.path, {way}, 0)}});
  if (status != 0) {
    return status;
  }
  fmt::print("{}\n{}\n", (out / "track.csv").string(), (out / "track.svg").string());
  if (result.value().last.counters.answers == 0) {
    return Fail("the server never answered", kFailed);
  }
  return 0;
}

int Main(int argc, char** argv) {
  CLI::App app{"Experiments with simulated robots that follow virtual pheromones."};
  app.require_subcommand(1);
  const std::map<std::string, Shape> shapes = {
      {"line", Shape::kLine}, {"circle", Shape::kCircle}, {"s-curve", Shape::kSCurve}};
  const std::map<std::string, client::Law> laws = {{"differential", client::Law::kDifferential},
                                                   {"paper", client::Law::kPaper}};

  PathOptions path;
  PathExperiment& experiment = path.experiment;
  double duration_s = 10;
  CLI::App* path_command = app.add_subcommand(
      "path", "The paper's path-following experiment, in virtual time; prints a table as CSV");
  path_command->add_option("--path", path.shapes, "line, circle, s-curve (default: all)")
      ->transform(CLI::CheckedTransformer(shapes));
  path_command->add_option("--law", path.laws, "differential, paper (default: both)")
      ->transform(CLI::CheckedTransformer(laws));
  path_command->add_option("--seeds", path.seeds, "Runs of each (default: 20)")
      ->check(CLI::Range(1, 10'000));
  path_command->add_option("--seconds", duration_s, "Length of a run (default: 10)")
      ->check(Between(1.0, 3600.0));
  path_command->add_option("--speed", experiment.speed_mm_s, "K, mm/s (default: 300)")
      ->check(CLI::Range(20, 2000));
  path_command->add_option("--period-ms", experiment.period_ms, "Between requests (default: 200)")
      ->check(CLI::Range(50, 5000));
  path_command->add_option("--cell", experiment.cell_m, "a, m (default: 0.1)")
      ->check(Between(0.01, 1.0));
  path_command->add_option("--core", experiment.core_m, "c, m (default: 0.1)")
      ->check(Between(0.0, 2.0));
  path_command->add_option("--sigma", experiment.sigma_m, "sigma, m (default: 0.4)")
      ->check(Between(0.01, 5.0));
  path_command->add_option("--bias", experiment.antenna_distance_m, "b, m (default: 0.33)")
      ->check(Between(0.01, 2.0));
  path_command->add_option("--loss", experiment.frame_loss, "Share of frames lost (default: 0)")
      ->check(Between(0.0, 1.0));
  path_command->add_option("--out", path.out, "Folder for path.csv, path-runs.csv and pictures");

  DetourOptions detour;
  double detour_duration_s = 40;
  CLI::App* detour_command = app.add_subcommand(
      "detour",
      "Round a repellent patch that lies across a path, and back to the path; with and without the "
      "repellent, in virtual time; prints a table of the worst runs");
  detour_command
      ->add_option("--offset", detour.offsets_m,
                   "The patch's centre, m to the left of the path (default: 0.2 0)")
      ->check(Between(-1.0, 1.0));
  detour_command
      ->add_option("--weight", detour.weights, "Of the repellent in the blend (default: 0.3)")
      ->check(Between(0.0, 10.0));
  detour_command
      ->add_option("--radius", detour.experiment.patch_radius_m, "Of the patch, m (default: 0.3)")
      ->check(Between(0.1, 1.0));
  detour_command
      ->add_option("--core", detour.experiment.core_m, "c of both pheromones, m (default: 0.1)")
      ->check(Between(0.0, 1.0));
  detour_command
      ->add_option("--sigma", detour.experiment.sigma_m, "sigma of both, m (default: 0.8)")
      ->check(Between(0.01, 2.0));
  detour_command->add_option("--bias", detour.experiment.antenna_distance_m, "b, m (default: 0.33)")
      ->check(Between(0.01, 2.0));
  detour_command->add_option("--speed", detour.experiment.speed_mm_s, "K, mm/s (default: 300)")
      ->check(CLI::Range(20, 2000));
  detour_command->add_option("--seeds", detour.seeds, "Runs of each (default: 20)")
      ->check(CLI::Range(1, 10'000));
  detour_command
      ->add_option("--seconds", detour_duration_s,
                   "Longest run; one ends before the path does (default: 40)")
      ->check(Between(1.0, 3600.0));
  detour_command->add_option("--out", detour.out,
                             "Folder for detour.csv (all runs) and detour.svg "
                             "(those of the first offset and weight)");
  detour_command->footer(
      "The table has the worst of each series: runs that entered the patch, least distance to it "
      "(negative: inside), longest time inside, largest detour from the path, how many runs came "
      "back and how far behind the patch's centre, least progress as a share of K t.");

  LiveOptions live;
  CLI::App* live_command =
      app.add_subcommand("live", "One simulated robot against a running pheromoned, in real time");
  live_command->add_option("--modem", live.modem, "The terminal device that leads to the daemon")
      ->required();
  live_command->add_option("--config", live.config,
                           "The daemon's configuration, for its first [[path]] (default: the "
                           "built-in one)");
  live_command->add_option("--seconds", live.seconds, "End after this time (default: Ctrl-C)")
      ->check(Between(0.1, 1e7));
  live_command->add_option("--out", live.out, "Folder for track.csv and track.svg (default: .)");
  live_command->add_option("--speed", live.speed_mm_s, "K, mm/s (default: 300)")
      ->check(CLI::Range(20, 2000));
  live_command->add_option("--law", live.law, "differential, paper")
      ->transform(CLI::CheckedTransformer(laws));
  live_command->add_option("--id", live.id, "Client ID (default: 1)")->check(CLI::Range(1, 254));

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kWrongInput;
  }
  const std::string& out = path_command->parsed()     ? path.out
                           : detour_command->parsed() ? detour.out
                                                      : live.out;
  if (!out.empty()) {
    std::error_code error;
    std::filesystem::create_directories(out, error);
    if (error) {
      return Fail(out + ": " + error.message(), kWrongInput);
    }
  }
  if (path_command->parsed()) {
    experiment.duration_ms = static_cast<int64_t>(duration_s * 1000);
    return RunPath(path);
  }
  if (detour_command->parsed()) {
    detour.experiment.duration_ms = static_cast<int64_t>(detour_duration_s * 1000);
    return RunDetour(detour);
  }
  return RunLiveCommand(live);
}

}  // namespace
}  // namespace pheromone::swarm

int main(int argc, char** argv) {
  return pheromone::swarm::Main(argc, argv);
}
