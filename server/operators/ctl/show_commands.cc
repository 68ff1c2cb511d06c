#include "server/operators/ctl/show_commands.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string_view>
#include <vector>

#include <boost/json/parse.hpp>

#include "server/base/percent.h"
#include "server/operators/ctl/capture_commands.h"
#include "server/operators/ctl/halt_commands.h"
#include "server/operators/ctl/json_read.h"
#include "server/operators/ctl/server_socket.h"
#include "server/operators/ctl/table.h"
#include "server/operators/ctl/units.h"

namespace pheromone::ctl {
namespace {

namespace json = boost::json;

// "3.2 s ago"; "-" for what never was.
std::string Ago(const json::value& object, std::string_view key) {
  return At(object, key).is_null() ? "-" : Duration(NumberAt(object, key)) + " ago";
}

// "3 crc_errors, 1 late_answers".
std::string Losses(const json::value& losses) {
  std::string text;
  const json::object* object = losses.if_object();
  for (const json::key_value_pair& it : object != nullptr ? *object : json::object()) {
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", CountAt(losses, it.key()),
                        std::string_view(it.key()));
  }
  return text.empty() ? "none" : text;
}

std::string PoseOf(const json::value& client) {
  const json::value& pose = At(client, "pose");
  return pose.is_null() ? "-"
                        : fmt::format("{:.2f} {:.2f} m {:.0f} deg ({})", NumberAt(pose, "x_m"),
                                      NumberAt(pose, "y_m"), NumberAt(pose, "heading_deg"),
                                      TextAt(pose, "source"));
}

std::string GoalOf(const json::value& client) {
  const json::value& goal = At(client, "goal");
  return goal.is_null()
             ? "-"
             : fmt::format("{:.2f} {:.2f} m", NumberAt(goal, "x_m"), NumberAt(goal, "y_m"));
}

std::string CommandOf(const json::value& client) {
  const json::value& command = At(client, "last_command");
  if (command.is_null()) {
    return "-";
  }
  const std::string reason = TextAt(command, "reason");
  return TextAt(command, "command") + " " + TextAt(command, "outcome") +
         (reason.empty() ? "" : " (" + reason + ")");
}

// "no such file; 3 failed attempts, next in 2.1 s".
std::string StateOf(const json::value& link) {
  std::string text = TextAt(link, "state");
  if (const uint64_t failed = CountAt(link, "failed_attempts"); failed != 0) {
    text += fmt::format("; {} failed attempt{}", failed, failed == 1 ? "" : "s");
  }
  if (!At(link, "next_attempt_s").is_null()) {
    text += fmt::format(", next in {}", Duration(NumberAt(link, "next_attempt_s")));
  }
  return text;
}

// Prints nothing if there is no tracker.
void ShowTrackers(const ServerOptions& options) {
  const Result<json::value> trackers = AskJson(options, "GET", "/api/v1/trackers");
  if (!trackers.ok()) {
    return;
  }
  std::vector<std::vector<std::string>> rows = {
      {"TRACKER", "STATE", "DATAGRAMS", "POSES", "REFUSED", "HOW", "LAST REFUSAL"}};
  for (const json::value& it : ItemsAt(trackers.value(), "trackers")) {
    const std::string refusal = TextAt(it, "last_refusal");
    rows.push_back({TextAt(it, "name"), FlagAt(it, "up") ? "up" : "down",
                    std::to_string(CountAt(it, "datagrams")), std::to_string(CountAt(it, "poses")),
                    std::to_string(RefusalsOf(it)), TextAt(it, "state"),
                    refusal.empty() ? "-" : refusal});
  }
  if (rows.size() > 1) {
    fmt::print("\n");
    PrintTable(rows);
  }
}

// Robots that are not heard though a link's file has their key.
void ShowRevoked(const json::value& links) {
  for (const json::value& link : ItemsAt(links, "links")) {
    std::vector<std::string> robots;
    for (const json::value& robot : ItemsAt(link, "revoked")) {
      robots.push_back(robot.is_number() ? std::to_string(robot.to_number<int>()) : "?");
    }
    if (!robots.empty()) {
      fmt::print("revoked on {}: robot {}\n", TextAt(link, "name"), fmt::join(robots, ", "));
    }
  }
}

}  // namespace

int ShowStatus(const ServerOptions& options, bool with_hash) {
  const JsonReply reply =
      CallJson(options, "GET", with_hash ? "/api/v1/status?hash=1" : "/api/v1/status");
  if (IsDone(options, reply)) {
    return reply.exit_status;
  }
  const json::value& status = reply.value;
  const json::value& field = At(status, "field");
  const json::value& counters = At(status, "counters");
  const json::value& process = At(status, "process");
  fmt::print("pheromoned {}, up {}\n", TextAt(status, "version"),
             Duration(NumberAt(status, "uptime_s")));
  if (const Result<ServerSocket> socket = ChooseSocket(options.socket); socket.ok()) {
    fmt::print("socket    {}\n", socket.value().path);
  }
  if (const std::string warning = TextAt(status, "warning"); !warning.empty()) {
    fmt::print("WARNING   {}\n", warning);
  }
  fmt::print("links     {} of {} up\n", CountAt(status, "links_up"), CountAt(status, "links"));
  const JsonReply clients = CallJson(options, "GET", "/api/v1/clients");
  fmt::print("robots    {}\n",
             clients.exit_status == 0 ? CountStates(ItemsAt(clients.value, "clients")) : "unknown");
  fmt::print("field     {} nodes in {} tiles, {} of {}\n", CountAt(field, "nodes"),
             CountAt(field, "tiles"), Size(NumberAt(field, "used_bytes")),
             Size(NumberAt(field, "limit_bytes")));
  fmt::print("requests  {}, answered {}, of these repeats {}; ignored {}\n",
             CountAt(counters, "requests"), CountAt(counters, "answers"),
             CountAt(counters, "repeats"), CountAt(counters, "ignored"));
  if (const uint64_t refused = CountAt(counters, "observations_refused"); refused != 0) {
    fmt::print("WARNING   {} poses of trackers were refused: pheromonectl links tells why\n",
               refused);
  }
  const std::string kept =
      At(status, "durable_sequence").is_null()
          ? "not kept: no journal"
          : fmt::format("durable up to {}", CountAt(status, "durable_sequence"));
  fmt::print("log       event {}, {}; epoch {}, field time {:.3f} s\n", CountAt(status, "sequence"),
             kept, CountAt(status, "epoch"), NumberAt(status, "field_time_s"));
  if (const json::value& cluster = At(status, "cluster"); !cluster.is_null()) {
    const std::string leader = TextAt(cluster, "leader");
    fmt::print("cluster   {}, node {} {}{}\n", TextAt(cluster, "name"), TextAt(cluster, "node"),
               TextAt(cluster, "role"),
               leader == TextAt(cluster, "node") ? ""
               : leader.empty()                  ? "; nobody leads"
                                                 : "; " + leader + " leads");
  }
  if (with_hash) {
    fmt::print("state     hash {}\n", TextAt(status, "state_hash"));
  }
  fmt::print("capture   {}\n", DescribeCapture(At(status, "capture")));
  fmt::print("process   {}, {} descriptors, {} of processor time\n",
             Size(NumberAt(process, "resident_bytes")), CountAt(process, "open_descriptors"),
             Duration(NumberAt(process, "cpu_s")));
  const json::value& errors = At(counters, "errors");
  for (const json::value* trouble : {&errors, &At(status, "trouble")}) {
    for (const json::key_value_pair& it :
         trouble->is_object() ? trouble->get_object() : json::object()) {
      const std::string_view name = it.key();
      if (const uint64_t count = CountAt(*trouble, name); count != 0) {
        fmt::print("{}{}  {}\n", trouble == &errors ? "error " : "", name, count);
      }
    }
  }
  return 0;
}

int ShowLinks(const ServerOptions& options) {
  const JsonReply reply = CallJson(options, "GET", "/api/v1/links");
  if (IsDone(options, reply)) {
    return reply.exit_status;
  }
  std::vector<std::vector<std::string>> rows = {{"LINK", "KIND", "STATE", "SINCE", "LAST HEARD",
                                                 "FRAMES IN", "OUT", "IN USE", "LOSSES", "HOW"}};
  for (const json::value& link : ItemsAt(reply.value, "links")) {
    const json::value& counters = At(link, "counters");
    const json::value& utilisation = At(link, "utilisation");
    rows.push_back(
        {TextAt(link, "name"), TextAt(link, "kind"),
         IsElsewhere(link)                   ? "elsewhere"
         : !FlagAt(link, "up")               ? "down"
         : TextAt(link, "role") == "standby" ? "standby"
         : FlagAt(link, "silent")            ? "silent"
                                             : "up",
         Duration(NumberAt(link, "since_s")), Ago(link, "silent_s"),
         std::to_string(CountAt(counters, "received_frames")),
         std::to_string(CountAt(counters, "sent_frames")),
         utilisation.is_null() ? "-" : fmt::format("{:.0f} %", 100 * NumberAt(link, "utilisation")),
         Losses(At(link, "losses")), StateOf(link)});
  }
  PrintTable(rows);
  ShowRevoked(reply.value);
  ShowTrackers(options);
  return 0;
}

int ShowClients(const ServerOptions& options, const std::string& link) {
  const JsonReply reply = CallJson(options, "GET", "/api/v1/clients");
  if (IsDone(options, reply)) {
    return reply.exit_status;
  }
  if (!link.empty()) {
    const JsonReply links = CallJson(options, "GET", "/api/v1/links");
    std::vector<std::string> names;
    for (const json::value& it : ItemsAt(links.value, "links")) {
      names.push_back(TextAt(it, "name"));
    }
    if (std::find(names.begin(), names.end(), link) == names.end()) {
      return Fail(kFailed, fmt::format("unknown link \"{}\", expected one of {}", link,
                                       fmt::join(names, ", ")));
    }
  }
  std::vector<std::vector<std::string>> rows = {{"LINK", "ID", "STATE", "SINCE", "LAST SEEN",
                                                 "REQUESTS", "REPEATS", "REFUSALS", "POSE", "GOAL",
                                                 "LAST EVENT", "LAST COMMAND"}};
  for (const json::value& client : ItemsAt(reply.value, "clients")) {
    if (!link.empty() && TextAt(client, "link") != link) {
      continue;
    }
    const json::value& event = At(client, "last_event");
    const json::value& state = At(client, "state");
    rows.push_back({TextAt(client, "link"), std::to_string(CountAt(client, "id")),
                    DescribeState(client), Ago(state, "since_s"), Ago(client, "silent_s"),
                    std::to_string(CountAt(client, "requests")),
                    std::to_string(CountAt(client, "repeats")),
                    std::to_string(CountAt(client, "refusals")), PoseOf(client), GoalOf(client),
                    event.is_null() ? "-" : TextAt(event, "event"), CommandOf(client)});
  }
  PrintTable(rows);
  return 0;
}

int ShowLaws(const ServerOptions& options) {
  const JsonReply reply = CallJson(options, "GET", "/api/v1/laws");
  if (IsDone(options, reply)) {
    return reply.exit_status;
  }
  std::vector<std::vector<std::string>> rows = {
      {"TYPE", "NAME", "QUANTUM", "MAXIMUM", "REACH", "EVAPORATION"}};
  for (const json::value& law : ItemsAt(reply.value, "pheromones")) {
    const std::string type = std::to_string(CountAt(law, "type"));
    if (!At(law, "blend").is_null()) {
      rows.push_back({type, TextAt(law, "name"), "-", "-", "-", "a blend"});
      continue;
    }
    const double tau_s = NumberAt(law, "tau_s");
    rows.push_back({type, TextAt(law, "name"), fmt::format("{}", NumberAt(law, "quantum")),
                    fmt::format("{}", NumberAt(law, "maximum")),
                    fmt::format("{} m", NumberAt(law, "reach_m")),
                    TextAt(law, "evaporation") + (tau_s > 0 ? fmt::format(", {} s", tau_s) : "")});
  }
  PrintTable(rows);
  return 0;
}

int ShowConfig(const ServerOptions& options) {
  const JsonReply reply = CallJson(options, "GET", "/api/v1/config");
  if (IsDone(options, reply)) {
    return reply.exit_status;
  }
  for (const json::value& line : ItemsAt(reply.value, "lines")) {
    fmt::print("{}\n", TextOf(line));
  }
  return 0;
}

int ShowVersion(const ServerOptions& options) {
  if (options.json) {
    const JsonReply reply = CallJson(options, "GET", "/api/v1/status");
    if (reply.exit_status == 0) {
      fmt::print("{{\"pheromonectl\":\"{}\",\"pheromoned\":\"{}\"}}\n", PHEROMONE_VERSION,
                 TextAt(reply.value, "version"));
    }
    return reply.exit_status;
  }
  fmt::print("pheromonectl {}\n", PHEROMONE_VERSION);
  const JsonReply reply = CallJson(options, "GET", "/api/v1/status");
  if (reply.exit_status == 0) {
    fmt::print("pheromoned {}\n", TextAt(reply.value, "version"));
  }
  return reply.exit_status;
}

int Sense(const ServerOptions& options, const std::string& pheromone, double x_m, double y_m,
          double heading_deg) {
  const JsonReply reply =
      CallJson(options, "GET",
               fmt::format("/api/v1/sense?pheromone={}&x_m={}&y_m={}&heading_deg={}",
                           PercentEncode(pheromone), x_m, y_m, heading_deg));
  if (IsDone(options, reply)) {
    return reply.exit_status;
  }
  for (const char* side : {"left", "right"}) {
    const json::value& antenna = At(reply.value, side);
    fmt::print("{:<6} {:.4f} at ({:.3f}, {:.3f}) m\n", side, NumberAt(antenna, "intensity"),
               NumberAt(antenna, "x_m"), NumberAt(antenna, "y_m"));
  }
  return 0;
}

}  // namespace pheromone::ctl
