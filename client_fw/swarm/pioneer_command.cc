// pheromone-swarm pioneer: a simulated Pioneer in real time, for any ARCOS client.
//
//   pheromone-swarm pioneer --model p3dx-sh --pty pioneer.pty
//   pheromone-swarm pioneer --tcp 8101 --drift 2 --slip 5 --seed 7
//
// Runs until SIGTERM or SIGINT, and removes the pty's link then. Handles the two signals while it
// runs. One thread. Exit status: 0 ended by a signal, kFailed the port could not be opened.
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client_fw/boards/host/real_time.h"
#include "client_fw/sim/pioneer/pioneer_robot.h"
#include "client_fw/sim/pioneer/pioneer_server.h"
#include "client_fw/swarm/collision.h"
#include "client_fw/swarm/command.h"
#include "client_fw/swarm/commands.h"
#include "server/base/number_check.h"
#include "server/base/standard_output.h"
#include "server/config/config.h"
#include "server/core/field/obstacles.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kNsPerMs = 1'000'000;
constexpr double kDegree = std::numbers::pi / 180;
// The maximum delay until a client of the pty is noticed; bytes sent before are kept.
constexpr int64_t kAloneMs = 20;
constexpr int64_t kLongestWaitMs = 200;
constexpr double kRenewS = 0.2;  // the line with the true pose on a terminal
constexpr double kMaxBatteryV = 25.5;
constexpr double kWallM = 0.05;         // thickness
constexpr double kFarthestWallM = 250;  // from the origin, so that they fit a map

struct PioneerOptions {
  std::string model = "p3dx";
  std::string pty;
  uint16_t tcp = 0;
  CLI::Option* pty_option = nullptr;
  sim::PioneerConfig config;
  std::string surroundings;
  std::vector<double> walls_m;  // x0, y0, x1, y1 of each
  std::vector<double> start = {0, 0, 0};
  double poses_s = 0;
  double drift_percent = 0;
  double heading_drift_deg_m = 0;
  double slip_percent = 0;
  double wheelbase_mm = 0;
  uint64_t seed = 1;
  bool mobilesim = false;
  bool short_sips = false;
};

sim::PioneerConfig ConfigOf(const PioneerOptions& options) {
  sim::PioneerConfig config = options.config;
  config.model = *sim::FindPioneerModel(options.model);
  sim::PioneerErrors most;
  most.scale = options.drift_percent / 100;
  most.heading_rad_per_m = options.heading_drift_deg_m * kDegree;
  most.slip = options.slip_percent / 100;
  config.errors = sim::DrawPioneerErrors(most, options.seed);
  config.wheelbase_m = options.wheelbase_mm / 1000;
  if (options.mobilesim) {
    config.watchdog_ms = 0;
  }
  if (options.short_sips) {
    config.sip_form = sim::SipForm::kShort;
  }
  return config;
}

int64_t ToUm(double metres) {
  return std::llround(metres * 1e6);
}

// A map just large enough for these walls.
field::FieldConfig FieldWith(const std::vector<double>& walls_m) {
  constexpr int64_t kCellUm = 20'000;
  std::vector<field::PointUm> ends;
  for (size_t i = 0; i + 1 < walls_m.size(); i += 2) {
    ends.push_back({ToUm(walls_m[i]), ToUm(walls_m[i + 1])});
  }
  const auto by_x = [](const field::PointUm& a, const field::PointUm& b) { return a.x < b.x; };
  const auto by_y = [](const field::PointUm& a, const field::PointUm& b) { return a.y < b.y; };
  const auto [left, right] = std::minmax_element(ends.begin(), ends.end(), by_x);
  const auto [bottom, top] = std::minmax_element(ends.begin(), ends.end(), by_y);
  const int64_t margin_um = ToUm(kWallM);
  field::FieldConfig field;
  field.map = {.origin = {left->x - margin_um, bottom->y - margin_um},
               .width_um = right->x - left->x + 2 * margin_um,
               .height_um = top->y - bottom->y + 2 * margin_um,
               .cell_um = kCellUm};
  field::ObstacleMask mask(field.map.columns(), field.map.rows());
  for (size_t i = 0; i + 1 < ends.size(); i += 2) {
    field::BlockLine(field.map, std::span(ends).subspan(i, 2), ToUm(kWallM), &mask);
  }
  field.obstacles = field::Shared(std::move(mask));
  return field;
}

// Puts obstacles in the robot's way: walls, or those of a server's configuration. Returns an error,
// or "".
std::string AddObstacles(const PioneerOptions& options, const sim::PlanePose& start,
                         sim::PioneerConfig* config) {
  field::FieldConfig field;
  if (!options.surroundings.empty()) {
    PHEROMONE_TRY(const config::Config loaded, config::LoadConfig(options.surroundings));
    field = loaded.engine.field;
  } else if (!options.walls_m.empty()) {
    if (options.walls_m.size() % 4 != 0) {
      return fmt::format("--wall: found {} numbers, expected four for each wall: X0 Y0 X1 Y1",
                         options.walls_m.size());
    }
    field = FieldWith(options.walls_m);
  }
  const double radius_m = config->model.radius_mm / 1000.0;
  config->blocked = BlockedBy(field, radius_m);
  config->range = RangeTo(field);
  if (config->blocked && config->blocked(start)) {
    return fmt::format(
        "--start: a {} at {} {} m touches an obstacle, expected at least {} m between its centre "
        "and every obstacle",
        config->model.subclass, start.x_m, start.y_m, radius_m);
  }
  return "";
}

std::string PoseInWords(const sim::PlanePose& pose) {
  return fmt::format("{:.3f} {:.3f} m {:.1f}°", pose.x_m, pose.y_m,
                     std::remainder(pose.heading_rad / kDegree, 360.0));
}

// What happens, a line each, and the true pose: on a terminal in a last line that is renewed, else
// in lines at the interval that was asked for, if any.
class Reports {
 public:
  /// 0 seconds: on a terminal only.
  explicit Reports(double poses_s)
      : renews_(poses_s == 0 && isatty(STDOUT_FILENO) != 0),
        interval_ns_(std::llround((renews_ ? kRenewS : poses_s) * 1e9)) {}

  void Look(const sim::PioneerRobot& robot, const sim::PioneerServer& server) {
    const std::string now = StateOf(robot, server);
    if (now != last_) {
      Print(robot, now + (renews_ ? "\x1b[K\n" : "\n"));
      last_ = now;
    }
    if (interval_ns_ > 0 && robot.now_ns() >= next_ns_) {
      next_ns_ = robot.now_ns() + interval_ns_;
      Print(robot, fmt::format("true pose {}{}", PoseInWords(robot.drive().true_pose()),
                               renews_ ? "\x1b[K" : "\n"));
    }
  }

  /// When the next pose is to be printed.
  int64_t next_ns() const { return interval_ns_ > 0 ? next_ns_ : sim::PioneerRobot::kNever; }

 private:
  void Print(const sim::PioneerRobot& robot, const std::string& text) const {
    fmt::print(Unescaped(stdout), "{}{:8.1f} s  {}", renews_ ? "\r" : "",
               static_cast<double>(robot.now_ns()) / 1e9, text);
  }

  std::string StateOf(const sim::PioneerRobot& robot, const sim::PioneerServer& server) {
    std::string state =
        robot.open()         ? fmt::format("session {}, motors {}{}", robot.counters().sessions,
                                   robot.motors_enabled() ? "on" : "off",
                                   robot.counters().watchdog_stops == stops_ ? "" : ", silence")
        : server.connected() ? "client, no session"
                             : "no client";
    stops_ = robot.counters().watchdog_stops;
    const sim::PressedBumpers bumpers = robot.bumpers();
    state += robot.stop_pressed() ? ", STOP pressed" : "";
    state += robot.drive().stalled() ? ", stalled" : "";
    state += bumpers.front != 0 ? ", bumper in front" : "";
    state += bumpers.rear != 0 ? ", bumper behind" : "";
    return state;
  }

  bool renews_;
  int64_t interval_ns_;
  int64_t next_ns_ = 0;
  std::string last_;
  uint64_t stops_ = 0;
};

// The robot's control panel, one command a line on standard input: its STOP button and its battery.
// After the end of the input, or in the background of a terminal, nothing more is read.
class ControlPanel {
 public:
  ControlPanel() {
    std::signal(SIGTTIN, SIG_IGN);
  }  // then a read fails instead of stopping the program

  void Look(sim::PioneerRobot* robot) {
    pollfd input = {STDIN_FILENO, POLLIN, 0};
    if (!open_ || poll(&input, 1, 0) <= 0) {
      return;
    }
    std::array<char, 256> buffer{};
    const ssize_t size = read(STDIN_FILENO, buffer.data(), buffer.size());
    open_ = size > 0;
    for (const char c : std::string_view(buffer.data(), size > 0 ? static_cast<size_t>(size) : 0)) {
      if (c == '\n') {
        Obey(line_, robot);
        line_.clear();
      } else if (line_.size() < kMaxLine) {
        line_ += c;
      }
    }
  }

 private:
  static constexpr size_t kMaxLine = 80;
  static constexpr std::string_view kBattery = "battery ";

  static void Obey(const std::string& line, sim::PioneerRobot* robot) {
    if (line == "stop" || line == "release") {
      robot->set_stop_pressed(line == "stop");
      return;
    }
    if (line.starts_with(kBattery)) {
      char* end = nullptr;
      const double volts = std::strtod(line.c_str() + kBattery.size(), &end);
      if (end != line.c_str() + kBattery.size() && *end == '\0' && volts >= 0 &&
          volts <= kMaxBatteryV) {
        robot->set_battery_v(volts);
        return;
      }
    }
    fmt::print(stderr,
               "standard input: found \"{}\", expected \"stop\", \"release\" (the STOP button) or "
               "\"battery V\" (0 to {} V)\n",
               line, kMaxBatteryV);
  }

  bool open_ = true;
  std::string line_;
};

void PrintSummary(const sim::PioneerRobot& robot) {
  const sim::PioneerCounters counters = robot.counters();
  fmt::print(
      "\n{:.1f} s; {} sessions; {} commands, {} of them ignored, {} damaged; {} SIPs; {} watchdog "
      "stops\nodometry {}, true pose {}\n",
      static_cast<double>(robot.now_ns()) / 1e9, counters.sessions, counters.packets,
      counters.ignored, counters.bad_checksums, counters.sips, counters.watchdog_stops,
      PoseInWords(robot.drive().odometry()), PoseInWords(robot.drive().true_pose()));
}

int RunPioneer(const PioneerOptions& options) {
  sim::PioneerConfig config = ConfigOf(options);
  const sim::PlanePose start = {options.start[0], options.start[1], options.start[2] * kDegree};
  if (const std::string error = AddObstacles(options, start, &config); !error.empty()) {
    return Fail(error, kWrongInput);
  }
  sim::PioneerRobot robot(config, start);
  sim::PioneerServer server(&robot);
  const std::string error =
      options.pty_option->count() > 0 ? server.ServePty(options.pty) : server.ServeTcp(options.tcp);
  if (!error.empty()) {
    return Fail(error, kFailed);
  }
  const volatile std::sig_atomic_t* const stop = StopOnSignals();
  fmt::print("{} \"{}\" on {}; Ctrl-C ends it\n", config.model.subclass, config.name,
             server.address());

  Reports reports(options.poses_s);
  ControlPanel panel;
  const int64_t start_ns = MonotonicNs();
  while (*stop == 0) {
    const int64_t now_ns = MonotonicNs() - start_ns;
    server.Step(now_ns);
    panel.Look(&robot);
    reports.Look(robot, server);
    const int64_t longest_ms = server.connected() ? kLongestWaitMs : kAloneMs;
    const int64_t until_ns = std::max(
        now_ns, std::min({robot.NextSipTime(), reports.next_ns(), now_ns + longest_ms * kNsPerMs}));
    server.Wait(static_cast<int>((until_ns - now_ns + kNsPerMs - 1) / kNsPerMs));
  }
  PrintSummary(robot);
  return 0;
}

CLI::Validator ModelName() {
  std::string names;
  for (const sim::PioneerModel& model : sim::PioneerModels()) {
    names += (names.empty() ? "" : ", ") + std::string(model.subclass);
  }
  return {[names](const std::string& text) {
            return sim::FindPioneerModel(text) != nullptr
                       ? std::string()
                       : fmt::format("unknown model {}, expected one of {}", text, names);
          },
          names};
}

}  // namespace

void AddPioneerCommand(CLI::App* app, int* status) {
  const auto options = std::make_shared<PioneerOptions>();
  CLI::App* command = app->add_subcommand(
      "pioneer", "A simulated Pioneer robot that speaks ARCOS, in real time, until Ctrl-C");
  command->footer(
      "Lines on standard input: \"stop\" presses the STOP button, \"release\" releases it, "
      "\"battery "
      "11.2\" sets the voltage.");
  command->add_option("--model", options->model, "Robot model (default: p3dx)")->check(ModelName());
  CLI::Option_group* port = command->add_option_group("port", "How clients connect");
  options->pty_option =
      port->add_option("--pty", options->pty, "Symbolic link to create for a pseudo-terminal")
          ->type_name("PATH");
  port->add_option("--tcp", options->tcp, "Port on 127.0.0.1, for one client (0: any free port)")
      ->type_name("PORT");
  port->require_option(1);
  CLI::Option* walls =
      command
          ->add_option("--wall", options->walls_m,
                       "A wall, 5 cm thick, between two points, m; more of them: again")
          ->check(Number(-kFarthestWallM, kFarthestWallM))
          ->type_name("X0 Y0 X1 Y1");
  command
      ->add_option("--config", options->surroundings,
                   "A server's configuration, whose [obstacles] stand in the robot's way")
      ->excludes(walls)
      ->type_name("FILE");
  command
      ->add_option("--start", options->start,
                   "True pose at the start on that map: m, m, degrees (default: 0 0 0)")
      ->expected(3)
      ->check(Number(-1e6, 1e6))
      ->type_name("X Y HEADING");
  command->add_option("--battery", options->config.battery_v, "Battery, V (default: 12.8)")
      ->check(Number(0, kMaxBatteryV))
      ->type_name("VOLTS");
  command
      ->add_option("--bumpers", options->config.bumpers,
                   "Segments of the bumpers in front and behind (default: 5; 0: no bumpers)")
      ->check(WholeNumber(0, 7))
      ->type_name("N");
  command
      ->add_option(
          "--poses", options->poses_s,
          "Print the true pose at this interval, s (default: on a terminal, in a line that "
          "is renewed)")
      ->check(Number(0.01, 1e6))
      ->type_name("S");
  command
      ->add_option("--name", options->config.name, "Name reported to clients (default: Simulated)")
      ->type_name("NAME");
  command
      ->add_option("--drift", options->drift_percent,
                   "Maximum scale error of odometry, percent (default: 0)")
      ->check(Number(0, 50))
      ->type_name("PERCENT");
  command
      ->add_option("--heading-drift", options->heading_drift_deg_m,
                   "Maximum heading drift of odometry, degrees per metre (default: 0)")
      ->check(Number(0, 45))
      ->type_name("DEGREES");
  command->add_option("--slip", options->slip_percent, "Maximum wheel slip, percent (default: 0)")
      ->check(Number(0, 100))
      ->type_name("PERCENT");
  command
      ->add_option("--wheelbase", options->wheelbase_mm,
                   "True distance between the wheels, mm (default: as configured in the firmware)")
      ->check(Number(50, 2000))
      ->type_name("MM");
  command->add_option("--seed", options->seed, "Random seed of drift and slip (default: 1)")
      ->type_name("N");
  command
      ->add_option("--sonars", options->config.sonars,
                   "Sonar readings in a SIP, of which more sonars take turns (default: 16)")
      ->check(WholeNumber(0, static_cast<int>(sim::kMaxSonarReadings)))
      ->type_name("N");
  command->add_option("--wrap", options->config.position_bits, "X and Y wrap at 15 or 16 bits")
      ->check(CLI::IsMember({15, 16}));
  command->add_flag("--short-sips", options->short_sips, "Send the shorter SIPs of older firmware");
  command->add_flag("--mobilesim", options->mobilesim,
                    "Keep driving when the client falls silent, instead of stopping after 2 s");
  command->callback([options, status] { *status = RunPioneer(*options); });
}

}  // namespace pheromone::swarm
