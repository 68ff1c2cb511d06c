// The command line of pheromonectl, declared for CLI11: each function adds commands to the program;
// they set `*exit_status` when they run.
#pragma once

#include <memory>

#include "server/operators/ctl/server_call.h"

namespace CLI {
class App;
}  // namespace CLI

namespace pheromone::ctl {

/// Queries: status, links, clients, laws, sense, doctor, watch, config, version.
void AddShowCommands(CLI::App* program, const ServerOptions* options, int* exit_status);

/// Changes: deposit, erase, paint, command, halt, reload, snapshot.
void AddChangeCommands(CLI::App* program, const ServerOptions* options, int* exit_status);

/// tags ...: what is written on virtual RFID tags.
void AddTagCommands(CLI::App* program, const ServerOptions* options, int* exit_status);

/// cluster ...: one of several servers.
void AddClusterCommands(CLI::App* program, const ServerOptions* options, int* exit_status);

/// capture ...: the recording of a running server.
void AddCaptureCommands(CLI::App* program, const ServerOptions* options, int* exit_status);

/// map ...: commands that do not need a server.
void AddMapCommands(CLI::App* program, int* exit_status);

/// journal ...: commands on a journal's folder, without a server.
void AddJournalCommands(CLI::App* program, int* exit_status);

/// net ...: Petri nets in files, without a server.
void AddNetCommands(CLI::App* program, const ServerOptions* options, int* exit_status);

/// modem ...: radio modems on two serial ports, without a server.
void AddModemCommands(CLI::App* program, int* exit_status);

/// keys ...: the robots' keys in a file, without a server; revoke also at one.
void AddKeysCommands(CLI::App* program, const ServerOptions* options, int* exit_status);

/// replay: replays recordings.
void AddReplayCommands(CLI::App* program, int* exit_status);

/// export: recordings as tables and for viewers.
void AddExportCommands(CLI::App* program, const ServerOptions* options, int* exit_status);

}  // namespace pheromone::ctl
