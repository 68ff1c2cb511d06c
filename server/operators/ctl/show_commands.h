// pheromonectl status, links, clients, laws, sense, config show, version: the status of a running
// server, as readable tables or, with --json, as sent by the server.
//
// Each prints to standard output and returns the exit status; errors go to standard error
// (server_call.h).
#pragma once

#include <string>

#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {

int ShowStatus(const ServerOptions& options, bool with_hash);
int ShowLinks(const ServerOptions& options);
/// `link` empty: of all links.
int ShowClients(const ServerOptions& options, const std::string& link);
int ShowLaws(const ServerOptions& options);
int ShowConfig(const ServerOptions& options);
/// This program's version, and that of the server if there is one.
int ShowVersion(const ServerOptions& options);

/// What a robot at this pose would sense.
int Sense(const ServerOptions& options, const std::string& pheromone, double x_m, double y_m,
          double heading_deg);

}  // namespace pheromone::ctl
