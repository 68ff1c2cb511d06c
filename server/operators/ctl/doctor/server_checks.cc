#include "server/operators/ctl/doctor/server_checks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "server/base/holders.h"
#include "server/config/describe.h"
#include "server/operators/ctl/json_read.h"
#include "server/operators/ctl/units.h"

namespace pheromone::ctl {
namespace {

namespace json = boost::json;

constexpr double kManyDamaged = 0.05;  // a share of the frames
constexpr uint64_t kFewFrames = 20;    // too few to speak of a share
constexpr double kManyStray = 0.1;     // of the bytes
constexpr double kCrowded = 0.85;      // of a channel

constexpr const char* kLinks = "links";
constexpr const char* kRobots = "robots";
constexpr const char* kTrackers = "trackers";
constexpr const char* kChannels = "channels";

std::string WhyNothingComes(const json::value& link) {
  const std::string kind = TextAt(link, "kind");
  if (kind == "serial") {
    return "Switch a robot on within range; baud, channel and address of both modems must agree, "
           "and `pheromonectl modem test` measures them.";
  }
  if (kind == "pty") {
    return "Start a robot there, such as pheromone-swarm live --modem " + TextAt(link, "terminal") +
           ".";
  }
  return "Start a robot that sends to " + TextAt(link, "address") +
         "; a firewall may also hold its messages back.";
}

// Programs that have a virtual modem open beside the server: two would collide.
void CheckTerminal(const Place& place, const json::value& link, const std::string& looked_at,
                   Findings* findings) {
  std::vector<int> holders = HoldersOf(TextAt(link, "terminal"));
  std::erase(holders, place.server.value_or(-1));
  if (holders.size() > 1) {
    findings->Fault(kLinks, looked_at,
                    fmt::format("opened by {} and by {}: what they send collides",
                                DescribeProcess(holders[0]), DescribeProcess(holders[1])),
                    "Stop one of them: a terminal serves one program at a time.");
  }
}

void CheckLink(const Place& place, const json::value& link, bool is_told, Findings* findings) {
  const std::string looked_at = "link " + TextAt(link, "name") + ", " + TextAt(link, "kind");
  if (IsElsewhere(link)) {
    findings->Ok(kLinks, looked_at, "elsewhere: " + TextAt(link, "state"));
    return;
  }
  if (!FlagAt(link, "up")) {
    if (!is_told) {
      findings->Fault(kLinks, looked_at, "down: " + TextAt(link, "state"),
                      "Mend what the reason says; the server opens the link by itself then.");
    }
    return;
  }
  if (TextAt(link, "kind") == "pty") {
    CheckTerminal(place, link, looked_at, findings);
  }
  const json::value& counters = At(link, "counters");
  const uint64_t frames = CountAt(counters, "received_frames");
  const uint64_t damaged = CountAt(counters, "crc_errors") + CountAt(counters, "bad_escapes") +
                           CountAt(counters, "gap_timeouts") +
                           CountAt(counters, "restarted_frames");
  const uint64_t bytes = CountAt(counters, "received_bytes");
  const uint64_t stray = CountAt(counters, "stray_bytes");
  const double share =
      static_cast<double>(damaged) / static_cast<double>(std::max<uint64_t>(frames + damaged, 1));
  if (At(link, "silent_s").is_null()) {
    findings->Warning(kLinks, looked_at, "up, but nothing was received yet", WhyNothingComes(link));
  } else if (frames == 0) {
    findings->Fault(kLinks, looked_at, fmt::format("{} bytes received, but no frame", bytes),
                    "Set both ends to the same baud, 8 bits, no parity, one stop bit; or another "
                    "program sends there.");
  } else if (frames + damaged > kFewFrames && share > kManyDamaged) {
    findings->Warning(kLinks, looked_at,
                      fmt::format("{} of {} frames were damaged", damaged, frames + damaged),
                      "Let robots take turns (medium_access = true), and look for a weak antenna, "
                      "another transmitter or a different baud.");
  } else if (frames + damaged > kFewFrames &&
             static_cast<double>(stray) > kManyStray * static_cast<double>(bytes)) {
    findings->Warning(
        kLinks, looked_at,
        fmt::format("{} of {} bytes were outside of frames: a robot with another baud "
                    "rate, or a modem that inserts bytes",
                    stray, bytes),
        "Set all robots and modems of the link to the same baud, 8 bits, no parity, "
        "one stop bit, and look at which robots are not heard.");
  } else {
    findings->Ok(kLinks, looked_at,
                 fmt::format("up, {} frames received, last heard {} ago", frames,
                             Duration(NumberAt(link, "silent_s"))));
  }
}

struct StateMend {
  std::string_view state;
  std::string_view mend;  // empty: it is well
};

// By the words of control::NameOf(RobotState).
constexpr StateMend kStateMends[] = {
    {"driving", ""},
    {"going to its goal", ""},
    {"at its goal", ""},
    {"halted", "Look whether its way is free, and resume it: pheromonectl resume --all."},
    {"standing", "Ask it why: pheromonectl command LINK ID get 133."},
    {"trail lost", "Put it beside a trail or path of the pheromone that it follows."},
    {"off the map", "Put it onto the map, or correct its pose: [[frame]] or its start."},
    {"refused",
     "Restart the robot, so that it says HELLO, and look at the pheromone and tags that "
     "it asks for: pheromonectl laws."},
    {"only HELLO",
     "Look at the robot's light or log; at the modems, of which the server's sends and the robot's "
     "receives; and at the pheromone that it asks for: pheromonectl laws."},
    {"alarm", "Go to the robot and look."},
    {"silent", "Look at its power and radio; it comes back by itself when it is heard."},
};

std::string_view MendOf(std::string_view state) {
  const auto* const found = std::find_if(std::begin(kStateMends), std::end(kStateMends),
                                         [&](const StateMend& it) { return it.state == state; });
  return found != std::end(kStateMends) ? found->mend : "";
}

// "rounds", "contention", or why neither is needed.
std::string SharingOf(const links::LinkConfig& link, const json::value& view) {
  if (!link.medium_access) {
    return link.kind == links::LinkKind::kTcp || link.kind == links::LinkKind::kUdp
               ? "no channel to share"
               : "medium_access = false: nobody takes turns";
  }
  const uint64_t rounds = CountAt(At(view, "counters"), "rounds");
  return rounds != 0 ? fmt::format("rounds, {} so far", rounds)
                     : "contention; rounds begin when robots that know them say HELLO";
}

}  // namespace

void CheckHealth(const ServerViews& views, Findings* findings) {
  const json::value& status = views.status;
  const std::string name = "pheromoned " + TextAt(status, "version");
  if (const std::string warning = TextAt(status, "warning"); !warning.empty()) {
    findings->Fault("server", name, warning,
                    "Changes are refused until then: look at the disk of the journal, and at the "
                    "server's log.");
  } else {
    findings->Ok("server", name, "up for " + Duration(NumberAt(status, "uptime_s")));
  }
  if (TextAt(status, "version") != PHEROMONE_VERSION) {
    findings->Warning("server", name, "pheromonectl is of version " PHEROMONE_VERSION,
                      "Install both from the same package, and restart the server.");
  }
  if (const std::string error = TextAt(At(status, "capture"), "error"); !error.empty()) {
    findings->Fault("server", "recording", "stopped by itself: " + error,
                    "Free space on its disk, then pheromonectl capture start.");
  }
}

void CheckReread(const ServerViews& views, const config::Config& config, Findings* findings) {
  const json::array& lines = ItemsAt(views.config, "lines");
  const std::vector<std::string> described = config::DescribeConfig(config);
  for (size_t i = 0; i < described.size(); ++i) {
    if (i >= lines.size() || TextOf(lines[i]) != described[i]) {
      findings->Warning("configuration", config.file.empty() ? "default" : config.file,
                        "not what the server has read: \"" + described[i] + "\"",
                        "pheromonectl reload.");
      return;
    }
  }
}

void CheckLinks(const Place& place, const ServerViews& views, const std::set<std::string>& told,
                Findings* findings) {
  for (const json::value& link : ItemsAt(views.links, "links")) {
    CheckLink(place, link, told.contains(TextAt(link, "name")), findings);
  }
}

void CheckRobots(const ServerViews& views, Findings* findings) {
  const json::array& clients = ItemsAt(views.clients, "clients");
  if (clients.empty()) {
    findings->Warning(kRobots, "all", "none was heard",
                      "Switch one on, or try a simulated one: pheromone-swarm live.");
  }
  std::map<std::pair<std::string, std::string>, std::vector<std::string>> by_state;
  for (const json::value& client : clients) {
    const json::value& state = At(client, "state");
    by_state[{TextAt(state, "is"), TextAt(state, "reason")}].push_back(
        fmt::format("{} on {}", CountAt(client, "id"), TextAt(client, "link")));
  }
  for (const auto& [state, robots] : by_state) {
    const std::string which =
        fmt::format("robot{} {}", robots.size() == 1 ? "" : "s", fmt::join(robots, ", "));
    const std::string is = state.first + (state.second.empty() ? "" : ": " + state.second);
    if (const std::string_view mend = MendOf(state.first); mend.empty()) {
      findings->Ok(kRobots, which, is);
    } else {
      findings->Warning(kRobots, which, is, std::string(mend));
    }
  }
  if (const uint64_t conflicts = CountAt(At(views.status, "trouble"), "id_conflicts");
      conflicts != 0) {
    findings->Fault(kRobots, "IDs", fmt::format("{} times, two robots had the same", conflicts),
                    "Give each robot on a link another ID.");
  }
}

void CheckTrackers(const ServerViews& views, Findings* findings) {
  for (const json::value& tracker : ItemsAt(views.trackers, "trackers")) {
    const std::string looked_at = "tracker " + TextAt(tracker, "name");
    const uint64_t poses = CountAt(tracker, "poses");
    if (!FlagAt(tracker, "up")) {
      findings->Fault(kTrackers, looked_at, "down: " + TextAt(tracker, "state"),
                      "Choose another port with listen in [[tracker]].");
      continue;
    }
    if (CountAt(tracker, "datagrams") == 0) {
      findings->Warning(kTrackers, looked_at,
                        "nothing was received at " + TextAt(tracker, "address"),
                        "Start the program that reports poses, and let it send there by UDP.");
      continue;
    }
    const uint64_t refused = RefusalsOf(tracker);
    std::vector<std::string> reasons;
    for (const json::value& it : ItemsAt(tracker, "refusals")) {
      reasons.push_back(fmt::format("{} ({})", TextAt(it, "reason"), CountAt(it, "count")));
    }
    if (refused == 0) {
      findings->Ok(kTrackers, looked_at, fmt::format("{} poses accepted", poses));
      continue;
    }
    const std::string found =
        fmt::format("{} poses accepted, {} lines refused: {}; the last one: {}", poses, refused,
                    fmt::join(reasons, ", "), TextAt(tracker, "last_refusal"));
    const std::string mend =
        "A line is \"pose LINK ID X_M Y_M HEADING_DEG\": with the name of a [[link]], and the ID "
        "of "
        "a robot that was switched on and has said HELLO.";
    poses == 0 ? findings->Fault(kTrackers, looked_at, found, mend)
               : findings->Warning(kTrackers, looked_at, found, mend);
  }
}

void CheckChannels(const ServerViews& views, const config::Config& config, Findings* findings) {
  for (const json::value& view : ItemsAt(views.links, "links")) {
    const std::string name = TextAt(view, "name");
    const auto link = std::find_if(config.links.begin(), config.links.end(),
                                   [&](const links::LinkConfig& it) { return it.name == name; });
    if (link == config.links.end() || IsElsewhere(view)) {
      continue;
    }
    size_t heard = 0;
    for (const json::value& client : ItemsAt(views.clients, "clients")) {
      heard +=
          TextAt(client, "link") == name && TextAt(At(client, "state"), "is") != "silent" ? 1u : 0u;
    }
    const std::string sharing = SharingOf(*link, view);
    const std::string looked_at = "link " + name;
    const json::value& utilisation = At(view, "utilisation");
    if (link->kind == links::LinkKind::kSerial && !link->medium_access && heard > 1) {
      findings->Fault(kChannels, looked_at,
                      fmt::format("{} robots, but {}: their messages collide", heard, sharing),
                      "Set medium_access = true in [[link]], and restart the server.");
    } else if (!utilisation.is_null() && NumberAt(view, "utilisation") > kCrowded) {
      findings->Warning(kChannels, looked_at,
                        fmt::format("{}; {} robots use {:.0f} % of the line", sharing, heard,
                                    100 * NumberAt(view, "utilisation")),
                        "Let robots ask less often, raise baud, or add a second channel with "
                        "another [[link]].");
    } else {
      findings->Ok(kChannels, looked_at,
                   fmt::format("{}; {} robot{} heard", sharing, heard, heard == 1 ? "" : "s"));
    }
  }
}

}  // namespace pheromone::ctl
