#include "client_fw/swarm/lab_levels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "client_fw/lab/scenario/run.h"
#include "client_fw/swarm/lab_radio.h"

namespace pheromone::swarm {
namespace {

bool Near(double value, double reference, double share) {
  return std::abs(value - reference) <= share * reference;
}

}  // namespace

Result<LevelFigures> MeasureLevel(const std::string& file, lab::Level level,
                                  const LevelCell& cell) {
  LevelFigures sum;
  for (int seed = 1; seed <= cell.seeds; ++seed) {
    PHEROMONE_TRY(lab::LabScenario scenario,
                  lab::LoadLabScenario(
                      file, {{"run.level", std::string(NameOf(level))},
                             {"run.seed", std::to_string(seed)},
                             {"radio.lost", fmt::format("{:g}", cell.lost_percent / 100.0)}}));
    auto& starts = scenario.world.groups.front().starts;
    const auto robots = static_cast<size_t>(cell.robots);
    if (starts.size() < robots) {
      return Error{fmt::format("{}: found {} starts, expected {}", file, starts.size(), robots)};
    }
    starts.resize(robots);
    lab::LabResult result;
    if (level == lab::Level::kRadio) {
      result = RunLabOnAir(scenario, {});
    } else {
      PHEROMONE_TRY(result, lab::RunLab(scenario, 1, {}));
    }
    const lab::WorldTally& tally = result.tally;
    sum.answers_per_s += 1000 * static_cast<double>(tally.heard.answers) /
                         static_cast<double>(result.measured_ms) / cell.seeds;
    sum.path_error_mm += 1000 * tally.path_errors.mean_m() / cell.seeds;
    sum.stops += static_cast<double>(tally.heard.fail_safe_stops);
  }
  return sum;
}

Agreement Compare(const LevelFigures& figures, const LevelFigures& air) {
  const double least = std::min(figures.stops, air.stops);
  const double most = std::max(figures.stops, air.stops);
  return {Near(figures.answers_per_s, air.answers_per_s, 0.03),
          Near(figures.path_error_mm, air.path_error_mm, 0.1),
          most <= 1.3 * least || most - least <= 2 * std::sqrt(most + least)};
}

}  // namespace pheromone::swarm
