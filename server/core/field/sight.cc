#include "server/core/field/sight.h"

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdlib>

namespace pheromone::field {
namespace {

constexpr int kWordBits = 64;
static_assert(ObstacleMask::kBlockSide == kWordBits, "a row of a block is a word");

// In small windows columns are fixed-point numbers. It only matters on which side of a whole number
// p lies, and p is a multiple of 1 / (2v): any value nearer to p than that is sufficient, once it
// is moved to the side on which p itself would count. With v < 2^27 the steps are wider than 2^-28.
// A slope is too small by less than 2^-37 and is added at most 63 times, half of it and another
// rounding once: so p is wrong by less than the margin of 2^-30, and the two together are below
// 2^-29.
constexpr int kFractionBits = 37;
constexpr int64_t kMargin = 128;
constexpr int64_t kMaxCellOfSmall = int64_t{1} << 21;  // 63 cells are then below 2^27

// The bits `first` to `last` of a word, 0 <= first <= last < 64, pushed to the word's upper end.
uint64_t Between(uint64_t word, int64_t first, int64_t last) {
  return word >> first << ((first - last - 1) & (kWordBits - 1));
}

}  // namespace

void SightWindow::Load(const ObstacleMask& mask, const MapGeometry& map, NodeIndex low,
                       NodeIndex high) {
  assert(low.column <= high.column && low.row <= high.row);
  first_ = low;
  columns_ = high.column - low.column + 1;
  rows_ = high.row - low.row + 1;
  stride_ = (columns_ - 1) / kWordBits + 1;
  cell_um_ = map.cell_um;
  first_position_ = map.PositionOf(low);

  uint64_t* words = small_;
  if (!is_small()) {
    large_.resize(static_cast<size_t>(stride_) * static_cast<size_t>(rows_));
    words = large_.data();
  }
  columns_any_ = 0;
  const int shift = low.column & (kWordBits - 1);
  for (int32_t word = 0; word < stride_; ++word) {
    const int32_t block_column = (low.column >> ObstacleMask::kBlockBits) + word;
    const int beyond = std::max((word + 1) * kWordBits - columns_, 0);
    const uint64_t inside = ~uint64_t{0} >> beyond;
    uint64_t any = 0;
    for (int32_t row = low.row; row <= high.row;) {
      const int32_t block_row = row >> ObstacleMask::kBlockBits;
      const int32_t last = std::min(high.row, row | (kWordBits - 1));
      const uint64_t* left = mask.BlockAt(block_column, block_row).data();
      const uint64_t* right = mask.BlockAt(block_column + 1, block_row).data();
      uint64_t* to = words + ptrdiff_t{row - low.row} * stride_ + word;
      for (int i = row & (kWordBits - 1); row <= last; ++row, ++i, to += stride_) {
        // To the left in two steps: a shift by 64 has no meaning.
        *to = (left[i] >> shift | right[i] << 1 << (kWordBits - 1 - shift)) & inside;
        any |= *to;
      }
    }
    columns_any_ |= any;
  }
}

SightWindow::Viewpoint SightWindow::From(PointUm antenna) const {
  Viewpoint at;
  at.x = antenna.x - first_position_.x;
  at.y = antenna.y - first_position_.y;
  // Squares begin half a cell before their node: in half micrometres, for the cell may be odd.
  const int64_t side = 2 * cell_um_;
  const int64_t column = FloorDiv(2 * at.x + cell_um_, side);
  const int64_t row = FloorDiv(2 * at.y + cell_um_, side);
  at.column_border = 2 * at.x + cell_um_ == column * side ? 1 : 0;
  at.row_border = 2 * at.y + cell_um_ == row * side ? 1 : 0;
  at.column = column - at.column_border;
  at.row = row - at.row_border;
  at.in_small_window = is_small() && cell_um_ <= kMaxCellOfSmall && at.column >= 0 &&
                       column < columns_ && at.row >= 0 && row < rows_;
  return at;
}

// Without branches where possible: the processor cannot predict on which side a node lies.
bool SightWindow::SeesInSmall(const Viewpoint& antenna, NodeIndex node) const {
  const int64_t column = int64_t{node.column} - first_.column;
  const int64_t row = int64_t{node.row} - first_.row;
  assert(column >= 0 && column < columns_ && row >= 0 && row < rows_);
  const int64_t dx = antenna.x - column * cell_um_;
  const int64_t dy = antenna.y - row * cell_um_;
  const int64_t left = dx >> 63;  // -1: the antenna is to the left of the node; or 0
  const int64_t down = dy >> 63;
  const auto negated_if = [](int64_t value, int64_t sign) { return (value ^ sign) - sign; };

  // All is between the node's column and the antenna's.
  const int64_t across = antenna.column + (left & antenna.column_border) - column;
  const int64_t low = column + (across & left);
  const int64_t high = column + (across & ~left);
  if (Between(columns_any_, low, high) == 0) {
    return true;
  }
  const uint64_t* words = small_ + row;
  int64_t crossings = negated_if(antenna.row + (down & antenna.row_border) - row, down);
  if (crossings == 0) {
    return Between(*words, low, high) == 0;
  }

  const auto u = static_cast<uint64_t>(negated_if(dx, left));
  const auto v = static_cast<uint64_t>(negated_if(dy, down));
  const auto steepness = static_cast<int64_t>((u << kFractionBits) / v);
  const int64_t slope = negated_if(steepness, left);
  const int64_t exit = ((2 * column + 1) << (kFractionBits - 1)) + (slope >> 1);  // p_0
  // The row's two ends, lower one first; the node's row as if the segment came from beyond it.
  int64_t from = exit - (slope & ~left) + kMargin;
  int64_t to = exit - (slope & left) - kMargin;
  const ptrdiff_t up = down | 1;
  uint64_t hits = 0;
  do {
    hits |=
        Between(*words, std::max(from >> kFractionBits, low), std::min(to >> kFractionBits, high));
    from += slope;
    to += slope;
    words += up;
  } while (--crossings >= 0);
  return hits == 0;
}

// The same for windows, cells and distances of any size, with quotients and remainders.
bool SightWindow::SeesInLarge(const Viewpoint& antenna, NodeIndex node) const {
  const int64_t column = int64_t{node.column} - first_.column;
  int64_t row = int64_t{node.row} - first_.row;
  assert(column >= 0 && column < columns_ && row >= 0 && row < rows_);
  const int64_t dx = antenna.x - column * cell_um_;
  const int64_t dy = antenna.y - row * cell_um_;
  const bool left = dx < 0;
  const int64_t up = dy < 0 ? -1 : 1;
  // Columns are counted from the node's towards the antenna.
  const int64_t end =
      left ? column - antenna.column - antenna.column_border : antenna.column - column;
  int64_t crossings = dy < 0 ? row - antenna.row - antenna.row_border : antenna.row - row;
  int64_t first = 0;
  if (crossings > 0) {
    const int64_t u = std::abs(dx);
    const int64_t v = std::abs(dy);
    const int64_t quotient = u / v;
    const int64_t remainder = u % v;
    // The row ends at p = whole + part / (2v): at first 1/2 + u / (2v).
    int64_t whole = quotient / 2;
    int64_t part = v + remainder + (quotient % 2) * v;
    for (; crossings > 0; --crossings) {
      const int64_t carry = (2 * v - 1 - part) >> 63;  // -1 if part >= 2v; or 0
      whole -= carry;
      part -= 2 * v & carry;
      const int64_t last = whole - (part == 0 ? 1 : 0);
      if (AnyInRow(row, left ? column - last : column + first,
                   left ? column - first : column + last)) {
        return false;
      }
      row += up;
      if (row < 0 || row >= rows_) {
        return true;  // it does not come back
      }
      first = whole;
      whole += quotient;
      part += 2 * remainder;
    }
  }
  return !AnyInRow(row, left ? column - end : column + first, left ? column - first : column + end);
}

// From the first to the last column, as far as they are in the window.
bool SightWindow::AnyInRow(int64_t row, int64_t first, int64_t last) const {
  first = std::max<int64_t>(first, 0);
  last = std::min<int64_t>(last, columns_ - 1);
  if (first > last) {
    return false;
  }
  const uint64_t* words = (is_small() ? small_ : large_.data()) + row * stride_;
  const int64_t last_word = last >> 6;
  int64_t word = first >> 6;
  if (word == last_word) {
    return Between(words[word], first & 63, last & 63) != 0;
  }
  uint64_t hits = Between(words[word], first & 63, 63);
  while (++word < last_word) {
    hits |= words[word];
  }
  return (hits | Between(words[word], 0, last & 63)) != 0;
}

}  // namespace pheromone::field
