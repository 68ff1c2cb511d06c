// What `pheromonectl doctor` can see without a server: configuration, folders, token, ports, serial
// devices, groups, clock. Nothing is changed, and nothing is written but to ports that are free,
// which are bound for a moment.
//
//   const std::optional<config::Config> config = CheckConfiguration(place, &findings);
//   if (config) { CheckJournal(place, *config, &findings); ... }
#pragma once

#include <sys/types.h>

#include <optional>
#include <set>
#include <string>

#include "server/config/config.h"
#include "server/operators/ctl/doctor/findings.h"

namespace pheromone::ctl {

/// The server that is looked at, or where it would run.
struct Place {
  std::string config_file;                  ///< empty: the default configuration
  std::string state_directory;              ///< of a service; empty: it is none
  std::optional<int> server = {};           ///< its process; empty: it does not run
  std::string node = {};                    ///< of its cluster, as the server says; else empty
  std::optional<std::string> journal = {};  ///< its folder, as the server says; empty: none
};

/// Empty, and told, if the server would not start with it. Of a cluster, for the node that this
/// machine is, if that can be known without the server's command line.
std::optional<config::Config> CheckConfiguration(const Place& place, Findings* findings);
void CheckJournal(const Place& place, const config::Config& config, Findings* findings);
void CheckToken(const config::Config& config, Findings* findings);
/// Of web, cluster, links and trackers.
void CheckPorts(const Place& place, const config::Config& config, Findings* findings);
/// Of links; returns the names of those that have a fault.
std::set<std::string> CheckSerialPorts(const Place& place, const config::Config& config,
                                       Findings* findings);
/// Whether a link is this machine's, for all that is known.
bool IsHere(const links::LinkConfig& link, const config::Config& config);
void CheckGroups(const config::Config& config, Findings* findings);
void CheckClock(Findings* findings);

/// The name of the user that this program runs as, and whether it is in a group.
std::string DescribeUser();
bool IsInGroup(const std::string& name);
/// The name of a group; without one, its number.
std::string NameOfGroup(gid_t id);

}  // namespace pheromone::ctl
