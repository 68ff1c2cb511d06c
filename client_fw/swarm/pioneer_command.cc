#include "client_fw/swarm/pioneer_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <numbers>
#include <string>

#include "client_fw/sim/pioneer_robot.h"
#include "client_fw/sim/pioneer_server.h"
#include "client_fw/swarm/command.h"
#include "client_fw/boards/host/real_time.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kNsPerMs = 1'000'000;
constexpr double kDegree = std::numbers::pi / 180;
// The maximum delay until a client of the pty is noticed; bytes sent before are kept.
constexpr int64_t kAloneMs = 20;
constexpr int64_t kLongestWaitMs = 200;

struct PioneerOptions {
  std::string model = "p3dx";
  std::string pty;
  uint16_t tcp = 0;
  CLI::Option* pty_option = nullptr;
  sim::PioneerConfig config;
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

std::string PoseInWords(const sim::PlanePose& pose) {
  return fmt::format("{:.3f} {:.3f} m {:.1f}°", pose.x_m, pose.y_m,
                     std::remainder(pose.heading_rad / kDegree, 360.0));
}

// A line whenever something in it changes.
class Chronicle {
 public:
  void Look(const sim::PioneerRobot& robot, const sim::PioneerServer& server) {
    const std::string now =
        !robot.open() ? (server.connected() ? "client, no session" : "no client")
                      : fmt::format("session {}{}, motors {}{}", robot.counters().sessions,
                                    server.connected() ? "" : " without its client",
                                    robot.motors_enabled() ? "on" : "off",
                                    robot.counters().watchdog_stops == stops_ ? "" : ", silence");
    stops_ = robot.counters().watchdog_stops;
    if (now != last_) {
      fmt::print("{:8.1f} s  {}\n", static_cast<double>(robot.now_ns()) / 1e9, now);
      std::fflush(stdout);
      last_ = now;
    }
  }

 private:
  std::string last_;
  uint64_t stops_ = 0;
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
  const sim::PioneerConfig config = ConfigOf(options);
  sim::PioneerRobot robot(config, {});
  sim::PioneerServer server(&robot);
  const std::string error =
      options.pty_option->count() > 0 ? server.ServePty(options.pty) : server.ServeTcp(options.tcp);
  if (!error.empty()) {
    return Fail(error, kFailed);
  }
  const volatile std::sig_atomic_t* const stop = StopOnSignals();
  fmt::print("{} \"{}\" on {}; Ctrl-C ends it\n", config.model.subclass, config.name,
             server.address());

  Chronicle chronicle;
  const int64_t start_ns = MonotonicNs();
  while (*stop == 0) {
    const int64_t now_ns = MonotonicNs() - start_ns;
    server.Step(now_ns);
    chronicle.Look(robot, server);
    const int64_t longest_ms = server.connected() ? kLongestWaitMs : kAloneMs;
    const int64_t until_ns = std::min(robot.NextSipTime(), now_ns + longest_ms * kNsPerMs);
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
  command->add_option("--model", options->model, "Robot model (default: p3dx)")->check(ModelName());
  CLI::Option_group* port = command->add_option_group("port", "How clients connect");
  options->pty_option =
      port->add_option("--pty", options->pty, "Symbolic link to create for a pseudo-terminal");
  port->add_option("--tcp", options->tcp, "Port on 127.0.0.1, for one client (0: any free port)");
  port->require_option(1);
  command->add_option("--name", options->config.name,
                      "Name reported to clients (default: Simulated)");
  command
      ->add_option("--drift", options->drift_percent,
                   "Maximum scale error of odometry, percent (default: 0)")
      ->check(Between(0, 50));
  command
      ->add_option("--heading-drift", options->heading_drift_deg_m,
                   "Maximum heading drift of odometry, degrees per metre (default: 0)")
      ->check(Between(0, 45));
  command->add_option("--slip", options->slip_percent, "Maximum wheel slip, percent (default: 0)")
      ->check(Between(0, 100));
  command
      ->add_option("--wheelbase", options->wheelbase_mm,
                   "True distance between the wheels, mm (default: as configured in the firmware)")
      ->check(Between(50, 2000));
  command->add_option("--seed", options->seed, "Random seed of drift and slip (default: 1)");
  command
      ->add_option("--sonars", options->config.sonars,
                   "Number of sonar readings in a SIP (default: 16)")
      ->check(CLI::Range(0, static_cast<int>(sim::kMaxSonarReadings)));
  command->add_option("--wrap", options->config.position_bits, "X and Y wrap at 15 or 16 bits")
      ->check(CLI::IsMember({15, 16}));
  command->add_flag("--short-sips", options->short_sips, "Send the shorter SIPs of older firmware");
  command->add_flag("--mobilesim", options->mobilesim,
                    "Keep driving when the client falls silent, instead of stopping after 2 s");
  command->callback([options, status] { *status = RunPioneer(*options); });
}

}  // namespace pheromone::swarm
