#include "client_fw/swarm/command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <system_error>

#include "client_fw/swarm/robots.h"
#include "server/base/command_line.h"
#include "server/base/file.h"
#include "server/base/standard_output.h"

namespace pheromone::swarm {
namespace {

std::string program_name;  // set once, before any command runs

}  // namespace

int RunCommands(const std::string& program, const std::string& description,
                std::initializer_list<AddCommand> commands, int argc, char** argv) {
  program_name = program;
  return RunProgram(program, [&] {
    CLI::App app(description, program);
    Standardise(&app);
    app.require_subcommand(1);
    const std::string licence =
        HasAvrRobots()
            ? "With AVR robots, by libsimavr: this program as a whole is under the GNU "
              "General Public License, version 3 or later; its own sources are Apache-2.0."
            : "Without AVR robots; Apache-2.0.";
    app.set_version_flag("--version", program + " " PHEROMONE_VERSION "\n" + licence);
    int status = 0;
    for (const AddCommand& add : commands) {
      add(&app, &status);
    }
    try {
      app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
      return app.exit(error) == 0 ? 0 : kWrongInput;
    }
    return status;
  });
}

int Fail(const std::string& message, int status) {
  return pheromone::Fail(program_name, message, status);
}

void ShowProgress(const std::string& text) {
  if (isatty(STDERR_FILENO) != 0) {
    fmt::print(Unescaped(stderr), "\r{}\x1b[K", text);
  }
}

int WriteFiles(const std::filesystem::path& folder,
               const std::vector<std::pair<std::string, std::string>>& contents) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return Fail(folder.string() + ": " + error.message(), kFailed);
  }
  for (const auto& [name, content] : contents) {
    const Status written = WriteFile((folder / name).string(), content);
    if (!written.ok()) {
      return Fail(written.error(), kFailed);
    }
  }
  return 0;
}

CLI::Validator TerminalDevice() {
  return {[](const std::string& text) {
            const bool is_address = text.find("://") != std::string::npos ||
                                    text.starts_with("udp:") || text.starts_with("tcp:");
            return is_address ? fmt::format(
                                    "found \"{}\", expected the path of a terminal device, such as "
                                    "radio-a.pty: simulated robots use links of kind \"pty\" and "
                                    "\"serial\" only",
                                    text)
                              : std::string();
          },
          ""};
}

const std::map<std::string, client::Law>& LawsByName() {
  static const std::map<std::string, client::Law> laws = {
      {"careful", client::Law::kCareful},
      {"differential", client::Law::kDifferential},
      {"paper", client::Law::kPaper}};
  return laws;
}

}  // namespace pheromone::swarm
