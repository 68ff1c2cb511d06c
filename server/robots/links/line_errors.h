// The error counters of a serial line's driver.
#pragma once

#include <cstdint>

namespace pheromone::links {

/// Errors on the line since it was opened, counted by the driver.
struct LineErrors {
  uint64_t framing = 0;
  uint64_t parity = 0;
  uint64_t overruns = 0;         ///< the UART was not read in time
  uint64_t buffer_overruns = 0;  ///< the kernel's buffer was full
  uint64_t breaks = 0;

  bool operator==(const LineErrors&) const = default;
};

}  // namespace pheromone::links
