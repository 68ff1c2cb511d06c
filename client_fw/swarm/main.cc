// pheromone-swarm: experiments with simulated robots. Each command is in NAME_command.cc.
//
// Exit status: 0 done; 1 the experiment could not be run; 2 the command line or a file is wrong.
#include <string>

#include <CLI/CLI.hpp>

#include "client_fw/swarm/bridge_command.h"
#include "client_fw/swarm/channel_command.h"
#include "client_fw/swarm/cleaning_command.h"
#include "client_fw/swarm/command.h"
#include "client_fw/swarm/detour_command.h"
#include "client_fw/swarm/laws_command.h"
#include "client_fw/swarm/live_command.h"
#include "client_fw/swarm/path_command.h"
#include "client_fw/swarm/pioneer_command.h"
#include "client_fw/swarm/robots.h"
#include "client_fw/swarm/run_command.h"
#include "client_fw/swarm/sweep_command.h"
#include "client_fw/swarm/trails_command.h"
#include "server/base/program.h"

namespace pheromone::swarm {
namespace {

int Main(int argc, char** argv) {
  CLI::App app{"Experiments with simulated robots that follow virtual pheromones."};
  app.require_subcommand(1);
  const std::string licence =
      HasAvrRobots() ? "With AVR robots, by libsimavr: this program as a whole is under the GNU "
                       "General Public License, version 3 or later; its own sources are Apache-2.0."
                     : "Without AVR robots; Apache-2.0.";
  app.set_version_flag("--version", "pheromone-swarm " PHEROMONE_VERSION "\n" + licence);
  app.footer(licence);
  int status = 0;
  AddPathCommand(&app, &status);
  AddDetourCommand(&app, &status);
  AddLawsCommand(&app, &status);
  AddSweepCommand(&app, &status);
  AddTrailsCommand(&app, &status);
  AddChannelCommand(&app, &status);
  AddBridgeCommand(&app, &status);
  AddCleaningCommand(&app, &status);
  AddRunCommand(&app, &status);
  AddLiveCommand(&app, &status);
  AddPioneerCommand(&app, &status);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kWrongInput;
  }
  return status;
}

}  // namespace
}  // namespace pheromone::swarm

int main(int argc, char** argv) {
  return pheromone::RunProgram("pheromone-swarm",
                               [&] { return pheromone::swarm::Main(argc, argv); });
}
