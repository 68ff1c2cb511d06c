#include "client_fw/experiments/cleaning/grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace pheromone::swarm {
namespace {

constexpr size_t kPaperColumns = 4;
constexpr size_t kPaperRows = 3;
constexpr std::array<int, kPaperColumns* kPaperRows> kPaperRates = {5,  5,  5, 5, 10, 10,
                                                                    10, 10, 5, 5, 10, 5};

}  // namespace

double CleaningGrid::CentreX(int zone) const {
  return own.empty() ? (ColumnOf(zone) + 0.5) * zone_m : own[static_cast<size_t>(zone)].x_m;
}

double CleaningGrid::CentreY(int zone) const {
  return own.empty() ? (RowOf(zone) + 0.5) * zone_m : own[static_cast<size_t>(zone)].y_m;
}

double CleaningGrid::RangeOf(int zone) const {
  return own.empty() ? kRangeOfZone * zone_m : own[static_cast<size_t>(zone)].range_m;
}

double CleaningGrid::width_m() const {
  double most = 0;
  for (int zone = 0; zone < zones(); ++zone) {
    most = std::max(most, CentreX(zone) + zone_m / 2);
  }
  return most;
}

double CleaningGrid::height_m() const {
  double most = 0;
  for (int zone = 0; zone < zones(); ++zone) {
    most = std::max(most, CentreY(zone) + zone_m / 2);
  }
  return most;
}

int CleaningGrid::ZoneAt(double x_m, double y_m) const {
  if (!own.empty()) {
    const auto distance = [&](const CleaningZone& zone) {
      return std::hypot(zone.x_m - x_m, zone.y_m - y_m);
    };
    const auto nearest = std::min_element(
        own.begin(), own.end(),
        [&](const CleaningZone& a, const CleaningZone& b) { return distance(a) < distance(b); });
    return static_cast<int>(nearest - own.begin());
  }
  const auto place = [this](double at_m, int count) {
    return std::clamp(static_cast<int>(std::floor(at_m / zone_m)), 0, count - 1);
  };
  return place(x_m, columns) * rows + place(y_m, rows);
}

int CleaningGrid::RatePercent(int zone) const {
  if (!own.empty()) {
    return own[static_cast<size_t>(zone)].rate_percent;
  }
  const size_t column = static_cast<size_t>(ColumnOf(zone)) % kPaperColumns;
  const size_t row = static_cast<size_t>(RowOf(zone)) % kPaperRows;
  return kPaperRates[column * kPaperRows + row];
}

std::vector<SoilStep> SoilOf(const CleaningGrid& grid, const SoilRule& rule, int zone,
                             const std::vector<Cleaning>& cleanings, int64_t end_ms) {
  std::vector<SoilStep> soil = {{0, rule.start_percent}};
  const auto set = [&soil](int64_t time_ms, double percent) {
    if (percent != soil.back().percent) {
      soil.push_back({time_ms, percent});
    }
  };
  int64_t next_ms = rule.step_ms();
  const auto soil_until = [&](int64_t until_ms) {
    for (; next_ms <= until_ms; next_ms += rule.step_ms()) {
      set(next_ms, std::min(100.0, soil.back().percent + grid.RatePercent(zone)));
    }
  };
  for (const Cleaning& cleaning : cleanings) {
    if (cleaning.zone != zone) {
      continue;
    }
    soil_until(cleaning.begin_ms);
    while (next_ms <= cleaning.end_ms) {  // not meanwhile
      next_ms += rule.step_ms();
    }
    if (cleaning.is_done) {
      set(cleaning.end_ms, 0);
    }
  }
  soil_until(end_ms);
  return soil;
}

double HighestPercent(const std::vector<SoilStep>& soil) {
  double highest = 0;
  for (const SoilStep& step : soil) {
    highest = std::max(highest, step.percent);
  }
  return highest;
}

int64_t WorstGapMs(int zone, const std::vector<Cleaning>& cleanings, int64_t end_ms) {
  int64_t worst_ms = 0;
  int64_t since_ms = 0;
  bool is_open = false;  // at the end of the run
  for (const Cleaning& cleaning : cleanings) {
    if (cleaning.zone != zone) {
      continue;
    }
    is_open = !cleaning.is_done && cleaning.end_ms >= end_ms;
    if (!cleaning.is_done && !is_open) {
      continue;  // broken off: still not cleaned
    }
    worst_ms = std::max(worst_ms, cleaning.begin_ms - since_ms);
    since_ms = cleaning.end_ms;
  }
  return is_open ? worst_ms : std::max(worst_ms, end_ms - since_ms);
}

int64_t TogetherMs(const std::vector<Cleaning>& cleanings) {
  int64_t together_ms = 0;
  std::map<int, std::vector<const Cleaning*>> lately;  // by zone: what has not ended before
  for (const Cleaning& cleaning : cleanings) {
    std::vector<const Cleaning*>& others = lately[cleaning.zone];
    std::erase_if(others, [&](const Cleaning* it) { return it->end_ms <= cleaning.begin_ms; });
    for (const Cleaning* other : others) {
      together_ms += std::min(other->end_ms, cleaning.end_ms) - cleaning.begin_ms;
    }
    others.push_back(&cleaning);
  }
  return together_ms;
}

}  // namespace pheromone::swarm
