// pheromonectl export, as it is declared to CLI11.
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "server/operators/ctl/command_line.h"
#include "server/operators/ctl/mcap_export.h"
#include "server/operators/ctl/number_check.h"

namespace pheromone::ctl {

void AddExportCommands(CLI::App* program, int* exit_status) {
  struct Arguments {
    std::vector<std::string> files;
    McapOptions options;
  };
  const auto it = std::make_shared<Arguments>();
  CLI::App* command = program->add_subcommand(
      "export", "Convert a recording of a server for Foxglove, Lichtblick and their libraries");
  command->add_option("FILE", it->files, "Recordings, in order")->required()->expected(1, -1);
  command->add_option("--mcap", it->options.out, "The MCAP file to write")
      ->required()
      ->type_name("FILE");
  command
      ->add_option("--grid-rate", it->options.grid_hz,
                   "Pictures of each pheromone in a second, of those that changed (default: 2)")
      ->check(Number(0.001, 10))
      ->type_name("HZ");
  command->callback([=] { *exit_status = ExportMcap(it->files, it->options); });
}

}  // namespace pheromone::ctl
