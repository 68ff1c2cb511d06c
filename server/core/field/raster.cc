#include "server/core/field/raster.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <string>
#include <tuple>

#include "server/core/field/cell_map.h"
#include "server/core/field/wide_integer.h"

namespace pheromone::field {
namespace {

// Columns or rows, both ends included; empty if the first is beyond the last.
struct Span {
  int64_t first = 0;
  int64_t last = -1;
  bool empty() const { return first > last; }
};

// The quotient rounded towards minus infinity; `divisor` > 0. Numbers of 64 bits are the usual case
// and several times faster to divide.
Int128 FloorDivWide(Int128 dividend, Int128 divisor) {
  if (dividend == static_cast<int64_t>(dividend) && divisor == static_cast<int64_t>(divisor)) {
    return FloorDiv(static_cast<int64_t>(dividend), static_cast<int64_t>(divisor));
  }
  const Int128 quotient = dividend / divisor;
  return dividend % divisor < 0 ? quotient - 1 : quotient;
}

// The elements of `span` whose value index * step + start is between `low` and `high`.
Span Clip(Span span, Int128 step, Int128 start, Int128 low, Int128 high) {
  low -= start;
  high -= start;
  if (step < 0) {
    step = -step;
    std::swap(low, high);
    low = -low;
    high = -high;
  }
  if (step == 0) {
    return low <= 0 && high >= 0 ? span : Span{};
  }
  const Int128 first = std::max<Int128>(span.first, -FloorDivWide(-low, step));
  const Int128 last = std::min<Int128>(span.last, FloorDivWide(high, step));
  return first > last ? Span{} : Span{static_cast<int64_t>(first), static_cast<int64_t>(last)};
}

// The points within a radius of a segment: two discs, and between them a rectangle along the
// segment. The shape is convex, so its intersection with a row is one interval, and so are its
// nodes.
class Capsule {
 public:
  Capsule(PointUm a, PointUm b, int64_t radius, const MapGeometry& map)
      : map_(&map),
        a_(a),
        b_(b),
        radius2_(Int128{radius} * radius),
        dx_(b.x - a.x),
        dy_(b.y - a.y),
        length2_(dx_ * dx_ + dy_ * dy_),
        across_limit_(FloorRoot(radius2_, length2_)) {
    const auto [left, right] = std::minmax(a.x, b.x);
    const auto [bottom, top] = std::minmax(a.y, b.y);
    rows_ = Clip({0, map.rows() - 1}, map.cell_um, map.origin.y, Int128{bottom} - radius,
                 Int128{top} + radius);
    if (Clip(AllColumns(), map.cell_um, map.origin.x, Int128{left} - radius, Int128{right} + radius)
            .empty()) {
      rows_ = {};
    }
  }

  /// The rows that may have a node.
  Span rows() const { return rows_; }

  Span ColumnsIn(int64_t row) const {
    const int64_t y = map_->origin.y + row * map_->cell_um;
    Span columns = InRectangle(y - a_.y);
    for (const PointUm end : {a_, b_}) {
      const Span disc = InDisc(end, y - end.y);
      if (columns.empty()) {
        columns = disc;
      } else if (!disc.empty()) {
        columns = {std::min(columns.first, disc.first), std::max(columns.last, disc.last)};
      }
    }
    return columns;
  }

 private:
  Span AllColumns() const { return {0, map_->columns() - 1}; }

  Span InDisc(PointUm centre, int64_t y) const {
    const Int128 x2 = radius2_ - Int128{y} * y;
    if (x2 < 0) {
      return {};
    }
    const int64_t x = FloorRoot(x2);
    return Clip(AllColumns(), map_->cell_um, map_->origin.x - centre.x, -x, x);
  }

  // The points at `y` above the segment's first end whose perpendicular foot is on the segment, and
  // whose distance times the segment's length, an integer, is at most the limit.
  Span InRectangle(int64_t y) const {
    if (length2_ == 0) {
      return {};
    }
    const Int128 x = map_->origin.x - a_.x;  // of column 0, from the segment's first end
    const Span columns =
        Clip(AllColumns(), map_->cell_um * dy_, x * dy_ - y * dx_, -across_limit_, across_limit_);
    const Int128 step = map_->cell_um * dx_;
    const Int128 start = x * dx_ + y * dy_;
    const auto is_beside = [&](int64_t column) {
      const Int128 along = column * step + start;
      return along >= 0 && along <= length2_;
    };
    // In most rows the ends are far away, which saves two divisions.
    const bool is_inside = columns.empty() || (is_beside(columns.first) && is_beside(columns.last));
    return is_inside ? columns : Clip(columns, step, start, 0, length2_);
  }

  const MapGeometry* map_;
  PointUm a_;
  PointUm b_;
  Int128 radius2_;
  Int128 dx_;
  Int128 dy_;
  Int128 length2_;
  Int128 across_limit_;
  Span rows_;
};

// Sorts the spans of one row and joins those that overlap or touch.
class RowOfSpans {
 public:
  void Add(Span span) { spans_.push_back(span); }

  /// Calls visit(span) for each joined span from left to right, and begins the next row. Returns
  /// the number of steps.
  template <typename Visit>
  int64_t Take(Visit&& visit) {
    Span joined;
    const auto join = [&](Span span) {
      if (joined.empty() || span.first > joined.last + 1) {
        if (!joined.empty()) {
          visit(joined);
        }
        joined = span;
      } else {
        joined.last = std::max(joined.last, span.last);
      }
    };
    const int64_t steps = InOrder(join);
    if (!joined.empty()) {
      visit(joined);
    }
    spans_.clear();
    return steps;
  }

 private:
  // A few spans are sorted. Many are stored at the column where they begin, and found by scanning
  // the row.
  template <typename Visit>
  int64_t InOrder(Visit&& visit) {
    const auto by_first = [](Span a, Span b) { return a.first < b.first; };
    if (spans_.size() < 2) {
      std::for_each(spans_.begin(), spans_.end(), visit);
      return 0;
    }
    const auto [left, right] = std::minmax_element(spans_.begin(), spans_.end(), by_first);
    const Span begins{left->first, right->first};
    const auto count = static_cast<uint64_t>(spans_.size());
    const auto to_sort = static_cast<int64_t>(count * static_cast<uint64_t>(std::bit_width(count)));
    if (begins.last - begins.first > 4 * to_sort) {
      std::sort(spans_.begin(), spans_.end(), by_first);
      std::for_each(spans_.begin(), spans_.end(), visit);
      return to_sort;
    }
    lasts_.assign(static_cast<size_t>(begins.last - begins.first + 1), -1);
    for (const Span span : spans_) {
      int64_t& last = lasts_[static_cast<size_t>(span.first - begins.first)];
      last = std::max(last, span.last);
    }
    for (size_t i = 0; i < lasts_.size(); ++i) {
      if (lasts_[i] >= 0) {
        visit(Span{begins.first + static_cast<int64_t>(i), lasts_[i]});
      }
    }
    return std::ssize(spans_) + std::ssize(lasts_);
  }

  std::vector<Span> spans_;
  std::vector<int64_t> lasts_;
};

Error TooMany(int64_t nodes) {
  return Error{"the edit touches " + std::to_string(nodes) + " nodes, expected at most " +
               std::to_string(kMaxNodesOfEdit) + ": make it in parts"};
}

Result<Raster> RasterOfRectangle(PointUm low, PointUm high, const MapGeometry& map) {
  const Span columns = Clip({0, map.columns() - 1}, map.cell_um, map.origin.x, low.x, high.x);
  const Span rows = Clip({0, map.rows() - 1}, map.cell_um, map.origin.y, low.y, high.y);
  Raster raster;
  if (columns.empty() || rows.empty()) {
    return raster;
  }
  raster.node_count = (columns.last - columns.first + 1) * (rows.last - rows.first + 1);
  if (raster.node_count > kMaxNodesOfEdit) {
    return TooMany(raster.node_count);
  }
  for (int64_t row = rows.first; row <= rows.last; ++row) {
    raster.runs.push_back({static_cast<int32_t>(row), static_cast<int32_t>(columns.first),
                           static_cast<int32_t>(columns.last)});
  }
  return raster;
}

Result<Raster> RasterOfStroke(const FieldEdit& edit, const MapGeometry& map) {
  std::vector<Capsule> capsules;
  for (size_t i = edit.points.size() > 1 ? 1 : 0; i < edit.points.size(); ++i) {
    const Capsule capsule(edit.points[i > 0 ? i - 1 : 0], edit.points[i], edit.radius_um, map);
    if (!capsule.rows().empty()) {
      capsules.push_back(capsule);
    }
  }
  std::sort(capsules.begin(), capsules.end(),
            [](const Capsule& a, const Capsule& b) { return a.rows().first < b.rows().first; });
  Raster raster;
  RowOfSpans spans;
  std::vector<const Capsule*> in_row;
  size_t begun = 0;
  for (int64_t row = 0; begun < capsules.size() || !in_row.empty(); ++row) {
    if (in_row.empty()) {
      row = std::max(row, capsules[begun].rows().first);
    }
    while (begun < capsules.size() && capsules[begun].rows().first <= row) {
      in_row.push_back(&capsules[begun++]);
    }
    for (const Capsule* capsule : in_row) {
      const Span columns = capsule->ColumnsIn(row);
      ++raster.steps;
      if (!columns.empty()) {
        spans.Add(columns);
      }
      if (columns.first == 0 && columns.last == map.columns() - 1) {
        break;
      }
    }
    raster.steps += spans.Take([&](Span columns) {
      raster.node_count += columns.last - columns.first + 1;
      if (raster.node_count <= kMaxNodesOfEdit) {
        raster.runs.push_back({static_cast<int32_t>(row), static_cast<int32_t>(columns.first),
                               static_cast<int32_t>(columns.last)});
      }
    });
    std::erase_if(in_row, [row](const Capsule* capsule) { return capsule->rows().last <= row; });
  }
  if (raster.node_count > kMaxNodesOfEdit) {
    return TooMany(raster.node_count);
  }
  return raster;
}

void FindTiles(Raster* raster) {
  RowOfSpans spans;
  for (size_t i = 0; i < raster->runs.size();) {
    const int32_t row = raster->runs[i].row >> kTileBits;
    for (; i < raster->runs.size() && raster->runs[i].row >> kTileBits == row; ++i) {
      spans.Add({raster->runs[i].first >> kTileBits, raster->runs[i].last >> kTileBits});
    }
    raster->steps += spans.Take([&](Span columns) {
      for (int64_t column = columns.first; column <= columns.last; ++column) {
        raster->tiles.push_back({static_cast<int32_t>(column), row});
      }
    });
  }
  const auto key = [](TileIndex tile) {
    return std::tuple(tile.row / kLeafSide, tile.column / kLeafSide, tile.row, tile.column);
  };
  std::sort(raster->tiles.begin(), raster->tiles.end(),
            [key](TileIndex a, TileIndex b) { return key(a) < key(b); });
}

}  // namespace

Result<Raster> RasterOf(const FieldEdit& edit, const MapGeometry& map) {
  const size_t least = edit.shape == FieldEdit::Shape::kRectangle ? 2
                       : edit.shape == FieldEdit::Shape::kStroke  ? 1
                                                                  : 0;
  if (edit.points.size() < least || edit.radius_um < 0) {
    return Error{"an edit without its points: a rectangle has two, a stroke at least one"};
  }
  PointUm low = map.origin;
  PointUm high{map.origin.x + map.width_um, map.origin.y + map.height_um};
  if (edit.shape == FieldEdit::Shape::kRectangle) {
    low = high = edit.points.front();
    for (const PointUm point : edit.points) {
      low = {std::min(low.x, point.x), std::min(low.y, point.y)};
      high = {std::max(high.x, point.x), std::max(high.y, point.y)};
    }
  }
  Result<Raster> raster = edit.shape == FieldEdit::Shape::kStroke
                              ? RasterOfStroke(edit, map)
                              : RasterOfRectangle(low, high, map);
  if (raster.ok()) {
    FindTiles(&raster.value());
  }
  return raster;
}

}  // namespace pheromone::field
