#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "server/operators/ctl/cluster/cluster_check.h"
#include "server/operators/ctl/cluster/cluster_journal.h"
#include "server/operators/ctl/cluster/cluster_setup.h"
#include "server/operators/ctl/cluster_commands.h"
#include "server/operators/ctl/command_line.h"

namespace pheromone::ctl {
namespace {

void AddSetup(CLI::App* cluster, int* exit_status) {
  const auto it = std::make_shared<ClusterSetup>();
  CLI::App* setup = cluster->add_subcommand(
      "setup", "Write what each machine of a new cluster needs, with instructions");
  setup
      ->add_option("machines", it->machines,
                   "The machines: 3, 5, 7 or 9. One that is named witness has no server")
      ->type_name("NAME=ADDRESS")
      ->required();
  setup->add_option("--name", it->name, "Of the cluster (default: lab)")->type_name("NAME");
  setup->add_option("--witness", it->witnesses, "Another machine without a server")
      ->type_name("NAME")
      ->allow_extra_args(false);
  setup->add_option("--output", it->output, "The folder to be made (default: cluster-NAME)")
      ->type_name("FOLDER");
  setup->add_flag("--force", it->overwrite, "Overwrite what is there, with a new secret");
  setup->callback([=] { *exit_status = SetUpCluster(*it); });
}

void AddLeaveAndReset(CLI::App* cluster, int* exit_status) {
  const auto folder = std::make_shared<std::string>();
  const auto name = std::make_shared<std::string>();
  const auto yes = std::make_shared<bool>(false);
  CLI::App* leave = cluster->add_subcommand(
      "leave", "Let the stopped server of a journal go on alone, without its cluster");
  leave->add_option("folder", *folder, "Its journal")->required()->type_name("FOLDER");
  leave->add_flag("--new-epoch", *yes, "An epoch begins: the others may have gone on")->required();
  leave->callback([=] { *exit_status = LeaveCluster(*folder); });
  CLI::App* reset =
      cluster->add_subcommand("reset", "Begin a cluster anew with the journal of a stopped server");
  reset->add_option("folder", *folder, "Its journal")->required()->type_name("FOLDER");
  reset->add_option("--name", *name, "The cluster, as configured")->required()->type_name("NAME");
  reset->add_flag("--yes", *yes, "Do it: what other machines have beyond it is lost");
  reset->callback([=] { *exit_status = ResetCluster(*folder, *name, *yes); });
}

}  // namespace

void AddClusterCommands(CLI::App* program, const ServerOptions* options, int* exit_status) {
  CLI::App* cluster = program->add_subcommand(
      "cluster", "Several servers with one map: setup, check, status, step-down, leave, reset");
  cluster->require_subcommand(1);
  AddSetup(cluster, exit_status);
  const auto config = std::make_shared<std::string>();
  CLI::App* check = cluster->add_subcommand(
      "check", "Look at servers and members of etcd, and say what mends them");
  check->add_option("--config", *config, "The configuration (default: that of the running server)")
      ->type_name("FILE");
  check->callback([=] { *exit_status = CheckCluster(*options, *config); });
  cluster->add_subcommand("status", "Show who leads, and which servers are connected")
      ->callback([=] { *exit_status = ShowCluster(*options); });
  const auto successor = std::make_shared<std::string>();
  CLI::App* step_down =
      cluster->add_subcommand("step-down", "Let another server order the changes");
  step_down->add_option("--to", *successor, "The node that shall lead (default: any)")
      ->type_name("NODE");
  step_down->callback([=] { *exit_status = StepDown(*options, *successor); });
  AddLeaveAndReset(cluster, exit_status);
}

}  // namespace pheromone::ctl
