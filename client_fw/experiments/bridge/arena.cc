#include "client_fw/experiments/bridge/arena.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>
#include <utility>

namespace pheromone::swarm {
namespace {

constexpr double kRightAngle = std::numbers::pi / 2;
/// The limit of a robot's angle to its corridor: there is no room to turn around.
constexpr double kMaxTurn = 80 * std::numbers::pi / 180;
constexpr int kPiecesABend = 12;
constexpr double kNarrowedM = 0.6;  // behind a fork a branch is as narrow as elsewhere
/// The branches are mirror images within the reach of a robot before the fork.
constexpr double kEntryM = 0.9;

// Draws a line with turtle graphics, so that lengths are exact.
class Turtle {
 public:
  Turtle(double x_m, double y_m, double heading_rad)
      : points_{{x_m, y_m}}, heading_rad_(heading_rad) {}

  Turtle& Forward(double metres) {
    const Lane::Point at = points_.back();
    points_.push_back(
        {at.x_m + metres * std::cos(heading_rad_), at.y_m + metres * std::sin(heading_rad_)});
    return *this;
  }

  // An arc to the left, or to the right if `turn_rad` is negative.
  Turtle& Bend(double turn_rad, double radius_m) {
    const Lane::Point from = points_.back();
    const double first = heading_rad_;
    const double way = std::copysign(radius_m, turn_rad);
    for (int i = 1; i <= kPiecesABend; ++i) {
      const double heading = first + turn_rad * i / kPiecesABend;
      points_.push_back({from.x_m + way * (std::sin(heading) - std::sin(first)),
                         from.y_m - way * (std::cos(heading) - std::cos(first))});
    }
    heading_rad_ = first + turn_rad;
    return *this;
  }

  double x_m() const { return points_.back().x_m; }
  std::vector<Lane::Point> Take() { return std::move(points_); }

 private:
  std::vector<Lane::Point> points_;
  double heading_rad_;
};

// Up, across and down again; the mirror image if `angle` is negative.
Lane Arch(const BridgeShape& shape, double x_m, double angle) {
  const double slope_m = Turtle(0, 0, angle).Forward(kEntryM).Bend(-angle, shape.bend_m).x_m();
  return Lane(Turtle(x_m, shape.axis_y_m, angle)
                  .Forward(kEntryM)
                  .Bend(-angle, shape.bend_m)
                  .Forward(shape.span_m - 2 * slope_m)
                  .Bend(-angle, shape.bend_m)
                  .Forward(kEntryM)
                  .Take());
}

// Down, across and up again; the vertical legs make up the length.
Lane LongBranch(const BridgeShape& shape, double x_m, double length_m) {
  const double angle = BridgeArena::kForkAngle;
  if (shape.ratio == 1) {
    return Arch(shape, x_m, -angle);
  }
  const auto draw = [&](double leg_m, double across_m) {
    return Lane(Turtle(x_m, shape.axis_y_m, -angle)
                    .Forward(kEntryM)
                    .Bend(angle - kRightAngle, shape.bend_m)
                    .Forward(leg_m)
                    .Bend(kRightAngle, shape.bend_m)
                    .Forward(across_m)
                    .Bend(kRightAngle, shape.bend_m)
                    .Forward(leg_m)
                    .Bend(angle - kRightAngle, shape.bend_m)
                    .Forward(kEntryM)
                    .Take());
  };
  const Lane without_legs = draw(0, 0);
  const double across_m = shape.span_m - (without_legs.points().back().x_m - x_m);
  const double leg_m = (length_m - without_legs.length_m() - across_m) / 2;
  assert(across_m > 0 && leg_m >= 0);
  return draw(leg_m, across_m);
}

}  // namespace

Lane::Lane(const std::vector<Point>& points) {
  for (const Point& point : points) {  // repeated points have no direction
    if (points_.empty() ||
        std::hypot(point.x_m - points_.back().x_m, point.y_m - points_.back().y_m) > 1e-9) {
      points_.push_back(point);
    }
  }
  assert(points_.size() >= 2);
  along_.push_back(0);
  for (size_t i = 1; i < points_.size(); ++i) {
    const double dx = points_[i].x_m - points_[i - 1].x_m;
    const double dy = points_[i].y_m - points_[i - 1].y_m;
    along_.push_back(along_.back() + std::hypot(dx, dy));
    headings_.push_back(std::atan2(dy, dx));
  }
}

Lane Lane::Reversed() const {
  return Lane(std::vector<Point>(points_.rbegin(), points_.rend()));
}

sim::PlanePose Lane::At(double along_m) const {
  const auto next = std::upper_bound(along_.begin() + 1, along_.end() - 1, along_m);
  const auto piece = static_cast<size_t>(next - along_.begin()) - 1;
  const double rest_m = along_m - along_[piece];
  return {points_[piece].x_m + rest_m * std::cos(headings_[piece]),
          points_[piece].y_m + rest_m * std::sin(headings_[piece]), headings_[piece]};
}

Lane::Place Lane::Locate(double x_m, double y_m, size_t piece) const {
  for (;; ++piece) {
    const double dx = x_m - points_[piece].x_m;
    const double dy = y_m - points_[piece].y_m;
    const double cosine = std::cos(headings_[piece]);
    const double sine = std::sin(headings_[piece]);
    const double along_m = along_[piece] + dx * cosine + dy * sine;
    if (along_m <= along_[piece + 1] || piece + 1 == pieces()) {
      return {piece, along_m, dy * cosine - dx * sine};
    }
  }
}

BridgeArena::BridgeArena(const BridgeShape& shape) : shape_(shape) {
  assert(shape.ratio == 1 || shape.ratio >= 1.5);
  const double fork_x_m = shape.nest_x_m + shape.stem_m;
  const Lane short_branch = Arch(shape, fork_x_m, kForkAngle);
  const std::array<Lane, kCorridors> outbound = {
      Lane({{shape.nest_x_m, shape.axis_y_m}, {fork_x_m, shape.axis_y_m}}), short_branch,
      LongBranch(shape, fork_x_m, shape.ratio * short_branch.length_m()),
      Lane({{fork_x_m + shape.span_m, shape.axis_y_m},
            {fork_x_m + shape.span_m + shape.stem_m, shape.axis_y_m}})};
  for (const Lane& lane : outbound) {
    lanes_.push_back(lane);
    lanes_.push_back(lane.Reversed());
  }
}

double BridgeArena::wedge_m() const {
  return shape_.free_m / std::sin(kForkAngle);
}

bool BridgeGuide::BeforeFork() const {
  return corridor_ == (outbound_ ? BridgeArena::kNestStem : BridgeArena::kFoodStem);
}

BridgeGuide::Step BridgeGuide::Hold(sim::PlanePose* pose, bool short_open) {
  const Lane::Place place = lane().Locate(pose->x_m, pose->y_m, piece_);
  piece_ = place.piece;
  KeepInside(pose, place, short_open);
  const double beyond_m = place.along_m - lane().length_m();
  if (BeforeFork()) {
    if (beyond_m < arena_->wedge_m()) {
      return Step::kNone;
    }
    const bool left = lane().Locate(pose->x_m, pose->y_m, piece_).left_m >= 0;
    const bool to_short = short_open && left == short_on_left();
    Enter(to_short ? BridgeArena::kShortBranch : BridgeArena::kLongBranch);
    return Step::kChose;
  }
  if (beyond_m < 0) {
    return Step::kNone;
  }
  if (on_branch()) {
    Enter(outbound_ ? BridgeArena::kFoodStem : BridgeArena::kNestStem);
    return Step::kCrossed;
  }
  return Step::kArrived;
}

// Half the corridor's width, without the fork.
double BridgeGuide::RoomAt(double along_m) const {
  const BridgeShape& shape = arena_->shape();
  if (BeforeFork()) {
    return along_m < lane().length_m() - shape.approach_m ? shape.guided_m : shape.free_m;
  }
  if (on_branch() && along_m < kNarrowedM) {
    const double wedge_m = arena_->wedge_m();
    const double narrowed = std::max(0.0, along_m - wedge_m) / (kNarrowedM - wedge_m);
    return shape.free_m + narrowed * (shape.guided_m - shape.free_m);
  }
  return shape.guided_m;
}

// Behind the fork the walls spread with the branches; that of a closed branch leads to the wedge.
void BridgeGuide::KeepInside(sim::PlanePose* pose, const Lane::Place& place,
                             bool short_open) const {
  const double side = place.left_m >= 0 ? 1 : -1;
  double room_m = RoomAt(place.along_m);
  double spread_rad = 0;
  const double beyond_m = place.along_m - lane().length_m();
  if (BeforeFork() && beyond_m > 0) {
    const bool closed = !short_open && (side > 0) == short_on_left();
    spread_rad = closed ? -std::atan2(room_m, arena_->wedge_m()) : BridgeArena::kForkAngle;
    room_m = std::max(0.0, room_m + beyond_m * std::tan(spread_rad));
  }
  const double heading = lane().heading_rad(place.piece);
  double turn = std::remainder(pose->heading_rad - heading, 2 * std::numbers::pi);
  turn = std::clamp(turn, -kMaxTurn, kMaxTurn);
  const double excess_m = std::abs(place.left_m) - room_m;
  if (excess_m > 0) {
    pose->x_m += side * excess_m * std::sin(heading);
    pose->y_m -= side * excess_m * std::cos(heading);
    turn = side > 0 ? std::min(turn, spread_rad) : std::max(turn, -spread_rad);
  }
  pose->heading_rad = heading + turn;
}

void BridgeGuide::Enter(BridgeArena::Corridor corridor) {
  corridor_ = corridor;
  piece_ = 0;
}

void BridgeGuide::Turn(sim::PlanePose* pose) {
  outbound_ = !outbound_;
  piece_ = 0;
  *pose = Start();
}

}  // namespace pheromone::swarm
