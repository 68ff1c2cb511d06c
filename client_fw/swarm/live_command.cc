#include "client_fw/swarm/live_command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdio>
#include <memory>
#include <numbers>
#include <random>
#include <string>

#include "client_fw/swarm/command.h"
#include "client_fw/swarm/live.h"
#include "client_fw/swarm/path_experiment.h"
#include "client_fw/swarm/picture.h"
#include "server/config/config.h"

namespace pheromone::swarm {
namespace {

volatile std::sig_atomic_t stop_requested = 0;

void OnStopSignal(int /*signal*/) {
  stop_requested = 1;
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

}  // namespace

void AddLiveCommand(CLI::App* app, int* status) {
  auto options = std::make_shared<LiveOptions>();
  CLI::App* live_command =
      app->add_subcommand("live", "One simulated robot against a running pheromoned, in real time");
  live_command
      ->add_option("--modem", options->modem, "The terminal device that leads to the daemon")
      ->required();
  live_command->add_option("--config", options->config,
                           "The daemon's configuration, for its first [[path]] (default: the "
                           "built-in one)");
  live_command->add_option("--seconds", options->seconds, "End after this time (default: Ctrl-C)")
      ->check(Between(0.1, 1e7));
  live_command->add_option("--out", options->out,
                           "Folder for track.csv and track.svg (default: .)");
  live_command->add_option("--speed", options->speed_mm_s, "K, mm/s (default: 300)")
      ->check(CLI::Range(20, 2000));
  live_command->add_option("--law", options->law, "differential, paper")
      ->transform(CLI::CheckedTransformer(LawsByName()));
  live_command->add_option("--id", options->id, "Client ID (default: 1)")
      ->check(CLI::Range(1, 254));
  live_command->callback([options, status] { *status = RunLiveCommand(*options); });
}

}  // namespace pheromone::swarm
