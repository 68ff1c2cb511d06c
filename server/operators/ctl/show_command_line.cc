#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "server/base/number_check.h"
#include "server/operators/ctl/command_line.h"
#include "server/operators/ctl/config_commands.h"
#include "server/operators/ctl/doctor/doctor.h"
#include "server/operators/ctl/show_commands.h"
#include "server/operators/ctl/watch.h"

namespace pheromone::ctl {
namespace {

struct ShowArguments {
  bool with_hash = false;
  std::string link;
  std::string pheromone;
  double x_m = 0;
  double y_m = 0;
  double heading_deg = 0;
  std::string file;
  WatchOptions watch;
};

void AddConfigCommands(CLI::App* program, const ServerOptions* options,
                       const std::shared_ptr<ShowArguments>& it, int* exit_status) {
  CLI::App* config = program->add_subcommand("config", "Configurations: check, show");
  config->require_subcommand(1);
  CLI::App* check =
      config->add_subcommand("check", "Print the errors or the meaning of a configuration file");
  check->add_option("FILE", it->file)->required();
  check->callback([=] { *exit_status = CheckConfig(it->file); });
  CLI::App* show = config->add_subcommand("show", "Show the server's configuration in words");
  show->callback([=] { *exit_status = ShowConfig(*options); });
}

void AddWatch(CLI::App* program, const ServerOptions* options,
              const std::shared_ptr<ShowArguments>& it, int* exit_status) {
  CLI::App* watch = program->add_subcommand("watch", "Show the map and the robots live; q quits");
  watch->add_option("PHEROMONE", it->watch.pheromone, "Type number or name (default: the first)")
      ->type_name("N|NAME");
  watch->add_flag("--once", it->watch.once, "Print one picture and exit");
  watch->add_option("--columns", it->watch.columns, "Width (default: the terminal's)")
      ->check(WholeNumber(20, 1000))
      ->type_name("N");
  watch->add_option("--rows", it->watch.rows, "Height (default: the terminal's)")
      ->check(WholeNumber(5, 1000))
      ->type_name("N");
  watch
      ->add_option("--colours", it->watch.colours,
                   "none, 256 or 24bit (default: what the terminal supports)")
      ->check(CLI::IsMember({"none", "256", "24bit"}))
      ->type_name("KIND");
  watch->callback([=] { *exit_status = Watch(*options, it->watch); });
}

}  // namespace

void AddShowCommands(CLI::App* program, const ServerOptions* options, int* exit_status) {
  const auto it = std::make_shared<ShowArguments>();
  CLI::App* status = program->add_subcommand("status", "Show a summary of the server");
  status->add_flag("--hash", it->with_hash, "Also show the hash of the complete state");
  status->callback([=] { *exit_status = ShowStatus(*options, it->with_hash); });

  CLI::App* links = program->add_subcommand("links", "Show the links and their losses");
  links->callback([=] { *exit_status = ShowLinks(*options); });

  CLI::App* clients = program->add_subcommand("clients", "Show the robots");
  clients->add_option("--link", it->link, "Only the robots on this link")->type_name("NAME");
  clients->callback([=] { *exit_status = ShowClients(*options, it->link); });

  CLI::App* laws = program->add_subcommand("laws", "Show the pheromones");
  laws->callback([=] { *exit_status = ShowLaws(*options); });

  const CLI::Validator coordinate = Number(-kFarthestM, kFarthestM);
  CLI::App* sense = program->add_subcommand("sense", "Show what a robot would sense at a position");
  sense->add_option("PHEROMONE", it->pheromone, "Type number or name of the pheromone")->required();
  sense->add_option("X", it->x_m, "X in metres")->required()->check(coordinate);
  sense->add_option("Y", it->y_m, "Y in metres")->required()->check(coordinate);
  sense->add_option("HEADING", it->heading_deg, "In degrees, counter-clockwise from +x")
      ->check(Number(-360, 360));
  sense->callback(
      [=] { *exit_status = Sense(*options, it->pheromone, it->x_m, it->y_m, it->heading_deg); });

  CLI::App* doctor = program->add_subcommand(
      "doctor", "Look at configuration, ports, links and robots, and say what mends them");
  doctor
      ->add_option("--config", it->file,
                   "The configuration (default: that of the running server, or of the service)")
      ->type_name("FILE");
  doctor->callback([=] { *exit_status = Examine(*options, it->file); });

  AddWatch(program, options, it, exit_status);
  AddConfigCommands(program, options, it, exit_status);

  CLI::App* version =
      program->add_subcommand("version", "Show the versions of this program and of the server");
  version->callback([=] { *exit_status = ShowVersion(*options); });
}

}  // namespace pheromone::ctl
