#include "client_fw/ros2/options.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <set>
#include <system_error>
#include <utility>

#include "client_fw/attach/servers.h"

namespace pheromone::ros2 {
namespace {

template <class Number>
std::optional<Number> ReadNumber(std::string_view text) {
  Number number{};
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  return error == std::errc{} && rest == end ? std::optional(number) : std::nullopt;
}

// The part before the first `mark`, which is cut off with it.
std::string_view Cut(std::string_view* text, char mark) {
  const size_t at = text->find(mark);
  const std::string_view part = text->substr(0, at);
  *text = at == std::string_view::npos ? std::string_view{} : text->substr(at + 1);
  return part;
}

std::optional<PlanePose> ReadPose(std::string_view text) {
  const auto x = ReadNumber<double>(Cut(&text, ','));
  const auto y = ReadNumber<double>(Cut(&text, ','));
  const auto degrees = ReadNumber<double>(text);
  if (!x || !y || !degrees) {
    return std::nullopt;
  }
  const PlanePose pose{*x, *y, *degrees * std::numbers::pi / 180};
  return IsReportable(pose) ? std::optional(pose) : std::nullopt;
}

}  // namespace

Result<RobotEntry> ParseRobot(const std::string& text) {
  std::string_view rest = text;
  RobotEntry robot;
  robot.name_space = Cut(&rest, ':');
  if (!IsRosName(robot.name_space)) {
    return Error{fmt::format(
        "namespace \"{}\", expected letters, digits and single '_', such as tb1 or lab/tb1",
        robot.name_space)};
  }
  const std::string_view number = Cut(&rest, ':');
  const auto id = ReadNumber<int>(number);
  if (!id || *id < 1 || *id > 254) {
    return Error{fmt::format("{}: robot ID \"{}\", expected 1 to 254", robot.name_space, number)};
  }
  robot.id = static_cast<uint8_t>(*id);
  if (!rest.empty()) {
    robot.start = ReadPose(rest);
    if (!robot.start) {
      return Error{
          fmt::format("{}: start \"{}\", expected X,Y,DEGREES in m", robot.name_space, rest)};
    }
  }
  return robot;
}

Status CheckOptions(const BridgeOptions& options, const std::vector<std::string>& for_robots) {
  std::set<std::string> names;
  std::set<uint8_t> ids;
  for (const RobotEntry& robot : options.robots) {
    if (!names.insert(robot.name_space).second || !ids.insert(robot.id).second) {
      return Error{fmt::format("--robot: {}:{}, expected a namespace and an ID that no other has",
                               robot.name_space, robot.id)};
    }
    if (robot.start.has_value() != (options.localisation == Localisation::kStart)) {
      return Error{"--robot: " + robot.name_space +
                   (robot.start
                        ? " has a start pose, expected NAMESPACE:ID with this --pose"
                        : " has no start pose, expected NAMESPACE:ID:X,Y,DEGREES or --pose")};
    }
  }
  const Allowed& allowed = options.allowed;
  if (options.robots.empty()) {
    if (options.socket.empty()) {
      return Error{"there is nothing to do: expected --robot, --socket or both"};
    }
    if (!options.servers.empty() || allowed.enable || allowed.goal) {
      return Error{"--server and --allow enable, goal are for robots, expected --robot"};
    }
    if (!for_robots.empty()) {
      return Error{for_robots.front() + " is for robots, expected --robot"};
    }
  } else {
    const Status list = attach::CheckServers(options.servers);
    if (!list.ok()) {
      return Error{"--server: " + list.error()};
    }
    if (options.servers.front().kind == attach::Address::Kind::kSerial) {
      return Error{"--server: " + options.servers.front().text +
                   ": expected HOST:PORT or udp:HOST:PORT"};
    }
  }
  if (options.socket.empty() && (allowed.goal || allowed.deposit || allowed.paint)) {
    return Error{"--allow goal, deposit, paint: orders to the server, expected --socket"};
  }
  if (options.socket.empty() && options.localisation == Localisation::kStart &&
      options.map_frame != BridgeOptions().map_frame) {
    return Error{"--map-frame: nothing is in this frame, expected --socket, --pose tf or amcl"};
  }
  if (options.socket.empty() && !options.link.empty()) {
    return Error{"--link: there is no server to ask about it, expected --socket"};
  }
  const bool publishes_frames = options.localisation == Localisation::kStart;
  if (!options.link.empty() && (options.robots.empty() || !(allowed.goal || publishes_frames))) {
    return Error{"--link: for --allow goal, and for frames of robots with a start pose"};
  }
  if (allowed.goal && options.link.empty()) {
    return Error{"--allow goal: the server has to know which robot, expected --link"};
  }
  const client::Parameters& client = options.client;
  if (client.fail_safe_ms <= client.period_ms) {
    return Error{fmt::format("--fail-safe: {} ms, expected more than the period, {} ms",
                             client.fail_safe_ms, client.period_ms)};
  }
  if (client.speed_mm_s * client.fail_safe_ms / 1000 > client::kMaxBlindMm) {
    return Error{fmt::format(
        "--fail-safe: at {} mm/s a robot drives {} mm without an answer, "
        "expected at most {} mm",
        client.speed_mm_s, client.speed_mm_s * client.fail_safe_ms / 1000, client::kMaxBlindMm)};
  }
  return Ok();
}

Result<keys::RobotsKeys> TakeRobotsKeys(const BridgeOptions& options) {
  if (options.keys.empty()) {
    return keys::RobotsKeys{};
  }
  std::set<uint8_t> ids;
  for (const RobotEntry& robot : options.robots) {
    ids.insert(robot.id);
  }
  Result<keys::RobotsKeys> taken = keys::TakeKeys(options.keys, ids);
  return taken.ok() ? std::move(taken) : Error{"--keys: " + taken.error()};
}

}  // namespace pheromone::ros2
