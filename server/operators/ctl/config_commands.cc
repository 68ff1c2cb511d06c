#include "server/operators/ctl/config_commands.h"

#include <cstdlib>
#include <iostream>

#include "server/config/config.h"
#include "server/config/describe.h"
#include "server/operators/ctl/server_call.h"

namespace pheromone::ctl {

int CheckConfig(const std::string& path) {
  const Result<config::Config> loaded = config::LoadConfig(path);
  if (!loaded.ok()) {
    std::cerr << loaded.error() << '\n';
    return kUsage;
  }
  const config::CheckReport report =
      config::DescribeCheck(path, loaded.value(), std::getenv("STATE_DIRECTORY"));
  std::cerr << report.warnings << report.errors;
  std::cout << report.text;
  return report.errors.empty() ? 0 : kUsage;
}

}  // namespace pheromone::ctl
