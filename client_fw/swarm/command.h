// What the commands of pheromone-swarm share. Each command is a pair of files, NAME_command.h and
// .cc, and adds itself to the command line; main.cc has the list of them.
//
// Exit status of all: 0 done; kFailed: it could not be done; kWrongInput: the command line or a
// file is wrong.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "client_fw/core/steering.h"

namespace pheromone::swarm {

constexpr int kFailed = 1;
constexpr int kWrongInput = 2;

/// Says on standard error what is wrong, and returns `status`.
int Fail(const std::string& message, int status);

/// Makes the folder if it is not there, and writes (name, content) each. Returns the exit status:
/// 0, or kFailed at the first that cannot be written, which is then told.
int WriteFiles(const std::filesystem::path& folder,
               const std::vector<std::pair<std::string, std::string>>& contents);

/// Numbers from `least` to `most`; unlike CLI::Range it does not let "nan" through.
CLI::Validator Between(double least, double most);

/// The steering laws that the firmware has, by the names they have on the command line.
const std::map<std::string, client::Law>& LawsByName();

/// For CLI::Option::transform: one of these names, in place of what CLI11 tells of the numbers
/// behind them.
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
