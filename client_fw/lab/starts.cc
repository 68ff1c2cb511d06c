#include "client_fw/lab/starts.h"

#include <cmath>
#include <numbers>

#include "client_fw/lab/chance.h"

namespace pheromone::lab {
namespace {

// Discs may touch; rounding must not make them overlap.
constexpr double kApartM = 1e-6;

}  // namespace

void StartPlacer::Take(const sim::PlanePose& pose, double radius_m) {
  cells_[KeyOf(CellAlong(pose.x_m), CellAlong(pose.y_m))].push_back({pose.x_m, pose.y_m, radius_m});
}

std::optional<sim::PlanePose> StartPlacer::Find(const AreaM& area, double radius_m) {
  const uint64_t robot = drawn_++;
  for (uint64_t attempt = 0; attempt < kMaxTries; ++attempt) {
    const auto draw = [&](Use use) { return PheromoneUniform(seed_, robot, attempt, use); };
    const sim::PlanePose pose{area.left + (area.right - area.left) * draw(kStartX),
                              area.bottom + (area.top - area.bottom) * draw(kStartY),
                              2 * std::numbers::pi * draw(kStartHeading)};
    if (IsFree(pose.x_m, pose.y_m, radius_m)) {
      Take(pose, radius_m);
      return pose;
    }
  }
  return std::nullopt;
}

bool StartPlacer::IsFree(double x_m, double y_m, double radius_m) const {
  if (!walls_.IsOnMap(x_m, y_m) || walls_.Touches(x_m, y_m, radius_m)) {
    return false;
  }
  const int64_t column = CellAlong(x_m);
  const int64_t row = CellAlong(y_m);
  for (int64_t r = row - 1; r <= row + 1; ++r) {
    for (int64_t c = column - 1; c <= column + 1; ++c) {
      const auto cell = cells_.find(KeyOf(c, r));
      if (cell == cells_.end()) {
        continue;
      }
      for (const Disc& disc : cell->second) {
        const bool points = radius_m == 0 || disc.radius_m == 0;
        if (!points &&
            std::hypot(x_m - disc.x_m, y_m - disc.y_m) < radius_m + disc.radius_m + kApartM) {
          return false;
        }
      }
    }
  }
  return true;
}

}  // namespace pheromone::lab
