// pheromone-swarm: simulated robots and swarms. Each command is in NAME_command.cc.
//
// Exit status: 0 done; 1 the command failed; 2 the command line or a file is wrong.
#include "client_fw/swarm/command.h"
#include "client_fw/swarm/commands.h"

int main(int argc, char** argv) {
  using namespace pheromone::swarm;  // NOLINT(google-build-using-namespace)
  return RunCommands(
      "pheromone-swarm", "Simulated robots that follow virtual pheromones.",
      {AddPathCommand, AddRunCommand, AddLiveCommand, AddPioneerCommand, AddLabCommand}, argc,
      argv);
}
