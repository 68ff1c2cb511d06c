// The resources used by the process, from /proc. Any thread; a figure that cannot be read is 0.
#pragma once

#include <cstdint>

namespace pheromone::daemon {

struct ProcessStats {
  uint64_t resident_bytes = 0;
  uint64_t open_descriptors = 0;
  double cpu_s = 0;
};

ProcessStats ReadProcessFigures();

}  // namespace pheromone::daemon
