#include "server/operators/ctl/cluster/cluster_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/json/parse.hpp>

#include "server/cluster/etcd_client.h"
#include "server/cluster/etcd_messages.h"
#include "server/config/config.h"
#include "server/operators/ctl/doctor/findings.h"
#include "server/operators/ctl/doctor/host_checks.h"
#include "server/operators/ctl/json_read.h"
#include "server/operators/ctl/server_socket.h"
#include "server/operators/ctl/units.h"

namespace pheromone::ctl {
namespace {

namespace asio = boost::asio;
namespace json = boost::json;

constexpr std::chrono::seconds kMemberPatience{3};
constexpr double kLargeDatabase = 1 << 30;  // half of what etcd holds at most, by default
constexpr uint64_t kFarBehind = 10'000;     // events: seconds of a busy swarm

constexpr const char* kServerOfCluster = "server";
constexpr const char* kPeersOfCluster = "peers";
constexpr const char* kEtcdMembers = "etcd";
constexpr const char* kClusterId = "cluster_id";

// What a member of etcd says. Either may be missing.
struct Member {
  Endpoint endpoint;
  Result<std::string> status = Error{"not asked"};
  Result<std::string> read = Error{"not asked"};  // which a majority has to confirm
  std::chrono::milliseconds took{0};              // the reading
};

asio::awaitable<void> AskMember(std::shared_ptr<cluster::EtcdClient> client, size_t index,
                                Member* member) {
  const std::string status_path = cluster::kStatusPath;
  const std::string status_body = "{}";
  member->status = co_await client->CallMember(index, status_path, status_body);
  if (!member->status.ok()) {
    co_return;
  }
  cluster::TxnRequest request;
  request.success.Read("health");
  const std::string read_path = cluster::kTxnPath;
  const std::string read_body = request.Text();
  const auto begun = std::chrono::steady_clock::now();
  member->read = co_await client->CallMember(index, read_path, read_body);
  member->took = std::chrono::duration_cast<std::chrono::milliseconds>(
      std::chrono::steady_clock::now() - begun);
}

// All of them at the same time.
std::vector<Member> AskMembers(const std::vector<Endpoint>& engine) {
  std::vector<Member> members;
  for (const Endpoint& endpoint : engine) {
    members.push_back({.endpoint = endpoint});
  }
  asio::io_context io;
  const auto client = std::make_shared<cluster::EtcdClient>(
      io.get_executor(), engine, kMemberPatience,
      [](const Endpoint& /*member*/, const Status& /*status*/) {});
  for (size_t i = 0; i < members.size(); ++i) {
    asio::co_spawn(io, AskMember(client, i, &members[i]), asio::detached);
  }
  io.run();
  return members;
}

std::string LeaderText(const json::value& cluster) {
  const std::string leader = TextAt(cluster, "leader");
  return fmt::format("{}, term {}",
                     leader == TextAt(cluster, "node") ? "it leads" : leader + " leads",
                     CountAt(cluster, "term"));
}

void CheckMembership(const json::value& status, Findings* findings) {
  const json::value& cluster = At(status, "cluster");
  const std::string node =
      fmt::format("node {} of {}", TextAt(cluster, "node"), TextAt(cluster, "name"));
  const std::string trouble = TextAt(cluster, "trouble");
  const std::string warning = TextAt(status, "warning");
  if (!trouble.empty()) {
    findings->Fault(kServerOfCluster, node, trouble, "See the members of etcd, below.");
  } else if (const std::string gap = TextAt(cluster, "gap"); !gap.empty()) {
    const std::string transfer = TextAt(cluster, "transfer");
    findings->Fault(kServerOfCluster, node, gap,
                    transfer.empty() ? "See pheromoned(8), CLUSTER." : "It " + transfer + ".");
  } else if (TextAt(cluster, "leader").empty()) {
    findings->Fault(kServerOfCluster, node, "no server leads: changes are refused",
                    "Most members of etcd have to run, and one server that has all changes.");
  } else if (!warning.empty()) {
    findings->Fault(kServerOfCluster, node, warning,
                    "Look at the disk of its journal, and at its log: journalctl -u pheromoned.");
  } else if (const uint64_t behind = CountAt(cluster, "behind"); behind > kFarBehind) {
    findings->Warning(kServerOfCluster, node,
                      fmt::format("{} events behind; {}", behind, LeaderText(cluster)),
                      "It catches up by itself; if it does not, this machine is too slow.");
  } else {
    findings->Ok(kServerOfCluster, node, LeaderText(cluster));
  }
  if (!At(status, "durable_sequence").is_null() && warning.empty()) {
    findings->Ok("journal", node,
                 fmt::format("durable up to event {} of {}", CountAt(status, "durable_sequence"),
                             CountAt(status, "sequence")));
  }
}

void CheckPeers(const json::value& status, Findings* findings) {
  const std::string own = TextAt(status, "version");
  for (const json::value& peer : ItemsAt(At(status, "cluster"), "peers")) {
    const std::string node = "node " + TextAt(peer, "node");
    const std::string state = TextAt(peer, "state");
    if (!FlagAt(peer, "up")) {
      findings->Fault(kPeersOfCluster, node, "not connected: " + state,
                      "Start pheromoned there; name, nodes, secret and version must be the same on "
                      "all machines, and their firewalls let the port of [cluster] nodes pass.");
    } else if (state != own) {
      findings->Warning(kPeersOfCluster, node,
                        fmt::format("runs pheromoned {}, this node {}", state, own),
                        "Upgrade the servers that follow first, the one that leads last: "
                        "pheromonectl cluster step-down.");
    } else {
      findings->Ok(kPeersOfCluster, node, "connected, pheromoned " + state);
    }
  }
}

// The member's name for messages, and whether a server is on its machine.
struct Whose {
  std::string text;
  bool is_witness = true;
};

Whose WhoseMember(const Endpoint& member, const config::ClusterSettings& cluster) {
  for (const auto& node : cluster.nodes) {
    if (node.address.address == member.address) {
      return {ToText(member) + ", on " + node.name, false};
    }
  }
  return {ToText(member) + ", a witness", true};
}

// Numbers of etcd's JSON are texts.
double SizeAt(const json::value& answer, std::string_view key) {
  const std::string text = TextAt(answer, key);
  return std::strtod(text.c_str(), nullptr);
}

// `cluster_id`: of most members; empty: nobody can say (ClusterOfMost).
void CheckMember(const Member& member, const json::value& status, const Whose& whose,
                 const std::string& cluster_id, Findings* findings) {
  const json::value& header = At(status, "header");
  const std::string own_id = TextAt(header, kClusterId);
  const bool leads = TextAt(header, "member_id") == TextAt(status, "leader");
  const double database = SizeAt(status, "dbSize");
  std::string errors;
  for (const json::value& error : ItemsAt(status, "errors")) {
    errors += (errors.empty() ? "" : "; ") + std::string(TextOf(error));
  }
  const std::string text = fmt::format("etcd {}, {}, database {}", TextAt(status, "version"),
                                       leads ? "leads" : "follows", Size(database));
  if (cluster_id.empty()) {
    findings->Fault(kEtcdMembers, whose.text,
                    "is of the cluster of etcd " + own_id + ", and no other has most members",
                    "Compare /etc/default/etcd of all machines. Delete no data before it is known "
                    "which members have the log.");
  } else if (own_id != cluster_id) {
    findings->Fault(kEtcdMembers, whose.text, "is of another cluster of etcd than most members",
                    "Stop it, delete its data folder, and give it the settings that pheromonectl "
                    "cluster setup made with those of the others.");
  } else if (errors.find("NOSPACE") != std::string::npos) {
    findings->Fault(kEtcdMembers, whose.text, text + ": " + errors,
                    "Its database is full: etcdctl defrag, then etcdctl alarm disarm (package "
                    "etcd-client).");
  } else if (!member.read.ok()) {
    findings->Fault(kEtcdMembers, whose.text, "does not reach a majority: " + member.read.error(),
                    "Most members have to run and reach each other on the port of their peers, "
                    "2380: journalctl -u etcd.");
  } else if (!errors.empty()) {
    findings->Fault(kEtcdMembers, whose.text, text + ": " + errors,
                    "See journalctl -u etcd there.");
  } else if (database > kLargeDatabase) {
    findings->Warning(kEtcdMembers, whose.text, text + ", of 2 GiB",
                      "The leader trims it by itself; give the space back with etcdctl defrag "
                      "(package etcd-client).");
  } else if (leads && whose.is_witness) {
    findings->Warning(kEtcdMembers, whose.text,
                      text + ": each change travels to the witness and back",
                      "pheromonectl cluster step-down, asked of the server that leads, takes the "
                      "lead of etcd along to another one's machine.");
  } else {
    findings->Ok(kEtcdMembers, whose.text,
                 fmt::format("{}, a reading took {} ms", text, member.took.count()));
  }
}

void CheckEtcd(const config::ClusterSettings& cluster, Findings* findings) {
  const std::vector<Member> members = AskMembers(cluster.engine);
  std::vector<json::value> statuses;
  std::vector<std::string> cluster_ids;
  for (const Member& member : members) {
    std::error_code error;
    json::value& status = statuses.emplace_back();
    if (member.status.ok()) {
      status = json::parse(member.status.value(), error);
    }
    const std::string id = TextAt(At(status, "header"), kClusterId);
    if (!id.empty()) {
      cluster_ids.push_back(id);
    } else {
      status = nullptr;  // another program's
    }
  }
  const std::string cluster_id = ClusterOfMost(cluster_ids, members.size());
  for (size_t i = 0; i < members.size(); ++i) {
    const Member& member = members[i];
    const Whose whose = WhoseMember(member.endpoint, cluster);
    if (!member.status.ok()) {
      findings->Fault(kEtcdMembers, whose.text, "no answer: " + member.status.error(),
                      "Start it there (systemctl start etcd); firewalls must let 2379 pass between "
                      "the machines of the cluster.");
    } else if (statuses[i].is_null()) {
      findings->Fault(kEtcdMembers, whose.text, "answers, but not as etcd does",
                      "Another program has this port; engine of [cluster] names the members.");
    } else {
      CheckMember(member, statuses[i], whose, cluster_id, findings);
    }
  }
}

// Of the running server, or of the command line.
Result<config::ClusterSettings> ClusterSettingsOf(const ServerOptions& options, std::string file) {
  if (file.empty()) {
    PHEROMONE_TRY(const json::value view, AskJson(options, "GET", "/api/v1/config"));
    file = TextAt(view, "file");
  }
  PHEROMONE_TRY(const config::Config config, config::LoadConfig(file));
  if (!config.cluster) {
    return Error{file + ": has no [cluster]"};
  }
  return *config.cluster;
}

// Of the service that was asked for; a socket that is of none is taken for that of the first one.
std::string ConfigOfService(const ServerOptions& options) {
  const Result<ServerSocket> socket = ChooseSocket(options.socket);
  const std::string instance = socket.ok() ? InstanceOf(socket.value().path) : "";
  return ServiceConfigOf(instance.empty() ? "pheromoned" : instance);
}

}  // namespace

std::string ClusterOfMost(const std::vector<std::string>& cluster_ids, size_t members) {
  for (const std::string& id : cluster_ids) {
    const auto count = static_cast<size_t>(std::count(cluster_ids.begin(), cluster_ids.end(), id));
    if (count > members / 2 || count == cluster_ids.size()) {
      return id;
    }
  }
  return "";
}

int CheckCluster(const ServerOptions& options, const std::string& config) {
  Findings findings;
  const Result<json::value> status = AskJson(options, "GET", "/api/v1/status");
  if (!status.ok()) {
    findings.Fault(kServerOfCluster, "socket", status.error(),
                   "Start pheromoned; its log tells what it waits for: journalctl -u pheromoned.");
  } else if (At(status.value(), "cluster").is_null()) {
    findings.Fault(kServerOfCluster, "configuration", "this server is not one of a cluster",
                   "Make [cluster] and all that it needs: pheromonectl cluster setup.");
  } else {
    CheckMembership(status.value(), &findings);
    CheckPeers(status.value(), &findings);
  }
  // A server that waits for its cluster does not answer yet, and wants to be helped most.
  const std::string file = config.empty() && !status.ok() ? ConfigOfService(options) : config;
  if (status.ok() || !file.empty()) {
    if (const Result<config::ClusterSettings> settings = ClusterSettingsOf(options, file);
        settings.ok()) {
      CheckEtcd(settings.value(), &findings);
    } else {
      findings.Fault(kEtcdMembers, "its members", settings.error(),
                     "Name a configuration that this user may read: sudo, or --config FILE.");
    }
  }
  CheckClock(&findings);
  return findings.Print(options.json);
}

}  // namespace pheromone::ctl
