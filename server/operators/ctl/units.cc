#include "server/operators/ctl/units.h"

#include <fmt/format.h>

#include <string_view>

namespace pheromone::ctl {

std::string Duration(double seconds) {
  if (seconds < 60) {
    return fmt::format("{:.1f} s", seconds);
  }
  if (seconds < 3600) {
    return fmt::format("{:.0f} min", seconds / 60);
  }
  return seconds < 86'400 ? fmt::format("{:.1f} h", seconds / 3600)
                          : fmt::format("{:.1f} d", seconds / 86'400);
}

std::string Size(double bytes) {
  for (const std::string_view unit : {"B", "KiB", "MiB"}) {
    if (bytes < 1024) {
      return fmt::format("{:.{}f} {}", bytes, unit == "B" ? 0 : 1, unit);
    }
    bytes /= 1024;
  }
  return fmt::format("{:.1f} GiB", bytes);
}

}  // namespace pheromone::ctl
