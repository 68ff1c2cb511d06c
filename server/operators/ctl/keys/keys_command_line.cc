// pheromonectl keys, as it is declared to CLI11.
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "server/base/number_check.h"
#include "server/operators/ctl/command_line.h"
#include "server/operators/ctl/keys/keys_commands.h"
#include "server/operators/ctl/server_call.h"
#include "server/robots/signing/keys_file.h"

namespace pheromone::ctl {
namespace {

CLI::Option* AddFile(CLI::App* command, std::string* file) {
  return command
      ->add_option("--file", *file, "The file with the robots' keys, as [[link]] names it")
      ->type_name("FILE");
}

void AddIds(CLI::App* command, KeysOptions* options) {
  command->add_option("ID", options->ids, "Robot IDs")
      ->required()
      ->check(WholeNumber(1, signing::kMaxRobot));
}

void AddExport(CLI::App* keys, int* exit_status) {
  const auto it = std::make_shared<KeyExport>();
  CLI::App* command = keys->add_subcommand("export", "Write a robot's key as the robot needs it");
  command->add_option("ID", it->id, "Robot ID")
      ->required()
      ->check(WholeNumber(1, signing::kMaxRobot));
  AddFile(command, &it->file)->required();
  command->add_option("--robot", it->robot, "32 hexadecimal digits, for pheromone-robot --key")
      ->type_name("FILE");
  command->add_option("--eeprom", it->eeprom, "Intel HEX, with which avrdude writes the EEPROM")
      ->type_name("FILE");
  command->add_option("--header", it->header, "A C header, for a sketch")->type_name("FILE");
  command->callback([=] {
    *exit_status = it->robot.empty() && it->eeprom.empty() && it->header.empty()
                       ? Fail(kUsage, "expected at least one of --robot, --eeprom and --header")
                       : ExportKey(*it);
  });
}

}  // namespace

void AddKeysCommands(CLI::App* program, const ServerOptions* options, int* exit_status) {
  CLI::App* keys = program->add_subcommand(
      "keys", "The robots' keys of signed links: new, list, revoke, export");
  keys->require_subcommand(1);
  const auto it = std::make_shared<KeysOptions>();

  CLI::App* make = keys->add_subcommand("new", "Make random keys, and the file if there is none");
  AddIds(make, it.get());
  AddFile(make, &it->file)->required();
  make->callback([=] { *exit_status = MakeKeys(*it); });

  CLI::App* list = keys->add_subcommand("list", "Show which robots have keys, and the comments");
  AddFile(list, &it->file)->required();
  list->callback([=] { *exit_status = ListKeys(it->file); });

  CLI::App* revoke = keys->add_subcommand(
      "revoke",
      "Revoke keys at the server, or remove them from a file: their robots are not heard");
  AddIds(revoke, it.get());
  AddFile(revoke, &it->file);
  revoke->callback([=] {
    *exit_status = it->file.empty() ? RevokeKeysAtServer(*options, it->ids) : RevokeKeysInFile(*it);
  });

  AddExport(keys, exit_status);
}

}  // namespace pheromone::ctl
