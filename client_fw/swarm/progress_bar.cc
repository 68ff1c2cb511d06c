#include "client_fw/swarm/progress_bar.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <string>

#include "server/base/standard_output.h"

namespace pheromone::swarm {

std::function<void(int64_t)> ProgressBar(int64_t duration_ms) {
  if (isatty(STDERR_FILENO) == 0) {
    return {};
  }
  return [duration_ms, shown = int64_t{-1}](int64_t ms) mutable {
    const int64_t percent =
        std::min<int64_t>(100, ms * 100 / duration_ms);  // a last step ends later
    if (percent != shown) {
      shown = percent;
      fmt::print(Unescaped(stderr), "\r[{:<40}] {:3} %",
                 std::string(static_cast<size_t>(percent * 2 / 5), '#'), percent);
    }
  };
}

void EndProgressBar(const std::function<void(int64_t)>& bar) {
  if (bar) {
    fmt::print(Unescaped(stderr), "\r{:60}\r", "");
  }
}

}  // namespace pheromone::swarm
