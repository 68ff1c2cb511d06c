// Positions and the map. Positions on the server are whole micrometres from the map's origin of
// coordinates, so that comparisons are exact and the same on every machine.
//
// The map is a rectangle cut into square cells of side a. Pheromone sits on the *nodes*, the
// corners of the cells (Susnea et al. 2009, fig. 7): node (0, 0) in the map's lower left corner,
// floor(width / a) + 1 nodes along x, floor(height / a) + 1 along y.
#pragma once

#include <algorithm>
#include <compare>
#include <cstdint>

#include "server/base/fields.h"

namespace pheromone::field {

struct PointUm {
  int64_t x = 0;
  int64_t y = 0;
  bool operator==(const PointUm&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("x", it.x);
    visit("y", it.y);
  }
};

/// The robot's centre and heading, a binary angle, 65 536 a turn, counter-clockwise from +x (ROS
/// REP 103).
struct PoseUm {
  PointUm position;
  uint16_t heading = 0;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("position", it.position);
    visit("heading", it.heading);
  }
};

struct NodeIndex {
  int32_t column = 0;
  int32_t row = 0;
  bool operator==(const NodeIndex&) const = default;
  auto operator<=>(const NodeIndex&) const = default;

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("column", it.column);
    visit("row", it.row);
  }
};

/// A rectangle of nodes, from `begin` up to but not including `end`; empty where an end is not
/// greater than its begin.
struct NodeArea {
  NodeIndex begin;
  NodeIndex end;
  bool operator==(const NodeArea&) const = default;

  bool empty() const { return begin.column >= end.column || begin.row >= end.row; }
  bool Contains(NodeIndex node) const {
    return node.column >= begin.column && node.column < end.column && node.row >= begin.row &&
           node.row < end.row;
  }
  NodeArea Within(const NodeArea& other) const {
    return {{std::max(begin.column, other.begin.column), std::max(begin.row, other.begin.row)},
            {std::min(end.column, other.end.column), std::min(end.row, other.end.row)}};
  }
};

struct MapGeometry {
  static constexpr int64_t kMaxUm = 1'000'000'000'000;  ///< of a side, and from the origin
  static constexpr int64_t kMaxCells = 30'000;          ///< along an axis

  PointUm origin;  ///< the lower left corner
  int64_t width_um = 0;
  int64_t height_um = 0;
  int64_t cell_um = 0;  ///< a
  bool operator==(const MapGeometry&) const = default;

  int32_t columns() const { return static_cast<int32_t>(width_um / cell_um) + 1; }
  int32_t rows() const { return static_cast<int32_t>(height_um / cell_um) + 1; }

  /// Whether a point is on the map, edges included.
  bool Contains(PointUm point) const;

  /// The node nearest to a point of the map, a tie going to the larger coordinate. Between the last
  /// node and an edge that is not a multiple of a, it is the last node.
  NodeIndex NearestNode(PointUm point) const;

  PointUm PositionOf(NodeIndex node) const {
    return {origin.x + node.column * cell_um, origin.y + node.row * cell_um};
  }

  template <typename Self, typename Visit>
  static void Fields(Self& it, Visit&& visit) {
    visit("origin.x", it.origin.x, Within(-kMaxUm, kMaxUm));
    visit("origin.y", it.origin.y, Within(-kMaxUm, kMaxUm));
    visit("width_um", it.width_um, Within(1, kMaxUm));
    visit("height_um", it.height_um, Within(1, kMaxUm));
    visit("cell_um", it.cell_um, Within(1, kMaxUm));
  }
};

/// The quotient rounded towards minus infinity; `divisor` > 0.
inline int64_t FloorDiv(int64_t dividend, int64_t divisor) {
  const int64_t quotient = dividend / divisor;
  return dividend % divisor < 0 ? quotient - 1 : quotient;
}

/// The quotient rounded to nearest, halves away from zero; `divisor` > 0.
inline int64_t RoundDiv(int64_t dividend, int64_t divisor) {
  return dividend < 0 ? -((-dividend + divisor / 2) / divisor) : (dividend + divisor / 2) / divisor;
}

}  // namespace pheromone::field
