#include <CLI/CLI.hpp>

#include "server/ctl/capture_commands.h"
#include "server/ctl/command_line.h"

namespace pheromone::ctl {

void AddCaptureCommands(CLI::App* program, const ServerOptions* options, int* exit_status) {
  CLI::App* capture =
      program->add_subcommand("capture", "Record all that passes: start, stop, status");
  capture->require_subcommand(1);
  capture->add_subcommand("start", "Begin a recording, for Wireshark and for replay")
      ->callback([=] { *exit_status = StartCapture(*options); });
  capture->add_subcommand("stop", "End it")->callback([=] {
    *exit_status = StopCapture(*options);
  });
  capture->add_subcommand("status", "Say whether there is one, and how it goes")->callback([=] {
    *exit_status = ShowCapture(*options);
  });
}

}  // namespace pheromone::ctl
