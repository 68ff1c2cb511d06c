#include "server/ctl/config_commands.h"

#include <iostream>

#include "server/config/config.h"
#include "server/config/describe.h"
#include "server/ctl/server_call.h"

namespace pheromone::ctl {

int CheckConfig(const std::string& path) {
  const Result<config::Config> loaded = config::LoadConfig(path);
  if (!loaded.ok()) {
    std::cerr << loaded.error() << '\n';
    return kUsage;
  }
  for (const std::string& warning : loaded.value().warnings) {
    std::cerr << "warning: " << warning << '\n';
  }
  std::cout << path << ": ok\n";
  for (const std::string& line : config::DescribeConfig(loaded.value())) {
    std::cout << "  " << line << '\n';
  }
  return 0;
}

}  // namespace pheromone::ctl
