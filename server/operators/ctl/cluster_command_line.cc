#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "server/operators/ctl/cluster_journal.h"
#include "server/operators/ctl/command_line.h"

namespace pheromone::ctl {
namespace {

struct ClusterArguments {
  std::string folder;
  std::string name;
  bool new_epoch = false;
  bool yes = false;
};

}  // namespace

void AddClusterCommands(CLI::App* program, int* exit_status) {
  const auto arguments = std::make_shared<ClusterArguments>();
  CLI::App* cluster =
      program->add_subcommand("cluster", "Several servers with one map: leave, reset");
  cluster->require_subcommand(1);
  CLI::App* leave = cluster->add_subcommand(
      "leave", "Let the stopped server of a journal go on alone, without its cluster");
  leave->add_option("FOLDER", arguments->folder, "Its journal")->required();
  leave
      ->add_flag("--new-epoch", arguments->new_epoch,
                 "An epoch begins: the others may have gone on")
      ->required();
  leave->callback([=] { *exit_status = LeaveCluster(arguments->folder); });
  CLI::App* reset =
      cluster->add_subcommand("reset", "Begin a cluster anew with the journal of a stopped server");
  reset->add_option("FOLDER", arguments->folder, "Its journal")->required();
  reset->add_option("--name", arguments->name, "The cluster, as configured")
      ->required()
      ->type_name("NAME");
  reset->add_flag("--yes", arguments->yes, "Do it: what other machines have beyond it is lost");
  reset->callback(
      [=] { *exit_status = ResetCluster(arguments->folder, arguments->name, arguments->yes); });
}

}  // namespace pheromone::ctl
