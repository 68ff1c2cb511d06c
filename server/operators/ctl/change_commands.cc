#include "server/operators/ctl/change_commands.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <charconv>
#include <chrono>
#include <cstdint>
#include <ctime>
#include <string_view>
#include <system_error>
#include <utility>

#include <boost/json/serialize.hpp>

#include "server/base/result.h"
#include "server/operators/control/names.h"
#include "server/operators/ctl/halt_commands.h"
#include "server/operators/ctl/json_read.h"
#include "server/operators/ctl/parameters.h"

namespace pheromone::ctl {
namespace {

namespace json = boost::json;

// The command is repeated for about this long (RobotsPart::kCommandTransmissions), with a
// margin.
constexpr std::chrono::seconds kAckPatience{20};
// An EVENT is repeated as well; a robot that contends for a busy channel may need some tries.
constexpr std::chrono::seconds kValuePatience{10};
constexpr useconds_t kBetweenLooksUs = 100'000;

constexpr std::string_view kGet = "get";

// A pheromone's number, or its name.
json::value PheromoneOf(const std::string& text) {
  const bool number = !text.empty() && text.size() <= 2 &&
                      text.find_first_not_of("0123456789") == std::string::npos;
  return number ? json::value(std::stoi(text)) : json::value(text);
}

void AddShape(const Shape& shape, json::object* body) {
  if (shape.all) {
    (*body)["all"] = true;
  }
  if (!shape.area_m.empty()) {
    (*body)["area_m"] = json::array(shape.area_m.begin(), shape.area_m.end());
  }
  if (!shape.points_m.empty()) {
    json::array points;
    for (size_t i = 0; i + 1 < shape.points_m.size(); i += 2) {
      points.push_back(json::array{shape.points_m[i], shape.points_m[i + 1]});
    }
    (*body)["points_m"] = std::move(points);
  }
  if (shape.radius_m) {
    (*body)["radius_m"] = *shape.radius_m;
  }
}

// Sends the request; prints the answer, or `words`.
int Change(const ServerOptions& options, const std::string& what, const json::object& body,
           const std::string& words) {
  const Reply reply = Call(options, "POST", "/api/v1/" + what, json::serialize(body));
  if (reply.exit_status == 0) {
    fmt::print("{}", options.json ? reply.body : words.empty() ? "" : words + '\n');
  }
  return reply.exit_status;
}

std::string Nodes(uint64_t nodes) {
  return fmt::format("{} node{}", nodes, nodes == 1 ? "" : "s");
}

// The same for a change of the map: prints the number of nodes changed, so that a misplaced decimal
// point is noticed.
int ChangeMap(const ServerOptions& options, const std::string& what, const json::object& body,
              const std::string& words) {
  const JsonReply reply = CallJson(options, "POST", "/api/v1/" + what, json::serialize(body));
  if (IsDone(options, reply)) {
    return reply.exit_status;
  }
  const uint64_t nodes = CountAt(reply.value, "nodes");
  const uint64_t changed = CountAt(reply.value, "changed");
  fmt::print("{}: {}{} changed{}{}\n", words,
             nodes != changed ? fmt::format("{} of ", changed) : "", Nodes(nodes),
             FlagAt(reply.value, "partly_off_the_map") ? "; part of the shape is off the map" : "",
             changed != 0 && At(reply.value, "edit").is_null()
                 ? "; too large to be undone, like all edits before it"
                 : "");
  return 0;
}

// The robot's entry, null if there is none.
json::value FindClient(const json::value& clients, const std::string& link, int id) {
  for (const json::value& client : ItemsAt(clients, "clients")) {
    if (TextAt(client, "link") == link && CountAt(client, "id") == static_cast<uint64_t>(id)) {
      return client;
    }
  }
  return nullptr;
}

// The seq of the robot's last EVENT, -1 if it has sent none.
int64_t LastEvent(const json::value& client) {
  const json::value& event = At(client, "last_event");
  return event.is_object() ? static_cast<int64_t>(CountAt(event, "seq")) : -1;
}

// `then`: what becomes of the order.
void TellIfSilent(const json::value& client, const std::string& then) {
  if (client.is_object() && TextAt(At(client, "state"), "is") == "silent") {
    fmt::print(stderr, "pheromonectl: {}; {}\n", SilenceOf(client), then);
  }
}

// Waits for the EVENT by which the robot answers "get"; `before` is the seq of the one before.
int AwaitValue(const ServerOptions& options, const RobotCommand& command, int64_t before) {
  const auto deadline = std::chrono::steady_clock::now() + kValuePatience;
  while (std::chrono::steady_clock::now() < deadline) {
    const JsonReply reply = CallJson(options, "GET", "/api/v1/clients");
    if (reply.exit_status != 0) {
      return reply.exit_status;
    }
    const json::value client = FindClient(reply.value, command.link, command.id);
    const json::value& event = At(client, "last_event");
    if (LastEvent(client) != before && TextAt(event, "event") == "parameter value") {
      const json::value& value = At(event, "argument");
      fmt::print("{}\n", options.json
                             ? json::serialize(json::object{
                                   {"parameter", command.arguments.front()}, {"value", value}})
                             : DescribeParameter(command.arguments.front(), value.as_int64()));
      return 0;
    }
    usleep(kBetweenLooksUs);
  }
  fmt::print(
      stderr,
      "pheromonectl: the robot has accepted \"get\", but its value has not come within {} s; "
      "try again\n",
      kValuePatience.count());
  return kFailed;
}

// Waits for the robot's acknowledgement of its last command, and for the value that it asks for.
int AwaitOutcome(const ServerOptions& options, const RobotCommand& command, int64_t last_event) {
  const auto deadline = std::chrono::steady_clock::now() + kAckPatience;
  for (;;) {
    const JsonReply reply = CallJson(options, "GET", "/api/v1/clients");
    if (reply.exit_status != 0) {
      return reply.exit_status;
    }
    const json::value client = FindClient(reply.value, command.link, command.id);
    const json::value& last = At(client, "last_command");
    const std::string outcome = TextAt(last, "outcome");
    if (outcome != "pending" || std::chrono::steady_clock::now() > deadline) {
      const std::string reason = TextAt(last, "reason");
      if (command.name == kGet && outcome == "accepted") {
        return AwaitValue(options, command, last_event);
      }
      if (options.json) {
        fmt::print("{}\n", json::serialize(last));
      } else {
        fmt::print("{}: {}{}\n", command.name, outcome.empty() ? "unknown" : outcome,
                   reason.empty() ? "" : " (" + reason + ")");
      }
      return outcome == "accepted" ? 0 : kFailed;
    }
    usleep(kBetweenLooksUs);
  }
}

// Their number, and the command itself, are for the server to check.
Status ReadArguments(RobotCommand* command) {
  const web::CommandSpec* spec = web::FindCommand(command->name);
  for (size_t i = 0; i < command->words.size(); ++i) {
    const bool known = spec != nullptr && i < spec->arguments.size();
    const int64_t least = known ? spec->arguments[i].least : INT32_MIN;
    const int64_t most = known ? spec->arguments[i].most : INT32_MAX;
    const std::string& word = command->words[i];
    int64_t value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || value < least || value > most) {
      return Error{fmt::format(
          "{}: found \"{}\"{}, expected a whole number from {} to {}", command->name, word,
          known ? fmt::format(" for {}", spec->arguments[i].name) : "", least, most)};
    }
    command->arguments.push_back(value);
  }
  return Ok();
}

}  // namespace

int Deposit(const ServerOptions& options, const std::string& pheromone, double x_m, double y_m,
            int quanta) {
  return Change(
      options, "deposit",
      {{"pheromone", PheromoneOf(pheromone)}, {"x_m", x_m}, {"y_m", y_m}, {"quanta", quanta}},
      fmt::format("{} of \"{}\" at ({}, {}) m",
                  quanta == 1 ? "a quantum" : fmt::format("{} quanta", quanta), pheromone, x_m,
                  y_m));
}

int Erase(const ServerOptions& options, const std::string& pheromone, const Shape& shape) {
  json::object body{{"pheromone", PheromoneOf(pheromone)}};
  AddShape(shape, &body);
  return ChangeMap(options, "erase", body, fmt::format("erased \"{}\"", pheromone));
}

int Paint(const ServerOptions& options, const std::string& pheromone, const Shape& shape,
          std::optional<double> units, bool add) {
  json::object body{{"pheromone", PheromoneOf(pheromone)}, {"add", add}};
  AddShape(shape, &body);
  if (units) {
    body["units"] = *units;
  }
  return ChangeMap(options, "paint", body, fmt::format("painted \"{}\"", pheromone));
}

int Reverse(const ServerOptions& options, bool redo) {
  const JsonReply reply = CallJson(options, "POST", redo ? "/api/v1/redo" : "/api/v1/undo", "{}");
  if (IsDone(options, reply)) {
    return reply.exit_status;
  }
  const auto made_at = static_cast<std::time_t>(NumberAt(reply.value, "time_s"));
  fmt::print("{}: {}, made at {:%H:%M:%S}: {} changed\n", redo ? "redid" : "undid",
             TextAt(reply.value, "what"), fmt::localtime(made_at),
             Nodes(CountAt(reply.value, "changed")));
  return 0;
}

int GiveCommand(const ServerOptions& options, RobotCommand command) {
  if (const Status read = ReadArguments(&command); !read.ok()) {
    return Fail(kUsage, read.error());
  }
  ServerOptions quiet = options;
  quiet.json = false;
  const JsonReply reply = CallJson(options, "GET", "/api/v1/clients");
  if (reply.exit_status != 0) {
    return reply.exit_status;
  }
  const json::value client = FindClient(reply.value, command.link, command.id);
  const int64_t last_event = LastEvent(client);
  TellIfSilent(client, command.wait
                           ? fmt::format("waiting for it, up to {} s", kAckPatience.count())
                           : "it may not receive this");
  const int status =
      Change(command.wait ? quiet : options, "command",
             {{"link", command.link},
              {"id", command.id},
              {"command", command.name},
              {"arguments", json::array(command.arguments.begin(), command.arguments.end())}},
             command.wait ? "" : command.name + ": sent");
  return status == 0 && command.wait ? AwaitOutcome(options, command, last_event) : status;
}

int GoTo(const ServerOptions& options, const RobotGoal& goal) {
  json::object body{{"link", goal.link}, {"id", goal.id}};
  const std::string robot = fmt::format("robot {} on link {}", goal.id, goal.link);
  if (goal.cancel) {
    body["cancel"] = true;
    return Change(options, "goto", body, robot + ": goal cancelled");
  }
  body["x_m"] = *goal.x_m;
  body["y_m"] = *goal.y_m;
  if (goal.tolerance_m) {
    body["tolerance_m"] = *goal.tolerance_m;
  }
  const int status = Change(options, "goto", body,
                            fmt::format("{}: goal ({}, {}) m", robot, *goal.x_m, *goal.y_m));
  if (status == 0) {
    const JsonReply clients = CallJson(options, "GET", "/api/v1/clients");
    TellIfSilent(FindClient(clients.value, goal.link, goal.id),
                 "it goes there once it is heard again");
  }
  return status;
}

int ReloadConfig(const ServerOptions& options) {
  const JsonReply reply = CallJson(options, "POST", "/api/v1/reload", "{}");
  if (IsDone(options, reply)) {
    return reply.exit_status;
  }
  fmt::print("configuration reread\n");
  for (const json::value& note : ItemsAt(reply.value, "notes")) {
    fmt::print("  {}\n", TextOf(note));
  }
  return 0;
}

int MakeTicket(const ServerOptions& options) {
  const JsonReply reply = CallJson(options, "POST", "/api/v1/ticket", "{}");
  if (reply.exit_status == 0) {
    fmt::print("{}", options.json
                         ? reply.text
                         : fmt::format("?ticket={}\nvalid for {:.0f} h, behind the address "
                                       "that a viewer opens: ws://HOST:PORT/?ticket=...\n",
                                       TextAt(reply.value, "ticket"),
                                       NumberAt(reply.value, "valid_s") / 3600));
  }
  return reply.exit_status;
}

int MakeSnapshot(const ServerOptions& options) {
  const JsonReply reply = CallJson(options, "POST", "/api/v1/snapshot", "{}");
  if (reply.exit_status == 0) {
    fmt::print("{}", options.json ? reply.text : TextAt(reply.value, "snapshot") + '\n');
  }
  return reply.exit_status;
}

}  // namespace pheromone::ctl
