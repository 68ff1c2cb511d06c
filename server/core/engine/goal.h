// A robot's goal: a point to which the server leads it, along a route around the obstacles. Robots
// know nothing of goals. Instead of the field's intensities, a robot with a goal is told what its
// two antennas would sense of a pheromone of its own, at the point of the route that lies ahead of
// it; by that its steering law turns towards it.
//
//   Goal goal{{from, corner, to}, 100'000};
//   if (!IsAt(goal, pose.position)) { field::Intensities p = LeadTo(goal, pose, sensed); }
//
// The equations, with u = 4096 (one pheromone unit), beta the bearing of the target from the
// robot's heading, positive to the left, and rho the distance to the end of the route:
//
//   target  the point of the route kLookaheadUm further on than the one nearest to the robot ("pure
//           pursuit", Coulter 1992), at most its end
//   turn    |beta| in right angles, approximately: f, l the target's distance ahead and to the
//   left,
//           |l| / (|f| + |l|) for f >= 0, 2 - |l| / (|f| + |l|) for f < 0
//   D       min(2 turn, 1); within kNearUm of the end min(2 turn, 2)
//   A       u (rho / kBrakingUm)^2, within 1 ... u
//   P of the side of the target: A;  of the other side: A - u D
//
// So D is that of the differential law (client_fw/core/steering/steering.h): one wheel stops where
// the target is 45 degrees aside or more, near the end the robot turns on the spot; and a law that
// slows down where it senses less than before slows down before the end. Repellents stay as they
// are: of the field's own intensities, the negative ones are added.
//
// Integers only, the same bits everywhere. Pure; any thread.
#pragma once

#include <cstdint>
#include <vector>

#include "server/base/fields.h"
#include "server/base/result.h"
#include "server/core/field/config.h"
#include "server/core/field/field.h"

namespace pheromone::engine {

constexpr int64_t kLookaheadUm = 500'000;
constexpr int64_t kNearUm = 1'000'000;
/// With the default law, a robot at 600 mm/s that misses an answer now and then stops within 0.1 m
/// of the goal. The square: that law compares with what it sensed of late, and would get used to
/// less.
constexpr int64_t kBrakingUm = 1'400'000;

constexpr uint32_t kLeastToleranceUm = 10'000;
constexpr uint32_t kMaxToleranceUm = 1'000'000'000;

struct Goal {
  std::vector<field::PointUm> route;  ///< 1 to kMaxRoutePoints; the last is the goal
  uint32_t tolerance_um = 100'000;
  bool operator==(const Goal&) const = default;

  field::PointUm point() const { return route.back(); }

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("route", it.route);
    visit("tolerance_um", it.tolerance_um, Within(kLeastToleranceUm, kMaxToleranceUm));
  }
};

/// What holds on any map. Errors: no point, too many, a point that no map has, a tolerance out of
/// range.
Status CheckRoute(const Goal& goal);

/// The same on this map. Errors: also a point off the map, a goal that is blocked by an obstacle.
Status CheckGoal(const Goal& goal, const field::FieldConfig& field);

/// Whether the distance to the goal is at most the tolerance.
bool IsAt(const Goal& goal, field::PointUm position);

/// P_L and P_R for a robot on the map that has not arrived; `sensed` are those of the field.
field::Intensities LeadTo(const Goal& goal, const field::PoseUm& pose,
                          const field::Intensities& sensed);

/// Over every field.
uint64_t HashOf(const Goal& goal);

}  // namespace pheromone::engine
