// pheromonectl modem, as it is declared to CLI11.
#include <memory>

#include <CLI/CLI.hpp>

#include "server/base/number_check.h"
#include "server/operators/ctl/command_line.h"
#include "server/operators/ctl/modem_commands.h"

namespace pheromone::ctl {

void AddModemCommands(CLI::App* program, int* exit_status) {
  const auto it = std::make_shared<ModemTestOptions>();
  CLI::App* modem = program->add_subcommand("modem", "Try radio modems before a server uses them");
  modem->require_subcommand(1);
  CLI::App* test = modem->add_subcommand(
      "test", "Send frames between two ports, each with a modem, and print settings that fit");
  test->add_option("PORT1", it->ports[0], "The serial port that is to be the server's")->required();
  test->add_option("PORT2", it->ports[1], "One with a modem as robots have it")->required();
  test->add_option("--baud", it->baud, "Bit rate of both ports (default: 9600)")
      ->check(WholeNumber(50, 1'000'000))
      ->type_name("N");
  test->add_option("--frames", it->frames, "Frames without a pause, each way (default: 100)")
      ->check(WholeNumber(10, 100'000))
      ->type_name("N");
  test->callback([=] { *exit_status = TestModems(*it); });
}

}  // namespace pheromone::ctl
