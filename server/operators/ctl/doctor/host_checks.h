// What `pheromonectl doctor` can see without a server: configuration, folders, token, ports, serial
// devices, groups, clock. Nothing is changed, and nothing is written but to ports that are free,
// which are bound for a moment.
//
//   const std::optional<config::Config> config = CheckConfiguration(place, &findings);
//   if (config) { CheckJournal(place, *config, &findings); ... }
#pragma once

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
  std::optional<std::string> journal = {};  ///< its folder, as the server says; empty: none
};

/// Empty, and told, if the server would not start with it.
std::optional<config::Config> CheckConfiguration(const Place& place, Findings* findings);
void CheckJournal(const Place& place, const config::Config& config, Findings* findings);
void CheckToken(const config::Config& config, Findings* findings);
/// Of web, links and trackers.
void CheckPorts(const Place& place, const config::Config& config, Findings* findings);
/// Of links; returns the names of those that have a fault.
std::set<std::string> CheckSerialPorts(const Place& place, const config::Config& config,
                                       Findings* findings);
void CheckGroups(const config::Config& config, Findings* findings);
void CheckClock(Findings* findings);

/// "lab, in the groups lab and dialout", and whether it is in one of them.
std::string DescribeUser();
bool IsInGroup(const std::string& name);

}  // namespace pheromone::ctl
