// pheromonectl replay, as it is declared to CLI11.
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "server/base/number_check.h"
#include "server/operators/ctl/command_line.h"
#include "server/operators/ctl/replay_commands.h"

namespace pheromone::ctl {
namespace {

struct ReplayArguments {
  std::vector<std::string> files;
  bool answers = false;
  PlayOptions play;
};

}  // namespace

void AddReplayCommands(CLI::App* program, int* exit_status) {
  const auto it = std::make_shared<ReplayArguments>();
  CLI::App* replay =
      program->add_subcommand("replay", "Replay a recording of a server and compare every answer");
  replay->add_option("FILE", it->files, "Recordings, in order")->required()->expected(1, -1);
  CLI::Option* print =
      replay->add_flag("--answers", it->answers, "Print the engine's answers, one on each line");
  CLI::Option* to =
      replay
          ->add_option("--to", it->play.to,
                       "Send the recorded requests to a running server instead, through a "
                       "terminal device or a TCP link")
          ->excludes(print)
          ->type_name("PTY|HOST:PORT");
  replay->add_option("--link", it->play.link, "Only the traffic of this link")
      ->needs(to)
      ->type_name("NAME");
  replay
      ->add_option("--speed", it->play.speed,
                   "Factor of the recorded pace (default: 1; 0: no pauses)")
      ->needs(to)
      ->check(Number(0, 1e6))
      ->type_name("X");
  replay->callback([=] {
    if (it->play.to.empty()) {
      *exit_status = ReplayFiles(it->files, it->answers);
      return;
    }
    for (const std::string& file : it->files) {
      *exit_status = *exit_status == 0 ? PlayFile(file, it->play) : *exit_status;
    }
  });
}

}  // namespace pheromone::ctl
