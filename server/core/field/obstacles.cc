#include "server/core/field/obstacles.h"

#include <algorithm>

#include "server/base/hash.h"
#include "server/core/field/wide_integer.h"

namespace pheromone::field {
namespace {

int32_t BlocksFor(int32_t nodes) {
  return (nodes - 1) / ObstacleMask::kBlockSide + 1;
}

// In the shapes, lengths are in half micrometres, since half of an odd cell or width is not a whole
// number of micrometres, and are measured from the lower left corner of node (0, 0)'s square.
// Square k then begins at k * side.
struct Lattice {
  explicit Lattice(const MapGeometry& map)
      : corner{2 * map.origin.x - map.cell_um, 2 * map.origin.y - map.cell_um},
        side(2 * map.cell_um) {}
  PointUm From(PointUm point) const { return {2 * point.x - corner.x, 2 * point.y - corner.y}; }

  PointUm corner;
  int64_t side;
};

Int128 FloorDiv(Int128 dividend, Int128 divisor) {
  const Int128 quotient = dividend / divisor;
  return dividend % divisor < 0 ? quotient - 1 : quotient;
}

// The open squares that overlap what lies between `low` and `high` are those from the one that
// `low` is in (or begins) to the one that `high` is in (or ends): none if both are the same border.
int64_t FirstSquare(Int128 low, Int128 side) {
  return static_cast<int64_t>(FloorDiv(low, side));
}
int64_t LastSquare(Int128 high, Int128 side) {
  return static_cast<int64_t>(-FloorDiv(-high, side)) - 1;
}

// The points within `radius` of the line from `a` to `b`.
class Stroke {
 public:
  Stroke(PointUm from, PointUm to, int64_t radius, int64_t side)
      : a_(from.y <= to.y ? from : to),
        b_(from.y <= to.y ? to : from),
        radius_(radius),
        side_(side) {}

  void Block(ObstacleMask* mask) const {
    const int64_t first = std::max<int64_t>(FirstSquare(a_.y - radius_, side_), 0);
    const int64_t last = std::min<int64_t>(LastSquare(b_.y + radius_, side_), mask->rows() - 1);
    for (int64_t row = first; row <= last; ++row) {
      const auto [from, to] = ColumnsIn(row);
      mask->BlockRow(static_cast<int32_t>(row), from, to);
    }
  }

 private:
  struct Columns {
    int64_t first;
    int64_t last;
  };

  // The columns of a row that the stroke overlaps. The search starts from the part of the line
  // nearest to the row, and continues to both sides while the squares are near enough: both shapes
  // are convex, so the squares are contiguous.
  Columns ColumnsIn(int64_t row) const {
    const auto [left, right] = std::minmax(a_.x, b_.x);
    Int128 low = left;
    Int128 high = right;
    Int128 unit = side_;  // a column's width in the unit of low and high
    if (a_.y != b_.y) {
      const Int128 dy = b_.y - a_.y;
      const auto x_at = [&](int64_t y) {
        return a_.x * dy + Int128{b_.x - a_.x} * (std::clamp(y, a_.y, b_.y) - a_.y);
      };
      const Int128 x_low = x_at(row * side_);
      const Int128 x_high = x_at((row + 1) * side_);
      low = std::min(x_low, x_high);
      high = std::max(x_low, x_high);
      unit *= dy;
    }
    if (radius_ == 0) {
      return {FirstSquare(low, unit), LastSquare(high, unit)};
    }
    return {Farthest(FirstSquare(low, unit), FirstSquare(left - radius_, side_), row),
            Farthest(FirstSquare(high, unit), LastSquare(right + radius_, side_), row)};
  }

  // The last overlapping column on the way from `inside`, which overlaps, to `limit`.
  int64_t Farthest(int64_t inside, int64_t limit, int64_t row) const {
    const int64_t step = inside < limit ? 1 : -1;
    while (inside != limit) {
      const int64_t middle = limit - (limit - inside) / 2;
      if (IsNear(middle, row)) {
        inside = middle;
      } else {
        limit = middle - step;
      }
    }
    return inside;
  }

  // Whether a square that the line does not cross is less than the radius away. The shortest way
  // between the two then begins at an end of the line or at a corner of the square.
  bool IsNear(int64_t column, int64_t row) const {
    const PointUm low{column * side_, row * side_};
    const PointUm high{low.x + side_, low.y + side_};
    const Int128 radius2 = Int128{radius_} * radius_;
    for (const PointUm end : {a_, b_}) {
      const Int128 x = std::max({low.x - end.x, end.x - high.x, int64_t{0}});
      const Int128 y = std::max({low.y - end.y, end.y - high.y, int64_t{0}});
      if (x * x + y * y < radius2) {
        return true;
      }
    }
    const Int128 dx = b_.x - a_.x;
    const Int128 dy = b_.y - a_.y;
    const Int128 length2 = dx * dx + dy * dy;
    for (const PointUm corner : {low, PointUm{low.x, high.y}, PointUm{high.x, low.y}, high}) {
      const Int128 x = corner.x - a_.x;
      const Int128 y = corner.y - a_.y;
      const Int128 along = x * dx + y * dy;
      const Int128 across = x * dy - y * dx;  // distance * length
      if (along > 0 && along < length2 && CompareToRoot(across, radius2, length2) < 0) {
        return true;
      }
    }
    return false;
  }

  PointUm a_;  // the lower end
  PointUm b_;
  int64_t radius_;
  int64_t side_;
};

}  // namespace

const ObstacleMask::Block ObstacleMask::kNothing{};

ObstacleMask::ObstacleMask(int32_t columns, int32_t rows)
    : columns_(columns),
      rows_(rows),
      block_columns_(BlocksFor(columns)),
      block_rows_(BlocksFor(rows)),
      blocks_(IndexOf(0, block_rows_)) {}

void ObstacleMask::Set(NodeIndex node, bool blocked) {
  if (blocked) {
    BlockRow(node.row, node.column, node.column);
    return;
  }
  if (!Blocked(node)) {
    return;
  }
  BlockPointer& block = blocks_[IndexOf(node.column >> kBlockBits, node.row >> kBlockBits)];
  (*block)[static_cast<size_t>(node.row % kBlockSide)] &=
      ~(uint64_t{1} << (node.column % kBlockSide));
  --count_;
  if (*block == kNothing) {
    block.reset();
    --used_blocks_;
  }
}

void ObstacleMask::BlockRow(int32_t row, int64_t first_column, int64_t last_column) {
  first_column = std::max<int64_t>(first_column, 0);
  last_column = std::min<int64_t>(last_column, columns_ - 1);
  if (row < 0 || row >= rows_) {
    return;
  }
  while (first_column <= last_column) {
    const int64_t end = std::min(last_column, first_column | (kBlockSide - 1));
    BlockPointer& block =
        blocks_[IndexOf(static_cast<int32_t>(first_column >> kBlockBits), row >> kBlockBits)];
    if (block == nullptr) {
      block = std::make_unique<Block>();
      ++used_blocks_;
    }
    uint64_t& word = (*block)[static_cast<size_t>(row % kBlockSide)];
    const uint64_t before = word;
    word |= ~uint64_t{0} >> (kBlockSide - 1 - (end - first_column)) << (first_column % kBlockSide);
    count_ += static_cast<size_t>(std::popcount(word ^ before));
    first_column = end + 1;
  }
}

uint64_t ObstacleMask::TileBits(int32_t tile_column, int32_t tile_row) const {
  constexpr int kTileBits = 3;
  constexpr int kTilesBits = kBlockBits - kTileBits;  // of a block's side
  constexpr int32_t kTiles = (1 << kTilesBits) - 1;
  const Block& block = BlockAt(tile_column >> kTilesBits, tile_row >> kTilesBits);
  const int32_t shift = (tile_column & kTiles) << kTileBits;
  const auto row = static_cast<size_t>(tile_row & kTiles) << kTileBits;
  uint64_t bits = 0;
  for (size_t i = 0; i < 8; ++i) {
    bits |= (block[row + i] >> shift & 0xFF) << (8 * i);
  }
  return bits;
}

bool ObstacleMask::operator==(const ObstacleMask& other) const {
  const auto same = [](const BlockPointer& a, const BlockPointer& b) {
    return a == nullptr || b == nullptr ? a == b : *a == *b;
  };
  return columns_ == other.columns_ && rows_ == other.rows_ && count_ == other.count_ &&
         std::equal(blocks_.begin(), blocks_.end(), other.blocks_.begin(), same);
}

uint64_t ObstacleMask::Hash() const {
  uint64_t sum = 0;
  ForEach([&](NodeIndex node) {
    sum += Hash64({static_cast<uint64_t>(node.column), static_cast<uint64_t>(node.row)});
  });
  return sum;
}

void BlockRectangle(const MapGeometry& map, PointUm corner, PointUm opposite, ObstacleMask* mask) {
  const Lattice lattice(map);
  const PointUm a = lattice.From(corner);
  const PointUm b = lattice.From(opposite);
  const auto [left, right] = std::minmax(a.x, b.x);
  const auto [bottom, top] = std::minmax(a.y, b.y);
  const int64_t first = std::max<int64_t>(FirstSquare(bottom, lattice.side), 0);
  const int64_t last = std::min<int64_t>(LastSquare(top, lattice.side), mask->rows() - 1);
  for (int64_t row = first; row <= last; ++row) {
    mask->BlockRow(static_cast<int32_t>(row), FirstSquare(left, lattice.side),
                   LastSquare(right, lattice.side));
  }
}

void BlockDisc(const MapGeometry& map, PointUm centre, int64_t radius_um, ObstacleMask* mask) {
  BlockLine(map, {&centre, 1}, 2 * radius_um, mask);
}

void BlockLine(const MapGeometry& map, std::span<const PointUm> points, int64_t width_um,
               ObstacleMask* mask) {
  const Lattice lattice(map);
  for (size_t i = points.size() > 1 ? 1 : 0; i < points.size(); ++i) {
    // Half the width in half micrometres is the width.
    Stroke(lattice.From(points[i > 0 ? i - 1 : 0]), lattice.From(points[i]), width_um, lattice.side)
        .Block(mask);
  }
}

}  // namespace pheromone::field
