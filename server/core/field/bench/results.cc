#include "server/core/field/bench/results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace pheromone::field::bench {

std::string CaseKey::name() const {
  std::string name = group + "/" + variant;
  if (map.nodes != 0) {
    name += fmt::format("/N={}", map.nodes);
  }
  if (reach != 0) {
    name += fmt::format("/r={}", reach);
  }
  if (map.density_percent != 0) {
    name += fmt::format("/d={}%", map.density_percent);
  }
  if (map.pattern == Pattern::kTrails) {
    name += "/trails";
  }
  if (robots != 0) {
    name += fmt::format("/robots={}", robots);
  }
  return name;
}

Summary Summarise(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto quantile = [&](double share) {
    const double place = share * static_cast<double>(values.size() - 1);
    const auto below = static_cast<size_t>(place);
    const size_t above = std::min(below + 1, values.size() - 1);
    return std::lerp(values[below], values[above], place - static_cast<double>(below));
  };
  return {quantile(0.5), quantile(0.1), quantile(0.9)};
}

void Results::Add(const CaseKey& key, double ns) {
  const auto [found, is_new] = index_.emplace(key.name(), entries_.size());
  if (is_new) {
    entries_.push_back({key, {}});
  }
  entries_[found->second].ns.push_back(ns);
}

std::optional<Summary> Results::Find(const CaseKey& key) const {
  const auto found = index_.find(key.name());
  if (found == index_.end()) {
    return std::nullopt;
  }
  return Summarise(entries_[found->second].ns);
}

std::vector<Result> Results::All() const {
  std::vector<Result> all;
  for (const Entry& entry : entries_) {
    all.push_back({entry.key, Summarise(entry.ns), entry.ns.size()});
  }
  return all;
}

}  // namespace pheromone::field::bench
