#include "server/core/field/bench/tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "server/core/field/bench/baselines.h"
#include "server/core/field/bench/cases.h"

namespace pheromone::field::bench {
namespace {

template <typename... Args>
void Add(std::string* text, fmt::format_string<Args...> format, Args&&... args) {
  fmt::format_to(std::back_inserter(*text), format, std::forward<Args>(args)...);
}

std::string Times(const Summary& ns) {
  return fmt::format("{:>8}  {:>8} - {:<8}", Duration(ns.median), Duration(ns.p10),
                     Duration(ns.p90));
}

// A ratio with the digits that mean something: 7.6, 76, 7600.
std::string Ratio(double ratio) {
  if (ratio < 100) {
    return fmt::format("{:.{}f}", ratio, ratio < 10 ? 1 : 0);
  }
  const double unit = std::pow(10.0, std::floor(std::log10(ratio)) - 1);
  return fmt::format("{:.0f}", std::round(ratio / unit) * unit);
}

// What another variant took in the case `key`, and how many times the field's time that is.
std::string Against(const Results& results, CaseKey key, const char* variant, double field_ns) {
  key.variant = variant;
  const auto other = results.Find(key);
  if (!other) {
    return fmt::format("{:>18}", "-");
  }
  return fmt::format("{:>9} {:>7}x", Duration(other->median), Ratio(other->median / field_ns));
}

std::string Density(const MapSpec& map) {
  if (map.density_percent == 0) {
    return "own";
  }
  return fmt::format("{}%{}", map.density_percent,
                     map.pattern == Pattern::kTrails ? " trails" : "");
}

std::vector<Result> FieldResults(const Results& results, const std::string& group) {
  std::vector<Result> rows = results.All();
  std::erase_if(
      rows, [&](const Result& row) { return row.key.group != group || row.key.variant != kField; });
  return rows;
}

// How much more the dearest of the maps of one density and reach costs than the cheapest.
void AddFlatness(const Results& results, std::string* text) {
  for (const double density_percent : {1, 10}) {
    double low = 0;
    double high = 0;
    for (const int32_t nodes : {100, 1000, 4000}) {
      const auto ns = results.Find(
          {kQuery, kField, {.nodes = nodes, .density_percent = density_percent}, kStandardReach});
      if (!ns) {
        return;
      }
      low = low == 0 ? ns->median : std::min(low, ns->median);
      high = std::max(high, ns->median);
    }
    Add(text, "from N = 100 to N = 4000 at r = {}, {}%: within a factor of {:.2f}\n",
        kStandardReach, density_percent, high / low);
  }
}

void AddQueries(const Results& results, std::string* text) {
  const std::vector<Result> rows = FieldResults(results, kQuery);
  if (rows.empty()) {
    return;
  }
  Add(text, "\nOne answer for both antennas, from another random place each time\n");
  Add(text, "{:>5} {:>3} {:>10}  {:>8}  {:^19} {:>18} {:>18} {:>18}  {}\n", "N", "r", "density",
      "field", "p10 - p90", kLiteralScan, kWideScan, "same, skipping", kMemoryBound);
  for (const auto& [key, ns, repetitions] : rows) {
    Add(text, "{:>5} {:>3} {:>10}  {} {} {} {}", key.map.nodes, key.reach, Density(key.map),
        Times(ns), Against(results, key, kLiteralScan, ns.median),
        Against(results, key, kWideScan, ns.median),
        Against(results, key, kSkippingScan, ns.median));
    const auto bound = results.Find({kQuery, kMemoryBound, {.nodes = key.map.nodes}, key.reach});
    if (bound) {
      Add(text, "  {} x {}", Duration(bound->median), Ratio(ns.median / bound->median));
    }
    *text += '\n';
  }
  AddFlatness(results, text);
}

void AddOptions(const Results& results, std::string* text) {
  const auto standard = results.Find({kQuery, kField, kStandardMap, kStandardReach});
  bool first = true;
  for (const auto& [key, ns, repetitions] : results.All()) {
    if (key.group != kOption) {
      continue;
    }
    if (first) {
      Add(text, "\nThe same with other laws, at N = {}, r = {}, {}\n", kStandardMap.nodes,
          kStandardReach, Density(kStandardMap));
      Add(text, "{:24} {:>8}  {:^19}  {}\n", "", "field", "p10 - p90", "of the standard");
      first = false;
    }
    Add(text, "{:24} {}", key.variant, Times(ns));
    if (standard) {
      Add(text, "  {:.2f}x", ns.median / standard->median);
    }
    *text += '\n';
  }
}

void AddRobotSteps(const Results& results, std::string* text) {
  const std::vector<Result> rows = FieldResults(results, kRobotStep);
  if (rows.empty()) {
    return;
  }
  Add(text,
      "\nA robot-step: deposit, answer and the share of evaporation, at {} frames a second;\n"
      "density \"own\": only what the robots left themselves\n",
      kFramesPerSecond);
  Add(text, "{:>5} {:>3} {:>8} {:>6}  {:>8}  {:^19} {:>7} {:>18} {:>18} {:>18} {:>18}\n", "N", "r",
      "density", "robots", "field", "p10 - p90", "M/s", kLiteralScan, kWideScan, "same, skipping",
      kDenseSweep);
  for (const auto& [key, ns, repetitions] : rows) {
    Add(text, "{:>5} {:>3} {:>8} {:>6}  {} {:>7.2f} {} {} {} {}\n", key.map.nodes, key.reach,
        Density(key.map), key.robots, Times(ns), 1e3 / ns.median,
        Against(results, key, kLiteralScan, ns.median), Against(results, key, kWideScan, ns.median),
        Against(results, key, kSkippingScan, ns.median),
        Against(results, key, kDenseSweep, ns.median));
  }
}

// The mean number of lines that a query of the memory bound touches.
double LinesPerQuery(int32_t nodes, int reach) {
  constexpr size_t kSample = 4096;
  return static_cast<double>(LinesUnder(GeometryOf(nodes), kAntennaDistanceUm, reach * kCellUm,
                                        RandomPoses(nodes, kSample, 2))
                                 .size()) /
         kSample;
}

// What the second thread brings.
std::string Gain(const Results& results, CaseKey key, const Summary& ns) {
  if (key.variant != kTwoThreads) {
    return "";
  }
  key.variant = kOneThread;
  const auto one = results.Find(key);
  return one ? fmt::format("  {:.2f} times one thread", one->median / ns.median) : "";
}

void AddMachine(const Results& results, std::string* text) {
  bool first = true;
  for (const auto& [key, ns, repetitions] : results.All()) {
    const bool bound = key.variant == kMemoryBound;
    if (!bound && key.group != kMachine && key.group != kDeposit && key.group != kDiffusion &&
        key.group != kReaders) {
      continue;
    }
    if (first) {
      Add(text, "\nSingle figures, and what this machine can do (wide loops: {})\n",
          BestWide().name);
      first = false;
    }
    if (bound) {
      const double lines = LinesPerQuery(key.map.nodes, key.reach);
      Add(text, "{:44} {}  {:.1f} lines, {:.2f} ns a line, map of {:.3g} MB\n", key.name(),
          Times(ns), lines, ns.median / lines,
          static_cast<double>(TiledBytes(GeometryOf(key.map.nodes))) / 1e6);
    } else {
      Add(text, "{:44} {}{}\n", key.name(), Times(ns), Gain(results, key, ns));
    }
  }
}

}  // namespace

std::string Duration(double ns) {
  static constexpr const char* kUnits[] = {"ns", "us", "ms", "s"};
  size_t unit = 0;
  while (ns >= 999.5 && unit + 1 < std::size(kUnits)) {
    ns /= 1000;
    ++unit;
  }
  const int decimals = ns < 9.995 ? 2 : ns < 99.95 ? 1 : 0;
  return fmt::format("{:.{}f} {}", ns, decimals, kUnits[unit]);
}

std::string Tables(const Results& results) {
  std::string text;
  AddQueries(results, &text);
  AddOptions(results, &text);
  AddRobotSteps(results, &text);
  AddMachine(results, &text);
  return text;
}

std::string Csv(const Results& results) {
  std::string text =
      "group,variant,nodes,reach_cells,density_percent,pattern,robots,"
      "median_ns,p10_ns,p90_ns,repetitions\n";
  for (const auto& [key, ns, repetitions] : results.All()) {
    Add(&text, "{},\"{}\",{},{},{},{},{},{:.4f},{:.4f},{:.4f},{}\n", key.group, key.variant,
        key.map.nodes, key.reach, key.map.density_percent,
        key.map.pattern == Pattern::kTrails ? "trails" : "uniform", key.robots, ns.median, ns.p10,
        ns.p90, repetitions);
  }
  return text;
}

}  // namespace pheromone::field::bench
