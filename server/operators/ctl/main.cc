// pheromonectl: the operator's command line. Most commands send requests to a running server over
// its Unix socket; `map`, `journal`, `net`, `keys`, `config check` and some of `cluster` need no
// server.
//
// Exit status: 0 success; 1 the server, a robot, a file or standard output refused; 2 an error in
// the command line or a configuration; 3 no server; 4 a damaged journal.
#include <string>

#include <CLI/CLI.hpp>

#include "server/base/command_line.h"
#include "server/base/program.h"
#include "server/operators/ctl/command_line.h"
#include "server/operators/ctl/server_socket.h"

namespace pheromone::ctl {
namespace {

// The name of a systemd instance: the part of pheromoned@lab2 after the @.
std::string CheckInstance(const std::string& name) {
  return name.empty() || name.front() == '.' || name.find('/') != std::string::npos
             ? "found \"" + name + "\", expected the name of a service, such as lab2"
             : "";
}

int Main(int argc, char** argv) {
  CLI::App app("Operate a pheromone server.", "pheromonectl");
  Standardise(&app);
  app.set_version_flag("--version", "pheromonectl " PHEROMONE_VERSION);
  app.require_subcommand(1);
  app.fallthrough();  // --socket and --json may follow a command
  int status = 0;
  ServerOptions options;
  CLI::Option* socket =
      app.add_option("--socket", options.socket,
                     "The server's Unix socket (default: $PHEROMONE_SOCKET, ./pheromoned.sock "
                     "or /run/pheromone/pheromoned/pheromoned.sock)");
  socket->type_name("PATH");
  app.add_option_function<std::string>(
         "--instance", [&](const std::string& name) { options.socket = SocketOf(name); },
         "Connect to the service configured by /etc/pheromone/NAME.toml, at "
         "/run/pheromone/NAME/pheromoned.sock")
      ->check(CLI::Validator(CheckInstance, ""))
      ->excludes(socket)
      ->type_name("NAME");
  app.add_flag("--json", options.json, "Print the server's answer as JSON");
  AddShowCommands(&app, &options, &status);
  AddChangeCommands(&app, &options, &status);
  AddTagCommands(&app, &options, &status);
  AddClusterCommands(&app, &options, &status);
  AddCaptureCommands(&app, &options, &status);
  AddMapCommands(&app, &status);
  AddJournalCommands(&app, &status);
  AddNetCommands(&app, &options, &status);
  AddModemCommands(&app, &status);
  AddKeysCommands(&app, &options, &status);
  AddReplayCommands(&app, &status);
  AddExportCommands(&app, &options, &status);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kUsage;
  }
  return status;
}

}  // namespace
}  // namespace pheromone::ctl

int main(int argc, char** argv) {
  return pheromone::RunProgram("pheromonectl", [&] { return pheromone::ctl::Main(argc, argv); });
}
