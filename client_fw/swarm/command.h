// Functions shared by the commands of pheromone-swarm and pheromone-experiments. Each command is a
// file, NAME_command.cc or NAME/command.cc, and adds itself to the command line; main.cc has the
// list of them.
//
// Exit status of all: 0: success; else that of server/base/program.h.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "client_fw/core/steering/steering.h"
#include "server/base/program.h"

namespace pheromone::swarm {

using AddCommand = void (*)(CLI::App* app, int* status);

/// Runs the program of these commands: parses its command line, and returns its exit status.
int RunCommands(const std::string& program, const std::string& description,
                std::initializer_list<AddCommand> commands, int argc, char** argv);

/// Prints an error on standard error, after the program's name, and returns `status`.
int Fail(const std::string& message, int status);

/// On a terminal, shows on standard error how far a command is, in a line that is renewed; ""
/// clears it. Elsewhere nothing. For text that is known: it is not escaped.
void ShowProgress(const std::string& text);

/// Creates the folder if it does not exist, and writes each (name, content). Returns the exit
/// status: 0, or kFailed at the first file that cannot be written, which is reported.
int WriteFiles(const std::filesystem::path& folder,
               const std::vector<std::pair<std::string, std::string>>& contents);

/// The path of a terminal device, not an address: links of kind "tcp" and "udp" have none.
CLI::Validator TerminalDevice();

/// The steering laws of the firmware, by their names on the command line.
const std::map<std::string, client::Law>& LawsByName();

/// For CLI::Option::transform: lists these names instead of the numbers that CLI11 would list.
template <typename Enum>
CLI::Validator OneOf(const std::map<std::string, Enum>& names) {
  std::string list;
  for (const auto& [name, value] : names) {
    list += (list.empty() ? "" : ", ") + name;
  }
  return {[names, list](std::string& text) {
            const auto found = names.find(text);
            if (found == names.end()) {
              return "found \"" + text + "\", expected one of " + list;
            }
            text = std::to_string(static_cast<int>(found->second));
            return std::string();
          },
          ""};
}

}  // namespace pheromone::swarm
