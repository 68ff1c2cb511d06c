// pheromonectl: the operator's command line. Most commands ask a running server, over its Unix
// socket; `map` and `config check` need none.
//
// Exit status: 0; 1 if the server, a robot or a file refused; 2 for a mistake in the command line
// or a configuration; 3 if there is no server; 4 for a damaged journal.
#include <exception>
#include <iostream>

#include <CLI/CLI.hpp>

#include "server/ctl/command_line.h"

namespace pheromone::ctl {
namespace {

int Main(int argc, char** argv) {
  CLI::App app("The operator's tool of the pheromone server.", "pheromonectl");
  app.set_version_flag("--version", "pheromonectl " PHEROMONE_VERSION);
  app.require_subcommand(1);
  app.fallthrough();  // --socket and --json may stand after a command
  int status = 0;
  ServerOptions options;
  app.add_option("--socket", options.socket,
                 "The server's Unix socket; without it, $PHEROMONE_SOCKET, pheromoned.sock here, "
                 "or /run/pheromone/pheromoned/pheromoned.sock")
      ->type_name("PATH");
  app.add_flag("--json", options.json, "Print the server's answer as it is");
  AddShowCommands(&app, &options, &status);
  AddChangeCommands(&app, &options, &status);
  AddCaptureCommands(&app, &options, &status);
  AddMapCommands(&app, &status);
  AddJournalCommands(&app, &status);
  AddReplayCommands(&app, &status);
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
  try {
    return pheromone::ctl::Main(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "pheromonectl: " << error.what() << '\n';
    return 1;
  }
}
