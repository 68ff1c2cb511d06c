#include "server/operators/ctl/cluster/cluster_plan.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "server/config/sections.h"

namespace pheromone::ctl {
namespace {

constexpr uint16_t kEtcdClientPort = 2379;
constexpr uint16_t kEtcdPeerPort = 2380;
constexpr uint16_t kServerPort = 8390;
constexpr size_t kLeastMachines = 3;
constexpr size_t kLeastServers = 2;

std::string AddressText(const std::string& address, uint16_t port) {
  return ToText(Endpoint{address, port});
}

std::string EtcdUrl(const std::string& address, uint16_t port) {
  return "http://" + AddressText(address, port);
}

bool IsV6(const ClusterMachine& machine) {
  return machine.address.find(':') != std::string::npos;
}

// A name that is also that of a folder.
bool IsMachineName(std::string_view name) {
  return config::IsName(name) && name.front() != '.' && name.front() != '-';
}

// Without brackets; empty: none that another machine can reach.
std::optional<std::string> ParseAddress(std::string_view text) {
  const bool is_v6 = text.find(':') != std::string_view::npos;
  const std::string bare(is_v6 && text.starts_with('[') && text.ends_with(']')
                             ? text.substr(1, text.size() - 2)
                             : text);
  const auto endpoint = config::ParseEndpoint(AddressText(bare, kServerPort));
  const bool is_own = bare.starts_with("127.") || bare == "0.0.0.0" || bare == "::1" ||
                      bare == "::" || bare.starts_with("fe80:");
  return endpoint && !is_own ? std::optional(endpoint->address) : std::nullopt;
}

Result<ClusterMachine> ParseMachine(const std::string& word) {
  const size_t equals = word.find('=');
  const std::string name = word.substr(0, equals);
  if (equals == std::string::npos || !IsMachineName(name)) {
    return Error{"machine \"" + word + "\": expected NAME=ADDRESS, such as a=10.0.0.1, the name " +
                 std::string(config::kNameExpected) + " that begins with a letter or digit"};
  }
  const auto address = ParseAddress(std::string_view(word).substr(equals + 1));
  if (!address) {
    return Error{"machine \"" + word +
                 "\": expected a numeric address at which the other machines reach it, such as "
                 "10.0.0.1 or fd00::1"};
  }
  return ClusterMachine{name, *address, false};
}

template <typename Use>
void ForServers(const ClusterPlan& plan, Use use) {
  for (const ClusterMachine& machine : plan.machines) {
    if (!machine.is_witness) {
      use(machine);
    }
  }
}

std::string EtcdSettings(const ClusterPlan& plan, const ClusterMachine& machine,
                         const std::string& token) {
  std::vector<std::string> members;
  for (const ClusterMachine& it : plan.machines) {
    members.push_back(it.name + '=' + EtcdUrl(it.address, kEtcdPeerPort));
  }
  return fmt::format(
      R"(# etcd of the cluster {name} on the machine {machine}: /etc/default/etcd.
ETCD_NAME={machine}
ETCD_DATA_DIR=/var/lib/etcd/{name}
ETCD_INITIAL_CLUSTER={members}
ETCD_INITIAL_CLUSTER_TOKEN={name}-{token}
ETCD_INITIAL_CLUSTER_STATE=new
# Here and nowhere else: etcd asks nobody for a password.
ETCD_LISTEN_PEER_URLS={peer}
ETCD_INITIAL_ADVERTISE_PEER_URLS={peer}
ETCD_LISTEN_CLIENT_URLS={client},{loopback}
ETCD_ADVERTISE_CLIENT_URLS={client}
# Of a network of one room, and SSDs.
ETCD_HEARTBEAT_INTERVAL=50
ETCD_ELECTION_TIMEOUT=500
# A machine that comes back does not depose the leader.
ETCD_PRE_VOTE=true
# Without it, etcd 3.4 does not start on a 64-bit ARM board; others only remark on it.
ETCD_UNSUPPORTED_ARCH=arm64
)",
      fmt::arg("name", plan.name), fmt::arg("machine", machine.name),
      fmt::arg("members", fmt::join(members, ",")), fmt::arg("token", token),
      fmt::arg("peer", EtcdUrl(machine.address, kEtcdPeerPort)),
      fmt::arg("client", EtcdUrl(machine.address, kEtcdClientPort)),
      fmt::arg("loopback", EtcdUrl(IsV6(machine) ? "::1" : "127.0.0.1", kEtcdClientPort)));
}

// Debian's unit neither waits for the address nor starts again after every kind of end.
constexpr std::string_view kEtcdUnit = R"([Unit]
Wants=network-online.target
After=network-online.target
StartLimitIntervalSec=0

[Service]
Restart=always
RestartSec=2s
)";

std::string ServerUnit(const ClusterMachine& machine) {
  return fmt::format(
      R"([Unit]
Wants=network-online.target
After=network-online.target

[Service]
ExecStart=
ExecStart=/usr/sbin/pheromoned --config /etc/pheromone/pheromoned.toml --node {}
)",
      machine.name);
}

std::string ClusterTable(const ClusterPlan& plan) {
  std::vector<std::string> engine;
  for (const ClusterMachine& it : plan.machines) {
    engine.push_back('"' + EtcdUrl(it.address, kEtcdClientPort) + '"');
  }
  std::vector<std::string> nodes;
  ForServers(plan, [&](const ClusterMachine& it) {
    nodes.push_back(fmt::format("\"{}\" = \"{}\"", it.name, AddressText(it.address, kServerPort)));
  });
  return fmt::format(
      R"(
# Several servers with one map: the same on all machines, as is all of this file.
[cluster]
name = "{}"
engine = [{}]
nodes = {{{}}}
secret_file = "cluster-secret"
)",
      plan.name, fmt::join(engine, ", "), fmt::join(nodes, ", "));
}

std::string ClusterPortsOf(const ClusterMachine& machine, std::string_view separator) {
  std::vector<uint16_t> ports = {kEtcdClientPort, kEtcdPeerPort};
  if (!machine.is_witness) {
    ports.push_back(kServerPort);
  }
  return fmt::format("{}", fmt::join(ports, separator));
}

std::string Firewall(const ClusterPlan& plan, const ClusterMachine& machine) {
  std::string accepted;
  for (const bool is_v6 : {false, true}) {
    std::vector<std::string> addresses;
    for (const ClusterMachine& it : plan.machines) {
      if (IsV6(it) == is_v6) {
        addresses.push_back(it.address);
      }
    }
    if (!addresses.empty()) {
      accepted +=
          fmt::format("    {} saddr {{ {} }} tcp dport {{ {} }} accept\n", is_v6 ? "ip6" : "ip",
                      fmt::join(addresses, ", "), ClusterPortsOf(machine, ", "));
    }
  }
  return fmt::format(
      R"(# The cluster's ports are for its machines only. May be loaded again and again.
table inet pheromone_cluster
delete table inet pheromone_cluster
table inet pheromone_cluster {{
  chain input {{
    type filter hook input priority -10; policy accept;
    iif "lo" accept
{}    tcp dport {{ {} }} drop
  }}
}}
)",
      accepted, ClusterPortsOf(machine, ", "));
}

std::string UfwLines(const ClusterPlan& plan, const ClusterMachine& machine) {
  std::string lines;
  for (const ClusterMachine& it : plan.machines) {
    if (it != machine && IsV6(it) == IsV6(machine)) {
      lines += fmt::format("     sudo ufw allow proto tcp from {} to {} port {}\n", it.address,
                           machine.address, ClusterPortsOf(machine, ","));
    }
  }
  return lines;
}

std::string Instructions(const ClusterPlan& plan, const ClusterMachine& machine) {
  const bool is_server = !machine.is_witness;
  std::string others;
  ForServers(plan, [&](const ClusterMachine& it) {
    if (it != machine) {
      others += (others.empty() ? "" : ", ") + it.name;
    }
  });
  std::string text = fmt::format(
      "Machine {} of the cluster {}, {}: {}\n\n"
      "Run these commands on it, in this folder. The order of the machines does not matter; the\n"
      "cluster begins when most of them are ready.\n\n"
      "1. Install. The package of etcd starts it alone; step 2 gives it another folder.\n\n"
      "     sudo apt install etcd-server nftables\n",
      machine.name, plan.name, machine.address,
      is_server ? "etcd and pheromoned" : "a witness, which has etcd and no pheromoned");
  if (is_server) {
    text +=
        "     sudo apt install ./pheromone_*.deb\n\n"
        "   (the package of Pheromone, of the same version on all machines; copy it here first)\n";
  }
  text +=
      "\n2. Copy.\n\n"
      "     sudo install -m 644 etcd /etc/default/etcd\n"
      "     sudo install -D -m 644 etcd-unit.conf "
      "/etc/systemd/system/etcd.service.d/cluster.conf\n";
  if (is_server) {
    text += fmt::format(
        "     sudo install -D -m 644 pheromoned-unit.conf "
        "/etc/systemd/system/pheromoned.service.d/cluster.conf\n"
        "     sudo install -m 640 -g pheromone cluster-secret /etc/pheromone/cluster-secret\n"
        "     sudo tee -a /etc/pheromone/pheromoned.toml <cluster.toml >/dev/null\n\n"
        "   /etc/pheromone/pheromoned.toml has to be the same on {} too: map, pheromones, links.\n",
        others);
  }
  text += fmt::format(
      "\n3. Let nobody but the machines of the cluster use its ports: nftables,\n\n"
      "     sudo install -D -m 644 firewall.nft /etc/nftables.d/pheromone-cluster.nft\n"
      "     echo 'include \"/etc/nftables.d/pheromone-cluster.nft\"' | "
      "sudo tee -a /etc/nftables.conf >/dev/null\n"
      "     sudo systemctl enable nftables\n"
      "     sudo nft -f firewall.nft\n\n"
      "   or, where ufw rules:\n\n{}"
      "\n4. Start.{}\n\n"
      "     sudo systemctl daemon-reload\n",
      UfwLines(plan, machine),
      is_server ? " What the server did while it was alone is put aside: the cluster has one map."
                : "");
  if (is_server) {
    text +=
        "     sudo systemctl stop pheromoned\n"
        "     sudo mv /var/lib/pheromone/pheromoned/journal "
        "/var/lib/pheromone/pheromoned/journal-alone\n"
        "     sudo systemctl restart --no-block etcd pheromoned\n\n"
        "5. Look whether all is well, when all machines have come so far.\n\n"
        "     sudo pheromonectl cluster check\n\n"
        "This folder has the cluster's secret: delete it when all machines have theirs.\n\n"
        "In place of a machine that was lost, do not start yet: its etcd has to join as a new\n"
        "member. Then its server takes the map from another one. Backup and restore, in\n"
        "/usr/share/doc/pheromone/CLUSTER.md, has the commands.\n";
  } else {
    text += fmt::format(
        "     sudo systemctl restart --no-block etcd\n\n"
        "5. Look whether all is well, when all machines have come so far: on {0},\n\n"
        "     sudo pheromonectl cluster check\n\n"
        "In place of a witness that was lost, do not start yet: its etcd has to join as a new\n"
        "member. Backup and restore, in /usr/share/doc/pheromone/CLUSTER.md on {0}, has the\n"
        "commands.\n",
        others);
  }
  return text;
}

}  // namespace

Result<ClusterPlan> PlanCluster(const std::string& name, const std::vector<std::string>& machines,
                                const std::vector<std::string>& witnesses) {
  if (!IsMachineName(name)) {
    return Error{"cluster name \"" + name + "\": expected " + std::string(config::kNameExpected) +
                 " that begin with a letter or digit"};
  }
  ClusterPlan plan{name, {}};
  size_t servers = 0;
  for (const std::string& word : machines) {
    PHEROMONE_TRY(ClusterMachine machine, ParseMachine(word));
    for (const ClusterMachine& other : plan.machines) {
      if (other.name == machine.name || other.address == machine.address) {
        return Error{"machine \"" + word + "\": expected another " +
                     (other.name == machine.name ? "name" : "address") + " than that of \"" +
                     other.name + '=' + other.address + '"'};
      }
    }
    machine.is_witness = machine.name == "witness" || std::find(witnesses.begin(), witnesses.end(),
                                                                machine.name) != witnesses.end();
    servers += machine.is_witness ? 0 : 1;
    plan.machines.push_back(std::move(machine));
  }
  for (const std::string& witness : witnesses) {
    if (std::none_of(plan.machines.begin(), plan.machines.end(),
                     [&](const ClusterMachine& it) { return it.name == witness; })) {
      return Error{"witness \"" + witness + "\": expected the name of one of the machines"};
    }
  }
  const size_t count = plan.machines.size();
  if (count < kLeastMachines || count > config::ClusterSettings::kMaxMachines || count % 2 == 0) {
    return Error{fmt::format(
        "{} machines: expected 3, 5, 7 or 9, of which most have to run: one more than an odd "
        "number survives no further loss",
        count)};
  }
  if (servers < kLeastServers) {
    return Error{fmt::format(
        "{} of {} machines have a server: expected at least two, the others are witnesses", servers,
        count)};
  }
  return plan;
}

std::vector<PlannedFile> FilesOf(const ClusterPlan& plan, const ClusterMachine& machine,
                                 const ClusterRandom& random) {
  std::vector<PlannedFile> files = {{"README.txt", Instructions(plan, machine)},
                                    {"etcd", EtcdSettings(plan, machine, random.token)},
                                    {"etcd-unit.conf", std::string(kEtcdUnit)},
                                    {"firewall.nft", Firewall(plan, machine)}};
  if (!machine.is_witness) {
    files.push_back({"pheromoned-unit.conf", ServerUnit(machine)});
    files.push_back({"cluster.toml", ClusterTable(plan)});
    files.push_back({"cluster-secret", random.secret + '\n', true});
  }
  return files;
}

}  // namespace pheromone::ctl
