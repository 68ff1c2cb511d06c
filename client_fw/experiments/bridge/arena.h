// The double bridge: nest and food, and between them two branches, one twice as long as the other
// (Goss et al. 1989; fig. 2 of Susnea et al. 2009), as corridors for robots.
//
//                 ,----- short -----.
//   nest --- stem <  45 degrees      > stem --- food
//                 |                 |
//                 `----- long ------'
//
//   const BridgeArena arena({});
//   BridgeGuide guide(&arena);               // of a robot that leaves the nest
//   ... the robot moves by itself: pose ...
//   switch (guide.Hold(&pose, /*short_open=*/true)) { ... }
//
// Where there is no choice, the corridors guide: they are little wider than the robots' tracks, so
// that robots drive along the middle as on a rail. At a fork a robot drives freely: there the stem
// is wide and opens into both branches, which leave it at the same angle; the side on which the
// robot passes the wedge between them decides which one it enters. A robot that touches a wall
// slides along it, turned parallel to it, and cannot turn back.
//
// Within the antennas' reach of a robot before a fork, the branches are mirror images. The short
// one is on the left on the way to the food and on the right on the way back, so that a preference
// for a side does not look like one for a branch.
//
// Corridors rather than a guiding pheromone: TRACE deposits the type that it senses, and a blend of
// guide and trail accepts no deposits.
//
// Units: metres, radians, headings counter-clockwise from +x. Pure; an arena may be shared.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "client_fw/sim/differential_drive.h"

namespace pheromone::swarm {

enum class Branch : uint8_t { kShort, kLong };

struct BridgeShape {
  double nest_x_m = 1.0;    ///< the stems' line is parallel to x
  double axis_y_m = 3.4;    ///< its height on the map
  double stem_m = 1.0;      ///< from nest or food to the fork
  double span_m = 3.0;      ///< from fork to fork
  double ratio = 2;         ///< of the branches' lengths
  double approach_m = 0.4;  ///< before a fork, where robots drive freely
  double free_m = 0.14;     ///< half the width there; not halfway between rows of nodes
  double guided_m = 0.03;   ///< half the width elsewhere
  double bend_m = 0.3;      ///< radius of the corridors' bends
};

/// A directed centre line, in straight pieces.
class Lane {
 public:
  struct Point {
    double x_m = 0;
    double y_m = 0;
  };

  explicit Lane(const std::vector<Point>& points);

  Lane Reversed() const;
  double length_m() const { return along_.back(); }
  const std::vector<Point>& points() const { return points_; }
  size_t pieces() const { return points_.size() - 1; }
  double heading_rad(size_t piece) const { return headings_[piece]; }
  /// The pose on the line; beyond an end on its straight continuation.
  sim::PlanePose At(double along_m) const;

  /// A position in the coordinates of the lane.
  struct Place {
    size_t piece = 0;
    double along_m = 0;
    double left_m = 0;
  };
  /// The position of a point, searched from `piece` on: a robot does not go back.
  Place Locate(double x_m, double y_m, size_t piece) const;

 private:
  std::vector<Point> points_;
  std::vector<double> along_;     // at each point
  std::vector<double> headings_;  // of each piece
};

class BridgeArena {
 public:
  enum Corridor : uint8_t { kNestStem, kShortBranch, kLongBranch, kFoodStem };
  static constexpr size_t kCorridors = 4;
  static constexpr double kForkAngle = 0.78539816339744831;  ///< of each branch with the stem

  /// Requires a ratio of 1, which makes the branches mirror images, or of at least 1.5, which is
  /// room for the long one's bends.
  explicit BridgeArena(const BridgeShape& shape);

  const BridgeShape& shape() const { return shape_; }
  const Lane& lane(Corridor corridor, bool outbound) const {
    return lanes_[2 * size_t{corridor} + (outbound ? 0 : 1)];
  }
  /// From fork to fork.
  double length_m(Branch branch) const {
    return lane(branch == Branch::kShort ? kShortBranch : kLongBranch, true).length_m();
  }
  /// How far behind the fork the wedge between the branches begins.
  double wedge_m() const;

 private:
  BridgeShape shape_;
  std::vector<Lane> lanes_;
};

/// The corridors around one robot, and its position in them.
class BridgeGuide {
 public:
  enum class Step : uint8_t {
    kNone,
    kChose,    ///< passed the wedge and entered branch()
    kCrossed,  ///< left it at the other end
    kArrived,  ///< at the end of a stem: Turn must be called next
  };

  /// The robot stands at the nest and faces the fork: Start(). `arena` outlives the guide.
  explicit BridgeGuide(const BridgeArena* arena) : arena_(arena) {}

  sim::PlanePose Start() const { return lane().At(0); }

  /// Holds a robot that has moved to `pose` within the walls. A branch that is not open is walled
  /// off at the fork.
  Step Hold(sim::PlanePose* pose, bool short_open);

  /// Turns a robot that has arrived: `pose` is the end of the stem, facing the fork.
  void Turn(sim::PlanePose* pose);

  /// To the food; false: to the nest.
  bool outbound() const { return outbound_; }
  BridgeArena::Corridor corridor() const { return corridor_; }
  /// Which side of a robot before the fork the short branch is on.
  bool short_on_left() const { return outbound_; }
  bool on_branch() const {
    return corridor_ == BridgeArena::kShortBranch || corridor_ == BridgeArena::kLongBranch;
  }
  /// Meaningful on a branch.
  Branch branch() const {
    return corridor_ == BridgeArena::kShortBranch ? Branch::kShort : Branch::kLong;
  }

 private:
  const Lane& lane() const { return arena_->lane(corridor_, outbound_); }
  bool BeforeFork() const;
  double RoomAt(double along_m) const;
  void KeepInside(sim::PlanePose* pose, const Lane::Place& place, bool short_open) const;
  void Enter(BridgeArena::Corridor corridor);

  const BridgeArena* arena_;
  BridgeArena::Corridor corridor_ = BridgeArena::kNestStem;
  bool outbound_ = true;
  size_t piece_ = 0;
};

}  // namespace pheromone::swarm
