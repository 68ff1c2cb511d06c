// The nodes blocked by obstacles, at which nothing can be deposited. A node stands for the square
// of side a (cell) centred on it; it is blocked if its open square overlaps an obstacle at all, so
// that no wall has holes.
//
//   ObstacleMask mask(map.columns(), map.rows());
//   BlockLine(map, {{0, 0}, {5'000'000, 0}}, 100'000, &mask);  // a wall of 5 m x 0.1 m
//   mask.Blocked({3, 0});                                      // true
//
// Sparse: a table with an entry for each 64 x 64 nodes of the map, and bitmaps where something is
// blocked, one word per row. So a map of 30 000 x 30 000 nodes costs 1.8 MB while it is empty, a
// wall half a kilobyte for each 64 nodes of its length, and any mask at most one bit per node and
// the table.
//
// Built once, then shared and never changed (Shared<ObstacleMask> of FieldConfig): any number of
// threads may call const functions. Shapes are evaluated in integers. They may lie partly or wholly
// off the map; coordinates, radii and widths stay within 2^50 um.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/core/field/geometry.h"

namespace pheromone::field {

class ObstacleMask {
 public:
  static constexpr int kBlockBits = 6;
  static constexpr int32_t kBlockSide = 1 << kBlockBits;  ///< in nodes

  /// Row by row from the bottom; bit c of a word: the block's column c is blocked.
  using Block = std::array<uint64_t, kBlockSide>;

  /// For a map of `columns` x `rows` nodes, both at least 1, none of them blocked.
  ObstacleMask(int32_t columns, int32_t rows);

  int32_t columns() const { return columns_; }
  int32_t rows() const { return rows_; }
  bool empty() const { return count_ == 0; }
  size_t count() const { return count_; }  ///< blocked nodes

  /// Blocks or unblocks a node. Nodes off the map are ignored.
  void Set(NodeIndex node, bool blocked = true);

  /// Blocks the nodes of a row from the first to the last column, both included, as far as they
  /// are on the map.
  void BlockRow(int32_t row, int64_t first_column, int64_t last_column);

  /// False off the map.
  bool Blocked(NodeIndex node) const {
    return IsOnMap(node) &&
           (BlockAt(node.column >> kBlockBits,
                    node.row >> kBlockBits)[static_cast<size_t>(node.row % kBlockSide)] >>
                (node.column % kBlockSide) &
            1) != 0;
  }

  /// The 8 x 8 nodes from (8 * tile_column, 8 * tile_row) up, bit 8 * row + column. 0 off the map.
  uint64_t TileBits(int32_t tile_column, int32_t tile_row) const;

  /// 64 x 64 nodes; all 0 off the map.
  const Block& BlockAt(int32_t block_column, int32_t block_row) const {
    const bool on_map = block_column >= 0 && block_column < block_columns_ && block_row >= 0 &&
                        block_row < block_rows_;
    const Block* block = on_map ? blocks_[IndexOf(block_column, block_row)].get() : nullptr;
    return block != nullptr ? *block : kNothing;
  }

  /// Calls `visit(NodeIndex)` for each blocked node: block by block, and row by row in a block.
  template <typename Visit>
  void ForEach(Visit&& visit) const {
    for (size_t i = 0; i < blocks_.size(); ++i) {
      if (blocks_[i] == nullptr) {
        continue;
      }
      const auto block = static_cast<int32_t>(i);
      const int32_t column = block % block_columns_ * kBlockSide;
      int32_t row = block / block_columns_ * kBlockSide;
      for (uint64_t rest : *blocks_[i]) {
        for (; rest != 0; rest &= rest - 1) {
          visit(NodeIndex{column + std::countr_zero(rest), row});
        }
        ++row;
      }
    }
  }

  /// Whether both have the same size and the same blocked nodes.
  bool operator==(const ObstacleMask& other) const;

  /// The sum over the blocked nodes of Hash64({column, row}), modulo 2^64 (server/base/hash.h).
  uint64_t Hash() const;

  /// The memory that it uses, including the heap's overhead: a function of the content alone.
  uint64_t bytes() const { return BytesOf(blocks_.size(), used_blocks_); }

 private:
  using BlockPointer = std::unique_ptr<Block>;
  static constexpr uint64_t kBlockBytes = sizeof(Block) + 16;
  static const Block kNothing;

  static uint64_t BytesOf(uint64_t blocks, uint64_t used_blocks) {
    return sizeof(ObstacleMask) + 16 + blocks * sizeof(BlockPointer) + used_blocks * kBlockBytes;
  }
  bool IsOnMap(NodeIndex node) const {
    return node.column >= 0 && node.column < columns_ && node.row >= 0 && node.row < rows_;
  }
  size_t IndexOf(int32_t block_column, int32_t block_row) const {
    return static_cast<size_t>(block_row) * static_cast<size_t>(block_columns_) +
           static_cast<size_t>(block_column);
  }

  int32_t columns_;
  int32_t rows_;
  int32_t block_columns_;
  int32_t block_rows_;
  std::vector<BlockPointer> blocks_;  // null: nothing is blocked
  size_t used_blocks_ = 0;
  size_t count_ = 0;
};

/// Blocks the nodes whose open squares overlap the rectangle between two opposite corners. A
/// rectangle without area is a line or a point: exactly on the border between squares, it overlaps
/// neither.
void BlockRectangle(const MapGeometry& map, PointUm corner, PointUm opposite, ObstacleMask* mask);

/// Blocks the nodes whose open squares overlap the disc of `radius_um` >= 0.
void BlockDisc(const MapGeometry& map, PointUm centre, int64_t radius_um, ObstacleMask* mask);

/// Blocks the nodes whose open squares overlap the line through `points`: what is within half of
/// `width_um` >= 0 of it, so ends and corners are round. A line without width that runs exactly
/// along the border between squares overlaps neither.
void BlockLine(const MapGeometry& map, std::span<const PointUm> points, int64_t width_um,
               ObstacleMask* mask);

}  // namespace pheromone::field
