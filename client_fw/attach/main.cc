// pheromone-robot: drives a real Pioneer from this computer, as the server's intensities tell.
//
// Exit status: 0 ended as told, and the robot stands; 1 the robot did not confirm that it stands,
// or another program has its port or the modem; 2 the command line is wrong.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "client_fw/attach/adapter.h"
#include "client_fw/attach/attach.h"
#include "client_fw/attach/connection.h"
#include "client_fw/attach/reporter.h"
#include "client_fw/attach/servers.h"
#include "client_fw/boards/host/plane_pose.h"
#include "client_fw/boards/host/real_time.h"
#include "client_fw/keys/robot_key.h"
#include "server/base/command_line.h"
#include "server/base/number_check.h"
#include "server/base/program.h"
#include "server/base/say_line.h"

namespace pheromone::attach {
namespace {

constexpr char kProgram[] = "pheromone-robot";

struct Options {
  std::string robot;
  std::vector<std::string> modem;
  uint32_t robot_baud = 9600;
  std::optional<uint32_t> modem_baud;
  std::array<double, 3> start{};  // x, y in m, heading in degrees
  double count_mm = client::kPioneerCount100Nm * 1e-4;
  client::Parameters client;
  std::string key;  // a file
  double seconds = 0;
  double status_s = 0;
};

// What is wrong with values that are right one by one; empty if nothing is.
std::string Conflict(const Options& options) {
  for (const double metres : {options.start[0], options.start[1]}) {
    if (!(std::abs(metres) <= client::kMaxCoordinateM)) {
      return fmt::format("--start: {} m, expected at most {:.0f} m from the origin", metres,
                         client::kMaxCoordinateM);
    }
  }
  if (!std::isfinite(options.start[2])) {
    return "--start: the heading is not a number of degrees";
  }
  const client::Parameters& client = options.client;
  if (client.fail_safe_ms <= client.period_ms) {
    return fmt::format("--fail-safe: {} ms, expected more than the period, {} ms",
                       client.fail_safe_ms, client.period_ms);
  }
  const int blind_mm = client.speed_mm_s * client.fail_safe_ms / 1000;
  if (blind_mm > client::kMaxBlindMm) {
    return fmt::format(
        "--fail-safe: at {} mm/s a robot drives {} mm in {} ms without an answer, expected at most "
        "{} mm",
        client.speed_mm_s, blind_mm, client.fail_safe_ms, client::kMaxBlindMm);
  }
  return "";
}

int Run(const Options& options) {
  if (const std::string conflict = Conflict(options); !conflict.empty()) {
    return Fail(kProgram, conflict, kWrongInput);
  }
  Result<Address> robot = ParseAddress(options.robot, options.robot_baud);
  if (!robot.ok()) {
    return Fail(kProgram, "--robot: " + robot.error(), kWrongInput);
  }
  if (robot.value().kind == Address::Kind::kUdp) {
    return Fail(kProgram, "--robot: a Pioneer is reached by a serial port or by TCP, not by UDP",
                kWrongInput);
  }
  const uint32_t modem_baud = options.modem_baud.value_or(9600);
  AttachOptions attach;
  attach.robot = std::move(robot).value();
  for (const std::string& text : options.modem) {
    Result<Address> modem = ParseAddress(text, modem_baud);
    if (!modem.ok()) {
      return Fail(kProgram, "--modem: " + modem.error(), kWrongInput);
    }
    attach.servers.push_back(std::move(modem).value());
    attach.servers.back().paced = options.modem_baud.has_value();
  }
  if (const Status list = CheckServers(attach.servers); !list.ok()) {
    return Fail(kProgram, "--modem: " + list.error(), kWrongInput);
  }
  const Address& modem = attach.servers.front();
  attach.client = options.client;
  attach.client.drive_scale = static_cast<uint16_t>(std::lround(options.count_mm * 1e4));
  const auto [x_m, y_m, heading_deg] = options.start;
  attach.client.start = client::ToClientPose({x_m, y_m, heading_deg * std::numbers::pi / 180});
  attach.client.boot_counter = static_cast<uint16_t>(std::random_device{}());
  keys::RobotKey key;
  if (!options.key.empty()) {
    Result<keys::RobotKey> taken = keys::TakeKey(options.key);
    if (!taken.ok()) {
      return Fail(kProgram, "--key: " + taken.error(), kWrongInput);
    }
    key = taken.value();
    attach.client.key = key.bytes.data();
    attach.client.boot_counter = key.start;
    if (key.open_to_others) {
      SayLine(0, fmt::format("{}: others may read or change it, expected mode 600", options.key));
    }
  }
  attach.client.baud = modem_baud;
  const bool serial = modem.kind == Address::Kind::kSerial;
  // Networks, and modems of this robot alone, deliver late and in pieces.
  attach.client.buffered_link = true;
  attach.client.adapter_ms = serial ? AdapterLatencyMs(modem.text) : uint8_t{0};
  attach.client.rounds = serial && attach.client.adapter_ms <= kRoundsLatencyMs;
  if (serial) {
    SayLine(0, fmt::format("modem {}: {}, so the robot {}", modem.text,
                           attach.client.adapter_ms == 0
                               ? "delivers at once"
                               : fmt::format("its adapter may hold bytes back for {} ms",
                                             attach.client.adapter_ms),
                           AccessText(attach.client.rounds)));
  }
  attach.client.gap_timeout_ms = modem.kind == Address::Kind::kSerial ? 50 : 0;
  attach.duration_ms = static_cast<int64_t>(options.seconds * 1000);
  attach.status_every_ms = static_cast<int64_t>(options.status_s * 1000);
  std::signal(SIGPIPE,
              SIG_IGN);  // whoever read our lines may go, the robot still has to be stopped
  const Result<bool> stands = Attach(attach, StopOnSignals());
  return !stands.ok() ? Fail(kProgram, stands.error(), kFailed) : stands.value() ? 0 : kFailed;
}

std::vector<uint32_t> Rates() {
  const auto rates = SerialRates();
  return {rates.begin(), rates.end()};
}

int Main(int argc, char** argv) {
  Options options;
  client::Parameters& client = options.client;
  CLI::App app{
      "Drives a real Pioneer robot (ARCOS) from this computer: reports its pose to a pheromone "
      "server over a modem or a network, and steers by the answers.",
      kProgram};
  Standardise(&app);
  app.set_version_flag("--version", "pheromone-robot " PHEROMONE_VERSION);
  app.add_option("--robot", options.robot, "The Pioneer: /dev/ttyUSB0, or HOST:PORT for TCP")
      ->required();
  app.add_option("--modem", options.modem,
                 "The way to the server: a serial port, HOST:PORT for TCP, or udp:HOST:PORT; once "
                 "more for each other server of a cluster, to go on with when one is silent")
      ->required()
      ->allow_extra_args(false);
  app.add_option("--start", options.start,
                 "Where the robot stands on the map: x and y in m, heading in degrees "
                 "counter-clockwise from +x; 0 0 0 if the server has a [[frame]] for it")
      ->required()
      ->type_name("X Y DEGREES");
  app.add_option("--id", client.id, "Robot ID, 1 to 254 (default: 1)")->check(WholeNumber(1, 254));
  app.add_option(
         "--count-mm", options.count_mm,
         "DistConvFactor of the robot's model, mm: 0.485 of a Pioneer 3-DX (default), 0.465 "
         "of a 3-AT; not used if the model's name ends in -sh")
      ->check(Number(0.01, 3));
  app.add_option("--type", client.type, "Pheromone to follow, 1 to 15 (default: 1)")
      ->check(WholeNumber(1, 15));
  app.add_option("--speed", client.speed_mm_s, "K of the steering law, mm/s (default: 200)")
      ->check(WholeNumber(20, 1000));
  app.add_option("--period", client.period_ms, "Time between requests, ms (default: 200)")
      ->check(WholeNumber(20, 2000));
  app.add_option("--fail-safe", client.fail_safe_ms,
                 "Longest drive without an answer, ms (default: 480)")
      ->check(WholeNumber(100, 2000));
  app.add_flag("--released", client.start_released,
               "Drive as soon as the server answers, instead of waiting for an operator's resume");
  app.add_flag("--sonar", client.sonar, "Use the front sonars: what is ahead limits the speed");
  app.add_flag("!--no-bumpers", client.bumpers,
               "The robot has no bumpers, and their bits mean nothing");
  app.add_flag("--lay-trail", client.lay_trail, "Deposit the pheromone while driving");
  app.add_flag("--wide", client.wide, "Send 32-bit coordinates, for large maps");
  app.add_option("--key", options.key,
                 "Sign frames with the key in this file, 32 hexadecimal digits, and ignore what "
                 "the server does not sign");
  app.add_option("--robot-baud", options.robot_baud, "Bit rate of the robot's port (default: 9600)")
      ->check(CLI::IsMember(Rates()));
  app.add_option("--modem-baud", options.modem_baud,
                 "Bit rate of the modem's port (default: 9600), also of one behind TCP or a pty")
      ->check(CLI::IsMember(Rates()));
  app.add_option("--status", options.status_s, "Print pose and speeds every so many seconds")
      ->check(Number(0.1, 1e7));
  app.add_option("--seconds", options.seconds, "End after this time (default: on a signal)")
      ->check(Number(0.1, 1e7));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kWrongInput;
  }
  return Run(options);
}

}  // namespace
}  // namespace pheromone::attach

int main(int argc, char** argv) {
  return pheromone::RunProgram(pheromone::attach::kProgram,
                               [&] { return pheromone::attach::Main(argc, argv); });
}
