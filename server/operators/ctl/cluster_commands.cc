#include "server/operators/ctl/cluster_commands.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <string_view>
#include <vector>

#include <boost/json/serialize.hpp>

#include "server/operators/ctl/json_read.h"
#include "server/operators/ctl/table.h"
#include "server/operators/ctl/units.h"

namespace pheromone::ctl {
namespace {

namespace json = boost::json;

constexpr useconds_t kBetweenLeadersUs = 50'000;
constexpr std::chrono::seconds kLeadPatience{5};

int NoCluster() {
  fmt::print(stderr,
             "pheromonectl: this server is not one of a cluster: its configuration has no "
             "[cluster]\n");
  return kFailed;
}

}  // namespace

std::string DescribeCluster(const json::value& cluster) {
  const std::string leader = TextAt(cluster, "leader");
  std::string text = fmt::format(
      "cluster   {}, node {}: {}\n"
      "leader    {}, term {}; {} changes of the leader seen\n"
      "log       event {} is committed, {} to be applied here; heard {} ago\n",
      TextAt(cluster, "name"), TextAt(cluster, "node"), TextAt(cluster, "role"),
      leader.empty() ? "none" : leader, CountAt(cluster, "term"), CountAt(cluster, "elections"),
      CountAt(cluster, "committed_sequence"), CountAt(cluster, "behind"),
      Duration(NumberAt(cluster, "heard_s")));
  if (const std::string transfer = TextAt(cluster, "transfer"); !transfer.empty()) {
    text += fmt::format("state     {}\n", transfer);
  }
  for (const char* const key : {"trouble", "gap"}) {
    if (const std::string warning = TextAt(cluster, key); !warning.empty()) {
      text += fmt::format("WARNING   {}\n", warning);
    }
  }
  return text;
}

int ShowCluster(const ServerOptions& options) {
  const JsonReply reply = CallJson(options, "GET", "/api/v1/status");
  if (reply.exit_status != 0) {
    return reply.exit_status;
  }
  const json::value& cluster = At(reply.value, "cluster");
  if (cluster.is_null()) {
    return NoCluster();
  }
  const int exit_status = At(reply.value, "warning").is_null() ? 0 : kFailed;
  if (options.json) {
    fmt::print("{}\n", json::serialize(cluster));
    return exit_status;
  }
  fmt::print("{}", DescribeCluster(cluster));
  std::vector<std::vector<std::string>> rows = {{"NODE", "STATE", "HOW"}};
  for (const json::value& peer : ItemsAt(cluster, "peers")) {
    rows.push_back({TextAt(peer, "node"), FlagAt(peer, "up") ? "connected" : "not connected",
                    TextAt(peer, "state")});
  }
  fmt::print("\n");
  PrintTable(rows);
  return exit_status;
}

int StepDown(const ServerOptions& options, const std::string& successor) {
  const JsonReply before = CallJson(options, "GET", "/api/v1/status");
  if (before.exit_status != 0) {
    return before.exit_status;
  }
  if (At(before.value, "cluster").is_null()) {
    return NoCluster();
  }
  const std::string node = TextAt(At(before.value, "cluster"), "node");
  json::object body;
  if (!successor.empty()) {
    body["successor"] = successor;
  }
  const JsonReply reply = CallJson(options, "POST", "/api/v1/step-down", json::serialize(body));
  if (reply.exit_status != 0) {
    return reply.exit_status;
  }
  const auto end = std::chrono::steady_clock::now() + kLeadPatience;
  while (std::chrono::steady_clock::now() < end) {
    const JsonReply now = CallJson(options, "GET", "/api/v1/status");
    if (now.exit_status != 0) {
      return now.exit_status;
    }
    const std::string leader = TextAt(At(now.value, "cluster"), "leader");
    if (!leader.empty() && leader != node) {
      fmt::print("{}", options.json ? reply.text : leader + " leads\n");
      return successor.empty() || leader == successor
                 ? 0
                 : Fail(kFailed, "node " + successor + " has not taken over, " + leader + " has");
    }
    usleep(kBetweenLeadersUs);
  }
  fmt::print(stderr,
             "pheromonectl: no other server has taken over in {} s, so this one leads on: cluster "
             "status tells which are connected\n",
             kLeadPatience.count());
  return kFailed;
}

}  // namespace pheromone::ctl
