#include "server/operators/ctl/modem_figures.h"

#include <algorithm>
#include <cmath>

namespace pheromone::ctl {

double DelayMs(const Chunk& chunk, unsigned baud) {
  return std::max(0.0, chunk.at_ms - static_cast<double>(chunk.bytes_read) * 10'000 / baud);
}

Delays DelaysOf(std::vector<double> delays_ms) {
  std::sort(delays_ms.begin(), delays_ms.end());
  const double late = delays_ms[(delays_ms.size() - 1) * 98 / 100];
  return {delays_ms.front(), late - delays_ms.front()};
}

double DamagedBytes(size_t whole, size_t sent, size_t bytes) {
  return 1 - std::pow(static_cast<double>(whole) / static_cast<double>(sent),
                      1 / static_cast<double>(bytes));
}

double UnnoticedDamage(size_t sent, size_t bytes) {
  return 1 - std::pow(0.05, 1 / static_cast<double>(sent * bytes));
}

unsigned RoundedUpMs(double ms) {
  return static_cast<unsigned>(std::ceil(ms - 1e-9));
}

}  // namespace pheromone::ctl
