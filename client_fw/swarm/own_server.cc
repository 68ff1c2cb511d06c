#include "client_fw/swarm/own_server.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include <boost/json/value.hpp>

#include "client_fw/swarm/fit.h"
#include "server/core/engine/wire_units.h"
#include "server/operators/ctl/json_read.h"
#include "server/operators/ctl/server_call.h"

namespace pheromone::swarm {
namespace {

namespace json = boost::json;

constexpr int64_t kNsPerMilli = 1'000'000;

// Where a robot is that has gone `along_um` of the path, looking along it.
sim::PlanePose PoseAlong(const field::Path& path, double along_um) {
  std::vector<field::PointUm> points = path.points;
  if (path.closed) {
    points.push_back(points.front());
  }
  for (size_t i = 0; i + 1 < points.size(); ++i) {
    const double dx = static_cast<double>(points[i + 1].x - points[i].x);
    const double dy = static_cast<double>(points[i + 1].y - points[i].y);
    const double side_um = std::hypot(dx, dy);
    if (along_um <= side_um && side_um > 0) {
      const double share = along_um / side_um;
      return {(static_cast<double>(points[i].x) + share * dx) / 1e6,
              (static_cast<double>(points[i].y) + share * dy) / 1e6, std::atan2(dy, dx)};
    }
    along_um -= side_um;
  }
  return {static_cast<double>(points.back().x) / 1e6, static_cast<double>(points.back().y) / 1e6,
          0};
}

// Evenly along all of these paths, one after the other.
std::vector<sim::PlanePose> StartsAlong(const std::vector<field::Path>& paths, int robots) {
  double whole_um = 0;
  for (const field::Path& path : paths) {
    whole_um += field::LengthOf(path);
  }
  std::vector<sim::PlanePose> starts;
  for (int i = 0; i < robots; ++i) {
    double along_um = whole_um * (i + 0.5) / robots;
    auto path = paths.begin();
    while (path + 1 != paths.end() && along_um > field::LengthOf(*path)) {
      along_um -= field::LengthOf(*path++);
    }
    starts.push_back(PoseAlong(*path, along_um));
  }
  return starts;
}

// Its type. Errors list what there is.
Result<uint8_t> FollowedType(const field::FieldConfig& field, const std::string& wanted) {
  if (wanted.empty() && !field.paths.empty()) {
    return field.paths.front().type;
  }
  std::string known;
  for (const field::PheromoneLaw& law : field.pheromones) {
    if (law.name == wanted || std::to_string(law.type) == wanted) {
      return law.type;
    }
    known += fmt::format("{}{} (\"{}\")", known.empty() ? "" : ", ", law.type, law.name);
  }
  return Error{fmt::format("--pheromone: found \"{}\", expected one of {}", wanted, known)};
}

const links::LinkConfig* FindLinkConfig(const config::Config& server, const std::string& name) {
  const auto found = std::find_if(server.links.begin(), server.links.end(),
                                  [&](const links::LinkConfig& it) { return it.name == name; });
  return found != server.links.end() ? &*found : nullptr;
}

ChannelTiming TimingOf(const links::LinkConfig& link) {
  ChannelTiming timing;
  timing.baud = link.baud;
  if (link.medium_access) {
    timing.turnaround_ns = link.turnaround_ms * kNsPerMilli;
    timing.server_delay_ns = link.server_delay_ms * kNsPerMilli;
    timing.adapter_ns = link.adapter_latency_ms * kNsPerMilli;
  }
  return timing;
}

Status ChooseLinks(const config::Config& server, const std::vector<ServerTerminal>& terminals,
                   OwnSwarm* swarm) {
  for (const bool medium_access : {true, false}) {
    const LinkKind access = medium_access ? LinkKind::kMediumAccess : LinkKind::kBuffered;
    for (const ServerTerminal& terminal : terminals) {
      const links::LinkConfig* link = FindLinkConfig(server, terminal.link);
      if (link == nullptr || link->medium_access != medium_access) {
        continue;
      }
      const ChannelLoad load{.access = access,
                             .timing = TimingOf(*link),
                             .window_ms = static_cast<uint8_t>(link->response_window_ms),
                             .slot_ms = link->slot_ms};
      if (swarm->ports.empty()) {
        swarm->load = load;
      }
      if (load == swarm->load) {
        swarm->ports.push_back(terminal.path);
        swarm->links.push_back(terminal.link);
      }
    }
    if (!swarm->ports.empty()) {
      swarm->scenario.timing = swarm->load.timing;
      swarm->scenario.channels = static_cast<int>(swarm->ports.size());
      return Ok();
    }
  }
  std::string names;
  for (const links::LinkConfig& link : server.links) {
    names += (names.empty() ? "" : ", ") + link.name;
  }
  return Error{fmt::format(
      "found the links {}, expected one that is a virtual modem (kind = \"pty\") and up: add "
      "[[link]] with name = \"robots\", kind = \"pty\", path = \"robots.pty\" to the server's "
      "configuration, and restart it",
      names.empty() ? "(none)" : names)};
}

// As wished, or 0.2 s if the channels hold the robots, or the least at which they do. The fail-safe
// time follows.
Status SetPeriod(const SwarmWish& wish, RobotGroup* group, OwnSwarm* swarm) {
  const int channels = swarm->scenario.channels;
  ChannelLoad& load = swarm->load;
  load.robots = (wish.robots + channels - 1) / channels;
  load.is_signed = wish.is_signed;
  load.period_ms = wish.period_s ? std::llround(*wish.period_s * 1000) : group->client.period_ms;
  load.fail_safe_ms = std::max<int64_t>(group->client.fail_safe_ms, 2 * load.period_ms);
  if (!wish.period_s && !Fits(load)) {
    swarm->why_slower = WhyItDoesNotFit(load);
    load.period_ms = FittingPeriodMs(load);
    if (load.period_ms > kMaxPeriodMs) {
      return Error{"--robots: " + swarm->why_slower};
    }
    load.fail_safe_ms = 2 * load.period_ms;
  }
  group->client.period_ms = static_cast<uint16_t>(load.period_ms);
  group->client.fail_safe_ms = static_cast<uint16_t>(load.fail_safe_ms);
  return Ok();
}

}  // namespace

Result<OwnSwarm> MakeSwarm(const config::Config& server,
                           const std::vector<ServerTerminal>& terminals, const SwarmWish& wish) {
  OwnSwarm swarm;
  Scenario& scenario = swarm.scenario;
  scenario.name = "own server";
  scenario.engine = server.engine;
  scenario.duration_ms = std::llround(wish.seconds * 1000);
  PHEROMONE_TRY_STATUS(ChooseLinks(server, terminals, &swarm));
  PHEROMONE_TRY(const uint8_t type, FollowedType(server.engine.field, wish.pheromone));
  std::vector<field::Path> paths;
  for (const field::Path& path : server.engine.field.paths) {
    if (path.type == type && path.points.size() > 1) {
      paths.push_back(path);
    }
  }
  const field::PheromoneLaw* law = server.engine.field.FindLaw(type);
  if (paths.empty() || law == nullptr) {
    return Error{fmt::format(
        "the server has no [[path]] of pheromone \"{}\" for the robots to start on: add one to its "
        "configuration, or write a scenario",
        law != nullptr ? law->name : std::to_string(type))};
  }
  RobotGroup group;
  group.count = wish.robots;
  group.starts = StartsAlong(paths, wish.robots);
  group.client.type = type;
  group.client.baud = static_cast<uint32_t>(scenario.timing.baud);
  group.client.wide = engine::NeedsWide(server.engine.field.map, server.engine.pose_unit_10um);
  PHEROMONE_TRY_STATUS(SetPeriod(wish, &group, &swarm));
  const SpeedFit fit{.speed_mm_s = group.client.speed_mm_s,
                     .period_ms = group.client.period_ms,
                     .reach_m = static_cast<double>(law->reach_um()) / 1e6,
                     .drive = LimitsOf(sim::DriveConfig())};
  group.client.speed_mm_s = std::min(group.client.speed_mm_s, FittingSpeed(fit));
  scenario.groups.push_back(group);
  return swarm;
}

Result<OwnSwarm> SwarmForServer(const SwarmWish& wish) {
  const ctl::ServerOptions options{.socket = wish.socket};
  PHEROMONE_TRY(const json::value view, ctl::AskJson(options, "GET", "/api/v1/config"));
  const Result<config::Config> server = config::LoadConfigOrDefault(ctl::TextAt(view, "file"));
  if (!server.ok()) {
    return Error{server.error()};
  }
  PHEROMONE_TRY(const json::value links, ctl::AskJson(options, "GET", "/api/v1/links"));
  std::vector<ServerTerminal> terminals;
  for (const json::value& link : ctl::ItemsAt(links, "links")) {
    if (ctl::TextAt(link, "kind") == "pty" && ctl::FlagAt(link, "up")) {
      terminals.push_back({ctl::TextAt(link, "name"), ctl::TextAt(link, "terminal")});
    }
  }
  return MakeSwarm(server.value(), terminals, wish);
}

ChannelLoad LoadOf(const Scenario& scenario, LinkKind access) {
  ChannelLoad load{.access = access, .timing = scenario.timing};
  load.robots = (scenario.robot_count() + scenario.channels - 1) / scenario.channels;
  double requests_per_s = 0;
  load.fail_safe_ms = UINT16_MAX;
  for (const RobotGroup& group : scenario.groups) {
    requests_per_s += group.count * 1000.0 / group.client.period_ms;
    load.fail_safe_ms = std::min<int64_t>(load.fail_safe_ms, group.client.fail_safe_ms);
  }
  load.period_ms = std::llround(scenario.robot_count() * 1000.0 / requests_per_s);
  return load;
}

}  // namespace pheromone::swarm
