#include "server/operators/ctl/modem_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "server/base/result.h"
#include "server/config/document.h"
#include "server/config/sections.h"

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

std::string LinkText(const std::string& port, unsigned baud, unsigned turnaround_ms,
                     unsigned adapter_ms) {
  return fmt::format(
      "[[link]]\nname = \"radio-a\"\nkind = \"serial\"\nport = \"{}\"\nbaud = {}\nturnaround_ms = "
      "{}\nadapter_latency_ms = {}\n",
      port, baud, turnaround_ms, adapter_ms);
}

std::string LinkProblems(const std::string& link) {
  const std::string name = "the link above";
  const Result<config::Value> root = config::ParseDocument(link, name);
  if (!root.ok()) {
    return root.error();
  }
  config::Notes notes{config::Problems(name), name, {}, {}, {}};
  config::Config config;
  config::ReadLinks(root.value(), &notes, &config);
  return notes.problems.Text();
}

}  // namespace pheromone::ctl
