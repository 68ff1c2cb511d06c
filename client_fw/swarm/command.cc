#include "client_fw/swarm/command.h"

#include <fmt/format.h>

#include <cstdio>
#include <fstream>
#include <system_error>

namespace pheromone::swarm {

int Fail(const std::string& message, int status) {
  fmt::print(stderr, "pheromone-swarm: {}\n", message);
  return status;
}

int WriteFiles(const std::filesystem::path& folder,
               const std::vector<std::pair<std::string, std::string>>& contents) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return Fail(folder.string() + ": " + error.message(), kFailed);
  }
  for (const auto& [name, content] : contents) {
    std::ofstream file(folder / name, std::ios::binary);
    file << content;
    file.close();
    if (!file) {
      return Fail((folder / name).string() + ": cannot be written", kFailed);
    }
  }
  return 0;
}

CLI::Validator Between(double least, double most) {
  return {[=](std::string& text) {
            double value = 0;
            const bool good =
                CLI::detail::lexical_cast(text, value) && value >= least && value <= most;
            return good ? std::string()
                        : fmt::format("{} is not a number from {} to {}", text, least, most);
          },
          fmt::format("{} to {}", least, most)};
}

const std::map<std::string, client::Law>& LawsByName() {
  static const std::map<std::string, client::Law> laws = {
      {"careful", client::Law::kCareful},
      {"differential", client::Law::kDifferential},
      {"paper", client::Law::kPaper}};
  return laws;
}

}  // namespace pheromone::swarm
