// The line of sight between antennas and nodes: pheromone is not sensed through walls.
//
//   SightWindow sight;
//   sight.Load(mask, map, low, high);       // the nodes from `low` to `high`
//   if (sight.any()) {                      // otherwise everything is seen
//     const SightWindow::Viewpoint left = sight.From(antenna);
//     ... sight.Sees(left, node) ...
//   }
//
// A node is seen if the straight segment from the antenna to the node's position does not meet the
// open square, of side a and centred on its node, of any blocked node. So the segment may touch a
// corner or run along a wall; from inside a blocked square nothing is seen, and a blocked node
// never. The antenna may be anywhere, off the map too. All of it is exact, in integers.
//
// Obstacles outside of the window count as absent: the answer is right if the squares that the
// segment goes through are in the window.
//
// How: the segment is followed from the node to the antenna, one row of squares after the other,
// and what it goes through in a row is compared with the row's bitmap in one operation. With the
// antenna at (u, v) um from the node, the segment leaves the node's row at
//
//   p_0 = column + 1/2 + u / (2 |v|),  and each further row at  p_{j+1} = p_j + u / |v|
//
// columns, and of the row between p and q > p it meets the columns floor(p) to ceil(q) - 1. This is
// the traversal of Amanatides and Woo 1987 in runs, as Bresenham 1965 draws lines.
//
// A window is loaded by one thread at a time; const functions may then be called by several. The
// mask is not needed after Load. Windows of up to 64 x 64 nodes need no memory beyond the object;
// larger ones need one bit per node, which is kept for the next Load.
#pragma once

#include <cstdint>
#include <vector>

#include "server/core/field/geometry.h"
#include "server/core/field/obstacles.h"

namespace pheromone::field {

class SightWindow {
 public:
  static constexpr int32_t kSmallSide = 64;

  /// An antenna, prepared for the window as it was loaded when From was called.
  struct Viewpoint {
    int64_t x = 0;  // um from the window's first node
    int64_t y = 0;
    // The square in which a segment ends that comes from the left, or from below. If the antenna is
    // on the border of that square, one that comes from the right, or from above, ends in the next.
    int64_t column = 0;
    int64_t row = 0;
    int64_t column_border = 0;  // 1 or 0
    int64_t row_border = 0;
    bool in_small_window = false;
  };

  /// Copies the blocked nodes from `low` to `high`, both included; low <= high along both axes.
  void Load(const ObstacleMask& mask, const MapGeometry& map, NodeIndex low, NodeIndex high);

  /// Whether anything in the window is blocked. If not, everything is seen.
  bool any() const { return columns_any_ != 0; }

  /// `antenna` is within 2^50 um of the map.
  Viewpoint From(PointUm antenna) const;

  /// `node` is in the window.
  bool Sees(const Viewpoint& antenna, NodeIndex node) const {
    return antenna.in_small_window ? SeesInSmall(antenna, node) : SeesInLarge(antenna, node);
  }
  bool Sees(PointUm antenna, NodeIndex node) const { return Sees(From(antenna), node); }

 private:
  bool is_small() const { return columns_ <= kSmallSide && rows_ <= kSmallSide; }
  bool SeesInSmall(const Viewpoint& antenna, NodeIndex node) const;
  bool SeesInLarge(const Viewpoint& antenna, NodeIndex node) const;
  bool AnyInRow(int64_t row, int64_t first, int64_t last) const;

  NodeIndex first_;
  int32_t columns_ = 0;
  int32_t rows_ = 0;
  int32_t stride_ = 0;  // words a row
  int64_t cell_um_ = 1;
  PointUm first_position_;
  uint64_t columns_any_ = 0;     // bit c: something is blocked in column c, c + 64, ...
  uint64_t small_[kSmallSide];   // a word a row, bit c: column c is blocked; written by Load
  std::vector<uint64_t> large_;  // `stride_` words a row
};

}  // namespace pheromone::field
