// pheromone-experiments: the experiments of the papers. Each command is in NAME/command.cc.
//
// Exit status: 0 done; 1 the experiment could not be run, or its result is wrong; 2 the command
// line or a file is wrong.
#include "client_fw/experiments/commands.h"
#include "client_fw/swarm/command.h"

int main(int argc, char** argv) {
  using namespace pheromone::swarm;  // NOLINT(google-build-using-namespace)
  return RunCommands(
      "pheromone-experiments",
      "Experiments with simulated robots that follow virtual pheromones, in virtual time.",
      {AddDetourCommand, AddLawsCommand, AddSweepCommand, AddTrailsCommand, AddChannelCommand,
       AddBridgeCommand, AddCleaningCommand},
      argc, argv);
}
