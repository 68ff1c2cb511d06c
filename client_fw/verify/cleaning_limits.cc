#include "client_fw/verify/cleaning_limits.h"

#include "client_fw/core/tasks/cleaning.h"
#include "client_fw/verify/cleaning_tag.h"

namespace pheromone::verify {
namespace {

std::string Expected(const char* what, int found, int least, int most) {
  return std::string(what) + ": found " + std::to_string(found) + ", expected " +
         std::to_string(least) + " to " + std::to_string(most);
}

std::string WrongNeighbours(const CleaningNeighbours& floor) {
  constexpr size_t kMost = client::kMaxVisibleTags - 1;
  for (size_t zone = 0; zone < floor.size(); ++zone) {
    const std::string name = "zone " + std::to_string(zone + 1);
    if (floor[zone].size() > kMost) {
      return name + ": found " + std::to_string(floor[zone].size()) +
             " zones beside it, expected at most " + std::to_string(kMost) +
             ": a robot keeps the " + std::to_string(kMost + 1) + " nearest tags in sight";
    }
    uint64_t seen = uint64_t{1} << zone;
    for (const uint8_t beside : floor[zone]) {
      if (beside >= floor.size() || (seen >> beside & 1) != 0) {
        return name + ": found zone " + std::to_string(beside + 1) +
               " beside it, expected different other zones of the floor";
      }
      seen |= uint64_t{1} << beside;
    }
  }
  return "";
}

}  // namespace

CleaningNeighbours GridNeighbours(int columns, int rows) {
  CleaningNeighbours floor(static_cast<size_t>(columns) * static_cast<size_t>(rows));
  for (int column = 0; column < columns; ++column) {
    for (int row = 0; row < rows; ++row) {
      const auto add = [&](int c, int r) {
        if (c >= 0 && c < columns && r >= 0 && r < rows) {
          floor[static_cast<size_t>(column * rows + row)].push_back(
              static_cast<uint8_t>(c * rows + r));
        }
      };
      add(column - 1, row);
      add(column, row - 1);
      add(column, row + 1);
      add(column + 1, row);
    }
  }
  return floor;
}

std::string WhatIsWrong(const CleaningLimits& limits) {
  constexpr int kZones = kMaxZones;
  if (limits.neighbours.empty() &&
      (limits.columns < 1 || limits.rows < 1 || limits.columns > kZones || limits.rows > kZones)) {
    return "grid: found " + std::to_string(limits.columns) + " x " + std::to_string(limits.rows) +
           ", expected 1 to " + std::to_string(kZones) + " columns and rows";
  }
  const CleaningNeighbours floor = limits.Floor();
  const auto zones = static_cast<int>(floor.size());
  struct Range {
    const char* what;
    int found;
    int least;
    int most;
  };
  for (const Range& it :
       {Range{"zones", zones, 1, kZones},
        Range{"robots", limits.robots, 1, static_cast<int>(kMaxCleaners)},
        Range{"crashes", limits.crashes, 0, limits.robots - 1},
        Range{"longest cleaning", limits.clean_max, 1, kMaxUnits},
        Range{"shortest cleaning", limits.clean_min, 1, limits.clean_max},
        Range{"longest move", limits.move_max, 1, kMaxUnits},
        Range{"shortest move", limits.move_min, 1, limits.move_max},
        Range{"waiting", limits.wait, 1, kMaxUnits}, Range{"lease", limits.lease, 0, kMaxUnits},
        Range{"soiling step", limits.soiling_step, 1, kMaxUnits},
        Range{"asks", limits.asks, 0, 15}}) {
    if (it.found < it.least || it.found > it.most) {
      return Expected(it.what, it.found, it.least, it.most);
    }
  }
  if (!limits.rates_percent.empty() && limits.rates_percent.size() != floor.size()) {
    return "soiling rates: found " + std::to_string(limits.rates_percent.size()) +
           ", expected one for each of " + std::to_string(zones) + " zones";
  }
  for (const int rate : limits.rates_percent) {
    if (rate < 0 || rate > kFullPercent) {
      return Expected("soiling rate in %", rate, 0, kFullPercent);
    }
  }
  return WrongNeighbours(floor);
}

}  // namespace pheromone::verify
