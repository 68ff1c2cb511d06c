// pheromone-swarm live: one robot against a running pheromoned, in real time.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <utility>

#include "client_fw/boards/host/real_time.h"
#include "client_fw/boards/host/stop_text.h"
#include "client_fw/core/steering/settings.h"
#include "client_fw/swarm/command.h"
#include "client_fw/swarm/commands.h"
#include "client_fw/swarm/live.h"
#include "client_fw/swarm/path_experiment.h"
#include "client_fw/swarm/picture.h"
#include "client_fw/swarm/recorder.h"
#include "server/base/number_check.h"
#include "server/base/standard_output.h"
#include "server/config/config.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kShowMs = 200;
constexpr int64_t kRateMs = 1000;

struct LiveOptions {
  std::string modem;
  std::string config;
  std::string out = ".";
  double seconds = 0;
  int speed_mm_s = 300;
  client::Law law = client::Settings().law;
  int id = 1;
  std::string keys;  // a file; empty: frames are not signed
  bool medium_access = false;
};

// One line about the robot, five times a second.
class LiveLine {
 public:
  LiveLine(const LiveSwarm* live, field::Path path) : live_(live), path_(std::move(path)) {}

  void Show() {
    const int64_t now_ms = live_->swarm().now_ms();
    const double rate = ExchangesPerSecond(now_ms);
    // On a terminal one line is renewed, cut at the right edge rather than wrapped; elsewhere a
    // line a second is enough.
    if (!terminal_ && now_ms % 1000 != 0) {
      return;
    }
    const sim::MobileRobot& robot = live_->swarm().robot(0);
    const Sample s = Observe(robot, path_, now_ms);
    fmt::print(
        Unescaped(stdout),
        "{}{:6.1f} s  pose {:5.2f} {:5.2f} m {:4.0f}°  P {:5.2f} {:5.2f}  wheels {:4d} {:4d} mm/s"
        "  off path {:4.0f} mm  {:3.1f} exch/s  channel {:4.1f} %{}{}",
        terminal_ ? "\r\x1b[?7l" : "", static_cast<double>(now_ms) / 1000, s.pose.x_m, s.pose.y_m,
        std::remainder(s.pose.heading_rad * 180 / std::numbers::pi, 360.0), s.p_left / 4096.0,
        s.p_right / 4096.0, s.wheels.left_mm_s, s.wheels.right_mm_s, s.distance_m * 1000, rate,
        live_->swarm().medium(0).Utilisation() * 100,
        !live_->modem(0).connected() ? "  no modem"
        : robot.flags() != 0         ? "  stands: " + client::StopText(robot.flags())
                                     : "",
        terminal_ ? "\x1b[K\x1b[?7h" : "\n");
  }

 private:
  // Over the last second.
  double ExchangesPerSecond(int64_t now_ms) {
    const uint32_t now = live_->swarm().robot(0).counters().answers;
    answers_.emplace_back(now_ms, now);
    while (answers_.size() > 2 && answers_.front().first < now_ms - kRateMs) {
      answers_.pop_front();
    }
    const auto& [then_ms, then] = answers_.front();
    return (now - then) * 1000.0 / static_cast<double>(std::max<int64_t>(now_ms - then_ms, 1));
  }

  const LiveSwarm* live_;
  field::Path path_;
  bool terminal_ = isatty(STDOUT_FILENO) != 0;
  std::deque<std::pair<int64_t, uint32_t>> answers_;  // (time, answers so far)
};

void PrintSummary(const SwarmRecord& record, uint64_t reconnects) {
  const RobotRecord& robot = record.robots.front();
  const client::Counters& c = robot.counters;
  fmt::print(
      "\n{:.1f} s, {:.2f} m along the path; {} requests, {} hellos, {} resynchronisations; {} "
      "answers, {} HELLO and PING answers, {} timeouts, {} errors, {} late answers; {} fail-safe "
      "stops, {} reconnects; channel in use {:.1f} %\n",
      static_cast<double>(record.duration_ms) / 1000, robot.progress_m, c.requests, c.hellos,
      c.resyncs, c.answers, c.hello_answers + c.echoes, c.timeouts, c.errors, c.late_answers,
      c.fail_safe_stops, reconnects, record.channels.front().utilisation * 100);
  constexpr int64_t kSettledMs = 5000;
  fmt::print("mean distance from the path: {:.1f} mm", robot.mean_error_m * 1000);
  if (record.duration_ms > kSettledMs) {
    fmt::print(", {:.1f} mm after the first 5 s", MeanDistance(robot.track, kSettledMs) * 1000);
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
  const Result<config::Config> loaded = config::LoadConfigOrDefault(options.config);
  if (!loaded.ok()) {
    return Fail(loaded.error(), kWrongInput);
  }
  const field::FieldConfig& field_config = loaded.value().engine.field;
  if (field_config.paths.empty() || field_config.paths.front().points.size() < 2) {
    return Fail("the configuration has no [[path]] to follow", kWrongInput);
  }
  const field::Path& path = field_config.paths.front();
  SwarmConfig swarm;
  swarm.robot.client.id = static_cast<uint8_t>(options.id);
  swarm.robot.client.type = path.type;
  swarm.robot.client.law = options.law;
  swarm.robot.client.speed_mm_s = static_cast<int16_t>(options.speed_mm_s);
  swarm.robot.client.boot_counter = static_cast<uint16_t>(std::random_device{}());
  swarm.robot.client.buffered_link = !options.medium_access;
  swarm.robot.client.rounds = options.medium_access;
  swarm.robot.client.gap_timeout_ms = kBufferedGapMs;
  swarm.robot.start = StartBeside(path);
  const Result<keys::RobotsKeys> robots_keys = SignWith(options.keys, &swarm);
  if (!robots_keys.ok()) {
    return Fail(robots_keys.error(), kWrongInput);
  }
  LiveSwarm live(swarm, {options.modem});
  if (const Status opened = live.Open(); !opened.ok()) {
    return Fail(opened.error(), kFailed);
  }
  LiveLine line(&live, path);
  Recorder recorder(&live.swarm(), field_config, kShowMs);
  live.Run(static_cast<int64_t>(options.seconds * 1000), StopOnSignals(), [&] {
    if (recorder.Look()) {
      line.Show();
    }
  });
  const SwarmRecord record = recorder.Finish();
  PrintSummary(record, live.modem(0).reconnects());

  const field::Field field(field_config);
  const std::filesystem::path out(options.out);
  const std::vector<Sample>& track = record.robots.front().track;
  const Way way{fmt::format("robot {}, law {}, {:.0f} s", options.id, NameOf(options.law),
                            static_cast<double>(record.duration_ms) / 1000),
                "#2166ac", track};
  const int status = WriteFiles(
      out, {{"track.csv", ToCsv(track)},
            {"track.svg",
             DrawPathPicture("A robot on a virtual pheromone path", field, path, {way}, 0)}});
  if (status != 0) {
    return status;
  }
  fmt::print("{}\n{}\n", (out / "track.csv").string(), (out / "track.svg").string());
  if (record.robots.front().counters.answers == 0) {
    return Fail("received no answer from the server", kFailed);
  }
  return 0;
}

}  // namespace

void AddLiveCommand(CLI::App* app, int* status) {
  auto options = std::make_shared<LiveOptions>();
  CLI::App* live_command =
      app->add_subcommand("live", "One simulated robot against a running server, in real time");
  live_command
      ->add_option("--modem", options->modem,
                   "Terminal device of the server's link: radio-a.pty, /dev/ttyUSB0")
      ->required()
      ->check(TerminalDevice())
      ->type_name("TERMINAL");
  live_command
      ->add_option("--config", options->config,
                   "The server's configuration, whose first [[path]] is followed "
                   "(default: the built-in configuration)")
      ->type_name("FILE");
  live_command
      ->add_option("--seconds", options->seconds, "Stop after this time (default: on Ctrl-C)")
      ->check(Number(0.1, 1e7))
      ->type_name("S");
  live_command->add_option("--out", options->out, "Folder for track.csv and track.svg (default: .)")
      ->type_name("FOLDER");
  live_command->add_option("--speed", options->speed_mm_s, "K, mm/s (default: 300)")
      ->check(WholeNumber(20, 2000))
      ->type_name("MM_PER_S");
  live_command->add_option("--law", options->law, "differential, paper, careful (default: careful)")
      ->transform(OneOf(LawsByName()))
      ->type_name("NAME");
  live_command->add_option("--id", options->id, "Robot ID (default: 1)")
      ->check(WholeNumber(1, 254))
      ->type_name("ID");
  live_command
      ->add_option("--keys", options->keys,
                   "Sign frames with the robot's key in this file, which is like the server's")
      ->type_name("FILE");
  live_command->add_flag("--medium-access", options->medium_access,
                         "The server's link has medium_access = true, so the robot takes turns");
  live_command->callback([options, status] { *status = RunLiveCommand(*options); });
}

}  // namespace pheromone::swarm
