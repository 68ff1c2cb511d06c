#include <CLI/CLI.hpp>

#include "server/operators/ctl/capture_commands.h"
#include "server/operators/ctl/command_line.h"

namespace pheromone::ctl {

void AddCaptureCommands(CLI::App* program, const ServerOptions* options, int* exit_status) {
  CLI::App* capture =
      program->add_subcommand("capture", "Record the traffic of all links: start, stop, status");
  capture->require_subcommand(1);
  capture->add_subcommand("start", "Start a recording, for replay and for Wireshark")
      ->callback([=] { *exit_status = StartCapture(*options); });
  capture->add_subcommand("stop", "Stop the recording")->callback([=] {
    *exit_status = StopCapture(*options);
  });
  capture->add_subcommand("status", "Show whether a recording is in progress, and its size")
      ->callback([=] { *exit_status = ShowCapture(*options); });
}

}  // namespace pheromone::ctl
