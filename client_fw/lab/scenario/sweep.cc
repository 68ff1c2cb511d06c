#include "client_fw/lab/scenario/sweep.h"

#include <algorithm>
#include <cstdint>
#include <string_view>
#include <utility>

#include "server/config/reader.h"
#include "server/config/sections.h"

namespace pheromone::lab {
namespace {

using config::TableReader;
using config::Value;

constexpr size_t kMaxRuns = 1'000'000;

struct Axis {
  std::string key;
  std::vector<std::string> values;
};

// "robots[1].count" = [...], or, without quotes, robots.count = [...].
void ReadAxes(const Value& table, const std::string& prefix, const TableReader& sweep,
              std::vector<Axis>* axes) {
  for (const Value& item : table.items) {
    const std::string key = prefix + item.key;
    if (key == "seeds") {
      continue;
    }
    if (item.kind == Value::Kind::kTable) {
      ReadAxes(item, key + '.', sweep, axes);
    } else if (item.kind != Value::Kind::kArray || item.items.empty()) {
      sweep.Expected(key, item, "an array of the values that it takes");
    } else {
      Axis& axis = axes->emplace_back(Axis{key, {}});
      for (const Value& value : item.items) {
        axis.values.push_back(TomlOf(value));
      }
    }
  }
}

std::vector<uint64_t> ReadSeeds(const TableReader& sweep) {
  const Value* seeds = sweep.Find("seeds");
  std::vector<uint64_t> list;
  if (seeds == nullptr || seeds->kind != Value::Kind::kArray) {
    const int64_t count = sweep.Integer("seeds", 1, kMaxRuns, 1).value_or(1);
    for (int64_t seed = 1; seed <= count; ++seed) {
      list.push_back(static_cast<uint64_t>(seed));
    }
    return list;
  }
  if (seeds->items.empty()) {
    sweep.Expected("seeds", *seeds, "at least one seed, or how many");
  }
  for (const Value& seed : seeds->items) {
    if (seed.kind != Value::Kind::kInteger || seed.integer < 0) {
      sweep.Expected("seeds", seed, "whole numbers from 0 up, or how many seeds");
      break;
    }
    list.push_back(static_cast<uint64_t>(seed.integer));
  }
  return list;
}

std::string ShellWord(const std::string& word) {
  constexpr std::string_view kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./=+,:@%-";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) {
    return word;
  }
  std::string quoted = "'";
  for (const char c : word) {
    quoted += c == '\'' ? "'\\''" : std::string(1, c);
  }
  return quoted + '\'';
}

}  // namespace

Result<std::vector<SweepRun>> RunsOf(const Value& tree, const std::string& name) {
  config::Notes notes{config::Problems(name), name, {}, {}, {}};
  const TableReader sweep(config::TableOf(tree, "sweep", &notes), "sweep", &notes.problems);
  if (tree.Find("sweep") == nullptr) {
    notes.problems.Add(tree.at, "sweep", "missing, expected a table [sweep]");
  }
  std::vector<Axis> axes;
  ReadAxes(config::TableOf(tree, "sweep", &notes), "", sweep, &axes);
  const std::vector<uint64_t> seeds = ReadSeeds(sweep);
  double count = static_cast<double>(seeds.size());
  for (const Axis& axis : axes) {
    count *= static_cast<double>(axis.values.size());
  }
  if (count > kMaxRuns) {
    notes.problems.Add(tree.at, "sweep", "makes more than a million runs");
  }
  if (!notes.problems.empty()) {
    return Error{notes.problems.Text()};
  }
  std::vector<SweepRun> runs;
  std::vector<size_t> at(axes.size());
  while (true) {
    SweepRun run;
    for (size_t i = 0; i < axes.size(); ++i) {
      run.settings.emplace_back(axes[i].key, axes[i].values[at[i]]);
    }
    for (const uint64_t seed : seeds) {
      run.seed = seed;
      runs.push_back(run);
    }
    // The next combination, the last key first.
    size_t axis = axes.size();
    while (axis > 0 && ++at[axis - 1] == axes[axis - 1].values.size()) {
      at[--axis] = 0;
    }
    if (axis == 0) {
      return runs;
    }
  }
}

std::string CommandOf(const SweepRun& run, const std::string& file, const std::string& summary) {
  std::string command = "pheromone-swarm lab run " + ShellWord(file);
  for (const auto& [key, value] : run.settings) {
    command += " --set " + ShellWord(key + '=' + value);
  }
  command += " --seed " + std::to_string(run.seed);
  return summary.empty() ? command : command + " --summary " + ShellWord(summary);
}

}  // namespace pheromone::lab
