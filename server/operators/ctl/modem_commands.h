// pheromonectl modem test: sends known frames from one port to another, each with a radio modem on
// it, and prints what that says about modems and adapters, and the settings of a link that fit.
#pragma once

#include <array>
#include <string>

namespace pheromone::ctl {

struct ModemTestOptions {
  std::array<std::string, 2> ports{};
  unsigned baud = 9600;
  size_t frames = 100;  ///< without a pause, each way
};

/// Returns the exit status; errors are reported on standard error. Both ports are opened as a
/// server opens them, exclusively.
int TestModems(const ModemTestOptions& options);

}  // namespace pheromone::ctl
