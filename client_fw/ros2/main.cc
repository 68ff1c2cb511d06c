// pheromone-ros2: joins robots of ROS 2 with a pheromone server.
//
// Exit status: 0 ended as told; 1 DDS cannot start; 2 the command line, the environment or the file
// with keys is wrong.
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "client_fw/boards/host/real_time.h"
#include "client_fw/keys/robots_keys.h"
#include "client_fw/ros2/bridge.h"
#include "client_fw/ros2/environment.h"
#include "client_fw/ros2/options.h"
#include "server/base/command_line.h"
#include "server/base/number_check.h"
#include "server/base/program.h"

namespace pheromone::ros2 {
namespace {

constexpr char kProgram[] = "pheromone-ros2";

struct Words {
  std::vector<std::string> robots;
  std::vector<std::string> servers;
  std::vector<std::string> allowed;
  std::string pose = "start";
  std::string distro = "auto";
};

Status Read(const Words& words, const std::vector<std::string>& for_robots,
            BridgeOptions* options) {
  for (const std::string& text : words.robots) {
    Result<RobotEntry> robot = ParseRobot(text);
    if (!robot.ok()) {
      return Error{"--robot: " + robot.error()};
    }
    options->robots.push_back(std::move(robot).value());
  }
  for (const std::string& text : words.servers) {
    Result<attach::Address> server = attach::ParseAddress(text, 9600);
    if (!server.ok()) {
      return Error{"--server: " + server.error()};
    }
    options->servers.push_back(std::move(server).value());
  }
  for (const std::string& input : words.allowed) {
    Allowed& allowed = options->allowed;
    (input == "enable"    ? allowed.enable
     : input == "halt"    ? allowed.halt
     : input == "goal"    ? allowed.goal
     : input == "deposit" ? allowed.deposit
                          : allowed.paint) = true;
  }
  options->localisation = words.pose == "tf"     ? Localisation::kTf
                          : words.pose == "amcl" ? Localisation::kAmcl
                                                 : Localisation::kStart;
  options->distro = words.distro == "auto"     ? Distro::kAuto
                    : words.distro == "humble" ? Distro::kHumble
                                               : Distro::kIron;
  return CheckOptions(*options, for_robots);
}

int Main(int argc, char** argv) {
  BridgeOptions options;
  Words words;
  client::Parameters& client = options.client;
  client.wide = true;
  CLI::App app{
      "Joins robots of ROS 2 with a pheromone server: reads their odometry, and drives them by "
      "cmd_vel as the server's intensities tell.",
      kProgram};
  Standardise(&app);
  app.set_version_flag("--version", "pheromone-ros2 " PHEROMONE_VERSION);
  app.add_option("--robot", words.robots,
                 "A robot: its namespace, its ID and, unless --pose says otherwise, where it "
                 "stands on the map in m and degrees, such as tb1:1:5,3,-15; once for each")
      ->allow_extra_args(false)
      ->type_name("NAMESPACE:ID[:X,Y,DEGREES]");
  app.add_option("--server", words.servers,
                 "The server's link: udp:HOST:PORT, or HOST:PORT for TCP; once more for each other "
                 "server of a cluster")
      ->allow_extra_args(false);
  app.add_option(
         "--allow", words.allowed,
         "An input that changes something: enable, halt, goal, deposit, paint; once for each")
      ->allow_extra_args(false)
      ->check(CLI::IsMember({"enable", "halt", "goal", "deposit", "paint"}));
  app.add_option("--socket", options.socket,
                 "The server's control socket, on this machine: publish maps, markers and states, "
                 "and send orders");
  app.add_option("--link", options.link,
                 "The name of the server's link that --server leads to, for goals, and for the "
                 "frames of robots that a tracker sees");
  app.add_option("--keys", options.keys,
                 "Sign frames with the robots' keys in this file, which is like the server's, and "
                 "ignore what it has not signed");
  app.add_option("--pose", words.pose,
                 "Where poses on the map come from: start, tf, amcl (default: start)")
      ->check(CLI::IsMember({"start", "tf", "amcl"}));
  app.add_option("--map-frame", options.map_frame, "The frame of the map (default: map)");
  app.add_option("--track", options.track_m,
                 "Distance of a robot's wheels, m (default: 0.16, a TurtleBot3 Burger)")
      ->check(Number(0.01, 10));
  app.add_flag("--stamped", options.stamped, "cmd_vel is TwistStamped, as robots of Jazzy expect");
  app.add_option("--distro", words.distro,
                 "What `ros2 node list` belongs to: humble, iron (and later), auto (default: auto, "
                 "as other nodes show)")
      ->check(CLI::IsMember({"auto", "humble", "iron"}));
  app.add_option("--type", client.type, "Pheromone to follow, 1 to 15 (default: 1)")
      ->check(WholeNumber(1, 15));
  app.add_option("--speed", client.speed_mm_s, "K of the steering law, mm/s (default: 200)")
      ->check(WholeNumber(20, 1000));
  app.add_option("--period", client.period_ms, "Time between requests, ms (default: 200)")
      ->check(WholeNumber(20, 2000));
  app.add_option("--fail-safe", client.fail_safe_ms,
                 "Longest drive without an answer, ms (default: 480)")
      ->check(WholeNumber(100, 2000));
  app.add_flag("--lay-trail", client.lay_trail, "Deposit the pheromone while driving");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kWrongInput;
  }
  std::vector<std::string> for_robots;
  for (const char* name : {"--pose", "--track", "--stamped", "--type", "--speed", "--period",
                           "--fail-safe", "--lay-trail", "--keys"}) {
    if (app.count(name) > 0) {
      for_robots.emplace_back(name);
    }
  }
  if (const Status read = Read(words, for_robots, &options); !read.ok()) {
    return Fail(kProgram, read.error(), kWrongInput);
  }
  const Result<Discovery> discovery = ReadEnvironment(getenv);
  if (!discovery.ok()) {
    return Fail(kProgram, discovery.error(), kWrongInput);
  }
  const Result<keys::RobotsKeys> robots_keys = TakeRobotsKeys(options);
  if (!robots_keys.ok()) {
    return Fail(kProgram, robots_keys.error(), kWrongInput);
  }
  std::signal(SIGPIPE, SIG_IGN);
  const Status run = RunBridge(options, robots_keys.value(), discovery.value(), StopOnSignals());
  return run.ok() ? 0 : Fail(kProgram, run.error(), kFailed);
}

}  // namespace
}  // namespace pheromone::ros2

int main(int argc, char** argv) {
  return pheromone::RunProgram(pheromone::ros2::kProgram,
                               [&] { return pheromone::ros2::Main(argc, argv); });
}
