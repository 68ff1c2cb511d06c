#include "proto_tests/exchange_bench/cluster.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <utility>
#include <vector>

#include "proto_tests/cluster/etcd_members.h"
#include "proto_tests/exchange_bench/arena.h"
#include "proto_tests/exchange_bench/server_process.h"
#include "proto_tests/exchange_bench/udp_load.h"

namespace pheromone::bench {
namespace {

constexpr LinkNumbers kUdpOnly{8, 0};
constexpr char kJournal[] = "[journal]\nfolder = \"state\"\n";
constexpr int kParts = 10;

// A server in a folder of its own, with what its clients ask.
struct Server {
  Server(const ClusterOptions& options, const std::string& name, const std::string& more)
      : folder(options.folder + "/" + name) {
    std::filesystem::create_directory(folder);
    std::ofstream(folder + "/secret") << std::string(64, 'a') << '\n';
    chmod((folder + "/secret").c_str(), S_IRUSR | S_IWUSR);
    arena = MakeArena(folder, kUdpOnly, kJournal + more);
    process = std::make_unique<ServerProcess>(options.pheromoned, arena.config_file,
                                              std::vector<std::string>{}, folder);
    for (int i = 1; i <= kUdpOnly.udp; ++i) {
      ports.push_back(process->PortOf(fmt::format("udp-{}", i)));
    }
  }

  LoadResult Run(Load load, int clients, double seconds) const {
    return RunLoad(arena, {load, clients, ports, seconds});
  }

  const std::string folder;
  Arena arena;
  std::unique_ptr<ServerProcess> process;
  std::vector<uint16_t> ports;
};

std::string ClusterTable(const std::string& node, const cluster::EtcdMembers& etcd,
                         const std::vector<uint16_t>& peers) {
  std::vector<std::string> engine;
  for (const Endpoint& endpoint : etcd.endpoints()) {
    engine.push_back(fmt::format("\"http://{}\"", ToText(endpoint)));
  }
  return fmt::format(
      "[cluster]\nname = \"bench\"\nnode = \"{}\"\nengine = [{}]\nsecret_file = \"secret\"\n"
      "nodes = {{a = \"127.0.0.1:{}\", b = \"127.0.0.1:{}\"}}\n",
      node, fmt::join(engine, ", "), peers[0], peers[1]);
}

// Two servers in turn; the row is the first one's.
void Compare(const ClusterOptions& options, const Server& server, const Server& with, Load load,
             int clients, Row row, Report* report) {
  row.clients = clients;
  const double seconds = options.effort.seconds;
  report->Add(RunInTurn(
      options.effort.rounds, [&] { return server.Run(load, clients, seconds); },
      [&] { return with.Run(load, clients, seconds); }, std::move(row)));
}

}  // namespace

void RunCluster(const ClusterOptions& options, Report* report) {
  const Server alone(options, "alone", "");
  const cluster::EtcdMembers etcd;
  const std::vector<uint16_t> peers = cluster::FreePorts(2);
  const Server leader(options, "a", ClusterTable("a", etcd, peers));  // the only one, at first
  const Server follower(options, "b", ClusterTable("b", etcd, peers));
  const std::string beside = "a server alone";
  Compare(options, follower, alone, Load::kSense, options.clients,
          {.server = "follower",
           .load = fmt::format("SENSE over UDP by {} clients", options.clients),
           .beside = beside},
          report);
  TimeSyncs(options.folder, options.effort, report);
  for (const int clients : {1, options.clients, options.many_clients}) {
    const std::string load = fmt::format("TRACE over UDP by {} clients", clients);
    for (const auto& [name, server] : {std::pair{"leader", &leader}, {"follower", &follower}}) {
      Compare(options, *server, alone, Load::kTrace, clients,
              {.server = name, .load = load, .beside = beside}, report);
    }
  }
  for (int part = 0; part < kParts; ++part) {
    LoadResult served =
        leader.Run(Load::kTrace, options.many_clients, options.lasting_seconds / kParts);
    report->Add({.server = "leader",
                 .load = fmt::format("TRACE over UDP by {} clients, part {} of {}",
                                     options.many_clients, part + 1, kParts),
                 .clients = options.many_clients,
                 .per_second = served.per_second,
                 .right = served.right,
                 .wrong = served.wrong,
                 .lost = served.lost,
                 .late = served.late,
                 .times = std::move(served.times)});
    Report::Say(fmt::format("         etcd's database has {:.1f} MB",
                            static_cast<double>(etcd.DatabaseBytes()) / 1e6));
  }
}

}  // namespace pheromone::bench
