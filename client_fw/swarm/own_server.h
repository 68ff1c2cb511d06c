// A swarm for one's own running server, which is asked for its map, pheromones, paths and links.
//
//   const Result<OwnSwarm> swarm = SwarmForServer({.robots = 12});
//   RunScenarioLive(swarm.value().scenario, swarm.value().ports, swarm.value().load.access, ...);
//
// The server runs on this machine: the swarm opens the terminals of its virtual modems, and reads
// the configuration file that the server names. One thread.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client_fw/swarm/capacity.h"
#include "client_fw/swarm/scenario/run.h"
#include "client_fw/swarm/scenario/scenario.h"
#include "server/base/result.h"
#include "server/config/config.h"

namespace pheromone::swarm {

struct SwarmWish {
  int robots = 1;
  std::string socket = {};     ///< the server's; empty: as pheromonectl finds it
  std::string pheromone = {};  ///< to follow; empty: that of the first path
  /// Between requests; none: 0.2 s, or longer if the links do not hold so many robots.
  std::optional<double> period_s = {};
  double seconds = 0;  ///< 0: until it is stopped
  bool is_signed = false;
};

/// A virtual modem of the server that is up.
struct ServerTerminal {
  std::string link;
  std::string path;
};

struct OwnSwarm {
  Scenario scenario;               ///< a channel for each terminal
  std::vector<std::string> ports;  ///< of the terminals
  std::vector<std::string> links;  ///< their names
  ChannelLoad load;                ///< of the channel with most robots
  std::string why_slower = {};     ///< unless the period is 0.2 s or as wished
};

/// Robots in turn on the terminals, along the paths of the pheromone that they follow. Of the links
/// those with medium access are used, if there are any, and of these all like the first one.
/// Errors: no such pheromone, no path of it, no terminal, more robots than the links hold at any
/// period.
Result<OwnSwarm> MakeSwarm(const config::Config& server,
                           const std::vector<ServerTerminal>& terminals, const SwarmWish& wish);

/// The same for the server at the socket. Errors: also those of asking it and of reading its file.
Result<OwnSwarm> SwarmForServer(const SwarmWish& wish);

/// The load of the channel with most robots, at links as they are without configuration.
ChannelLoad LoadOf(const Scenario& scenario, LinkKind access);

}  // namespace pheromone::swarm
