#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "server/base/number_check.h"
#include "server/operators/ctl/command_line.h"
#include "server/operators/ctl/nets/live_net_commands.h"
#include "server/operators/ctl/nets/net_commands.h"
#include "server/operators/ctl/nets/net_replay.h"

namespace pheromone::ctl {
namespace {

void AddNet(CLI::App* command, NetSource* source) {
  command->add_option("FILE", source->path, "A net: .toml, .pnml or .xml")->required();
  command->add_option("--set", source->parameters, "Give a parameter of the file another value")
      ->allow_extra_args(false)
      ->type_name("NAME=NUMBER");
}

void AddCheck(CLI::App* command, NetCheck* check) {
  AddNet(command, &check->source);
  command
      ->add_option("--claim", check->claims,
                   "Check this, too, such as \"never red = 1 and green = 1\"")
      ->allow_extra_args(false)
      ->type_name("TEXT");
  command->add_flag("--no-claims", check->no_claims, "Without the claims of the file");
  command->add_flag("--reduce", check->reduce,
                    "Leave out orders of transitions that make no difference");
  command->add_flag("--quick", check->quick, "Without liveness and reversibility");
  command
      ->add_option("--memory", check->memory_gib, "End as unknown beyond this memory (default: 4)")
      ->check(Number(0.001, 1'000'000))
      ->type_name("GIB");
  command->add_option("--states", check->max_states, "End as unknown beyond this number of states")
      ->check(WholeNumber(1, 4'000'000'000))
      ->type_name("N");
}

struct DrawArguments {
  NetCheck check;
  std::string trace;
  std::string output;
};

struct TablesArguments {
  NetSource source;
  std::string output;
};

struct LiveArguments {
  std::string net;
  std::string folder;
  std::string output;
};

// Of the nets that a server executes.
void AddLive(CLI::App* net, const ServerOptions* options, int* exit_status) {
  const auto it = std::make_shared<LiveArguments>();
  CLI::App* list = net->add_subcommand("list", "List the nets that the server executes");
  list->callback([=] { *exit_status = ListNets(*options); });
  CLI::App* show = net->add_subcommand("show", "Show one of them: trails, tags, exceptions");
  show->add_option("NAME", it->net, "Name of the net")->required();
  show->callback([=] { *exit_status = ShowNet(*options, it->net); });
  CLI::App* reset = net->add_subcommand("reset", "Begin one of them anew: all robots at the start");
  reset->add_option("NAME", it->net, "Name of the net")->required();
  reset->callback([=] { *exit_status = ResetNet(*options, it->net); });
  CLI::App* replay =
      net->add_subcommand("replay", "Print what nets have fired, from a server's journal");
  replay->add_option("FOLDER", it->folder, "A journal")->required();
  replay->add_option("--net", it->net, "Only this net")->type_name("NAME");
  replay->add_option("--output", it->output, "Into this file (default: standard output)")
      ->type_name("FILE");
  replay->callback([=] { *exit_status = ReplayNets(it->folder, it->net, it->output); });
}

}  // namespace

void AddNetCommands(CLI::App* program, const ServerOptions* options, int* exit_status) {
  CLI::App* net =
      program->add_subcommand("net", "Petri nets: in files, and executed by the server");
  net->require_subcommand(1);

  AddLive(net, options, exit_status);

  const auto it = std::make_shared<NetCheck>();
  CLI::App* check = net->add_subcommand("check", "Find out what is true of a net");
  AddCheck(check, it.get());
  check->callback([=] {
    it->json = options->json;
    *exit_status = CheckNetFile(*it);
  });

  const auto drawn = std::make_shared<DrawArguments>();
  CLI::App* draw = net->add_subcommand("draw", "Draw a net, or a trace of it, for Graphviz");
  AddCheck(draw, &drawn->check);
  draw->add_option("--trace", drawn->trace,
                   "Instead of the net: the trace that check prints for this name")
      ->type_name("NAME");
  draw->add_option("--output", drawn->output, "Into this file (default: standard output)")
      ->type_name("FILE");
  draw->callback([=] { *exit_status = DrawNet(drawn->check, drawn->trace, drawn->output); });

  const auto to = std::make_shared<NetExport>();
  CLI::App* exporting = net->add_subcommand("export", "Write a net for other tools");
  AddNet(exporting, &to->source);
  exporting->add_option("--format", to->format, "pnml, promela (Spin) or 4ti2 (P-semiflows)")
      ->required()
      ->check(CLI::IsMember({"pnml", "promela", "4ti2"}))
      ->type_name("FORMAT");
  exporting->add_flag("--core", to->core,
                      "Without read and inhibitor arcs: with complement places instead");
  exporting->add_option("--output", to->output, "Into this file (default: standard output)")
      ->type_name("FILE");
  exporting->callback([=] { *exit_status = ExportNet(*to); });

  const auto tables = std::make_shared<TablesArguments>();
  CLI::App* robot = net->add_subcommand("tables", "Write a robot's net for its firmware, in C++");
  AddNet(robot, &tables->source);
  robot->add_option("--output", tables->output, "Into this header (default: standard output)")
      ->type_name("FILE");
  robot->callback([=] { *exit_status = WriteRobotTables(tables->source, tables->output); });
}

}  // namespace pheromone::ctl
