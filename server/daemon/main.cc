// pheromoned: the pheromone server.
//
// Exit status: 0 after an orderly stop, 1 if it could not run, 2 for a mistake in the command line
// or the configuration.
#include <spdlog/spdlog.h>

#include <exception>
#include <iostream>
#include <string>

#include <CLI/CLI.hpp>

#include "server/config/config.h"
#include "server/daemon/daemon.h"
#include "server/daemon/describe.h"
#include "server/daemon/logging.h"

namespace pheromone::daemon {
namespace {

constexpr int kUsage = 2;
constexpr const char* kDefaultName = "default configuration";

struct Options {
  std::string config_path;  // empty: the default configuration
  std::string log_level;    // empty: as configured
  bool check = false;
  bool print_default = false;
};

Result<config::Config> Load(const Options& options) {
  return options.config_path.empty()
             ? config::ParseConfig(config::DefaultConfigText(), kDefaultName)
             : config::LoadConfig(options.config_path);
}

int Run(const Options& options) {
  if (options.print_default) {
    std::cout << config::DefaultConfigText();
    return 0;
  }
  Result<config::Config> loaded = Load(options);
  if (!loaded.ok()) {
    std::cerr << loaded.error() << '\n';
    return kUsage;
  }
  config::Config& config = loaded.value();
  const std::string name = options.config_path.empty() ? kDefaultName : options.config_path;
  if (options.check) {
    for (const std::string& warning : config.warnings) {
      std::cerr << "warning: " << warning << '\n';
    }
    std::cout << name << ": ok\n";
    for (const std::string& line : DescribeConfig(config)) {
      std::cout << "  " << line << '\n';
    }
    return 0;
  }
  SetUpLogging(options.log_level.empty() ? config.daemon.log_level : options.log_level);
  spdlog::info("pheromoned {}, {}", PHEROMONE_VERSION, name);
  Daemon daemon(std::move(config), [&options] { return Load(options); });
  return daemon.Run();
}

int Main(int argc, char** argv) {
  Options options;
  CLI::App app("The pheromone server: virtual pheromone trails for robots.", "pheromoned");
  app.add_option("--config", options.config_path,
                 "The configuration file; without one, the default configuration")
      ->check([](const std::string& path) {
        return path.empty() ? std::string("is empty, expected a file") : std::string();
      })
      ->type_name("FILE");
  app.add_flag("--check", options.check, "Check the configuration, say what it means, and end");
  app.add_flag("--default-config", options.print_default,
               "Print the default configuration and end");
  app.add_option("--log-level", options.log_level, "Instead of the configured one")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "critical", "off"}))
      ->type_name("LEVEL");
  app.set_version_flag("--version", "pheromoned " PHEROMONE_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kUsage;
  }
  return Run(options);
}

}  // namespace
}  // namespace pheromone::daemon

int main(int argc, char** argv) {
  try {
    return pheromone::daemon::Main(argc, argv);
  } catch (const std::exception& error) {
    std::cerr << "pheromoned: " << error.what() << '\n';
    return 1;
  }
}
