#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "server/operators/ctl/cluster_commands.h"
#include "server/operators/ctl/command_line.h"

namespace pheromone::ctl {

void AddClusterCommands(CLI::App* program, const ServerOptions* options, int* exit_status) {
  CLI::App* cluster =
      program->add_subcommand("cluster", "Several servers with one map: status, step-down");
  cluster->require_subcommand(1);
  cluster->add_subcommand("status", "Show who leads, and which servers are connected")
      ->callback([=] { *exit_status = ShowCluster(*options); });
  const auto successor = std::make_shared<std::string>();
  CLI::App* step_down =
      cluster->add_subcommand("step-down", "Let another server order the changes");
  step_down->add_option("--to", *successor, "The node that shall lead (default: any)")
      ->type_name("NODE");
  step_down->callback([=] { *exit_status = StepDown(*options, *successor); });
}

}  // namespace pheromone::ctl
