#include "server/core/engine/goal.h"

#include <algorithm>
#include <string>

#include "server/base/hash.h"
#include "server/core/field/extent.h"
#include "server/core/field/heading.h"
#include "server/core/field/route.h"
#include "server/core/field/wide_integer.h"

namespace pheromone::engine {
namespace {

using field::Int128;
using field::PointUm;

constexpr int64_t kUnit = 4096;

PointUm operator-(PointUm a, PointUm b) {
  return {a.x - b.x, a.y - b.y};
}

Int128 Dot(PointUm a, PointUm b) {
  return Int128{a.x} * b.x + Int128{a.y} * b.y;
}

int64_t Length(PointUm a) {
  return field::FloorRoot(Dot(a, a));
}

// The point at `part` of `whole` from a to b, 0 <= part <= whole.
PointUm Between(PointUm a, PointUm b, Int128 part, Int128 whole) {
  if (whole == 0) {
    return b;
  }
  return {a.x + static_cast<int64_t>(part * (b.x - a.x) / whole),
          a.y + static_cast<int64_t>(part * (b.y - a.y) / whole)};
}

PointUm TargetOf(const std::vector<PointUm>& route, PointUm robot) {
  size_t next = route.size() - 1;  // the end of the nearest leg
  PointUm nearest = route.back();
  Int128 least = Dot(nearest - robot, nearest - robot);
  for (size_t i = 1; i < route.size(); ++i) {
    const PointUm leg = route[i] - route[i - 1];
    const Int128 whole = Dot(leg, leg);
    const Int128 part = std::clamp<Int128>(Dot(robot - route[i - 1], leg), 0, whole);
    // A length of a leg has 41 bits, its square 82: `part` is shortened before it is multiplied.
    const PointUm foot = Between(route[i - 1], route[i], part >> 20, whole >> 20);
    const Int128 square = Dot(foot - robot, foot - robot);
    if (square <= least) {
      least = square;
      nearest = foot;
      next = i;
    }
  }
  int64_t left = kLookaheadUm;
  for (; next < route.size(); ++next) {
    const int64_t length = Length(route[next] - nearest);
    if (length >= left) {
      return Between(nearest, route[next], left, length);
    }
    left -= length;
    nearest = route[next];
  }
  return nearest;
}

// In 1/4096 of a right angle.
int64_t TurnOf(Int128 ahead, Int128 aside) {
  const Int128 size = aside < 0 ? -aside : aside;
  const Int128 sum = size + (ahead < 0 ? -ahead : ahead);
  if (sum == 0) {
    return 0;
  }
  const auto share = static_cast<int64_t>(size * kUnit / sum);
  return ahead >= 0 ? share : 2 * kUnit - share;
}

}  // namespace

Status CheckRoute(const Goal& goal) {
  constexpr int64_t kFarthest = 2 * field::MapGeometry::kMaxUm;
  if (goal.route.empty() || goal.route.size() > field::kMaxRoutePoints) {
    return Error{"a route of " + std::to_string(goal.route.size()) + " points, expected 1 to " +
                 std::to_string(field::kMaxRoutePoints)};
  }
  for (const PointUm point : goal.route) {
    if (point.x < -kFarthest || point.x > kFarthest || point.y < -kFarthest ||
        point.y > kFarthest) {
      return Error{"a route through a point that no map has"};
    }
  }
  return CheckFields(goal, "goal");
}

Status CheckGoal(const Goal& goal, const field::FieldConfig& field) {
  Status status = CheckRoute(goal);
  if (!status.ok()) {
    return status;
  }
  for (const PointUm point : goal.route) {
    if (!field.map.Contains(point)) {
      return Error{"the goal or its route is off " + field::DescribeExtent(field.map)};
    }
  }
  if (field.obstacles && field.obstacles->Blocked(field.map.NearestNode(goal.point()))) {
    return Error{"the goal is blocked by an obstacle"};
  }
  return Ok();
}

bool IsAt(const Goal& goal, PointUm position) {
  // A robot may report a position far off the map, for which the square would overflow.
  const int64_t far = int64_t{goal.tolerance_um};
  const PointUm to = goal.point();
  if (position.x < to.x - far || position.x > to.x + far || position.y < to.y - far ||
      position.y > to.y + far) {
    return false;
  }
  return Dot(to - position, to - position) <= Int128{far} * far;
}

field::Intensities LeadTo(const Goal& goal, const field::PoseUm& pose,
                          const field::Intensities& sensed) {
  const PointUm to = TargetOf(goal.route, pose.position) - pose.position;
  const field::DirectionQ14 heading = field::DirectionOf(pose.heading);
  const Int128 ahead = Int128{to.x} * heading.cos + Int128{to.y} * heading.sin;
  const Int128 left = Int128{to.y} * heading.cos - Int128{to.x} * heading.sin;
  const int64_t rest_um = Length(goal.point() - pose.position);
  const int64_t most = rest_um <= kNearUm ? 2 * kUnit : kUnit;
  const int64_t difference = std::min(2 * TurnOf(ahead, left), most);
  const int64_t braked_um = std::min(rest_um, kBrakingUm);
  const int64_t strength =
      std::max<int64_t>(kUnit * braked_um / kBrakingUm * braked_um / kBrakingUm, 1);
  const int64_t weaker = strength - difference;
  field::Intensities p =
      left >= 0 ? field::Intensities{strength, weaker} : field::Intensities{weaker, strength};
  p.left += std::min<int64_t>(sensed.left, 0);
  p.right += std::min<int64_t>(sensed.right, 0);
  return p;
}

uint64_t HashOf(const Goal& goal) {
  uint64_t hash = Hash64({'G', goal.tolerance_um, goal.route.size()});
  for (const PointUm point : goal.route) {
    hash = HashStep(hash, static_cast<uint64_t>(point.x));
    hash = HashStep(hash, static_cast<uint64_t>(point.y));
  }
  return hash;
}

}  // namespace pheromone::engine
