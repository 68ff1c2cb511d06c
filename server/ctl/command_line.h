// The command line of pheromonectl, as it is declared to CLI11: each adds its commands to the
// program, and has them set `*exit_status` when they have run.
#pragma once

#include <memory>

#include "server/ctl/server_call.h"

namespace CLI {
class App;
}  // namespace CLI

namespace pheromone::ctl {

/// status, links, clients, laws, sense, watch, config, version: what shows.
void AddShowCommands(CLI::App* program, const ServerOptions* options, int* exit_status);

/// deposit, erase, paint, command, halt, reload, snapshot: what changes.
void AddChangeCommands(CLI::App* program, const ServerOptions* options, int* exit_status);

/// capture ...: the recording of a running server.
void AddCaptureCommands(CLI::App* program, const ServerOptions* options, int* exit_status);

/// map ...: what needs no server.
void AddMapCommands(CLI::App* program, int* exit_status);

/// journal ...: what a server has kept, looked at without it.
void AddJournalCommands(CLI::App* program, int* exit_status);

/// replay: what a server has recorded, let happen again.
void AddReplayCommands(CLI::App* program, int* exit_status);

}  // namespace pheromone::ctl
