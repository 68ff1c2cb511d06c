// What `pheromonectl doctor` learns from a running server: its health, links, robots, trackers, and
// how its channels are shared.
#pragma once

#include <set>
#include <string>

#include <boost/json/value.hpp>

#include "server/config/config.h"
#include "server/operators/ctl/doctor/findings.h"
#include "server/operators/ctl/doctor/host_checks.h"

namespace pheromone::ctl {

/// The server's answers to GET /api/v1/status, links, clients, trackers and config.
struct ServerViews {
  boost::json::value status;
  boost::json::value links;
  boost::json::value clients;
  boost::json::value trackers;
  boost::json::value config;
};

void CheckHealth(const ServerViews& views, Findings* findings);
/// Whether the file says what the server has read.
void CheckReread(const ServerViews& views, const config::Config& config, Findings* findings);
/// `told`: links whose fault was found already.
void CheckLinks(const Place& place, const ServerViews& views, const std::set<std::string>& told,
                Findings* findings);
void CheckRobots(const ServerViews& views, Findings* findings);
void CheckTrackers(const ServerViews& views, Findings* findings);
/// Rounds or contention, and whether it fits the robots that are there.
void CheckChannels(const ServerViews& views, const config::Config& config, Findings* findings);

}  // namespace pheromone::ctl
