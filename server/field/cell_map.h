// The nodes of one pheromone type: a sparse map from node to (count, time).
//
// Nodes live in tiles of 8 x 8 that are made when a deposit first touches them, so memory follows
// the trails and not the size of the map, and given back when their last node is forgotten. The
// number of tiles is bounded by a budget which all types share.
//
// Not thread-safe: one owner (the engine, behind its lock).
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <unordered_map>

#include "server/field/geometry.h"
#include "server/field/law.h"

namespace pheromone::field {

/// How many tiles may exist, over all types.
struct TileBudget {
  size_t limit = 0;
  size_t used = 0;
};

class CellMap {
 public:
  static constexpr int kTileBits = 3;
  static constexpr int32_t kTileSide = 1 << kTileBits;

  /// `budget` is shared and outlives the map.
  explicit CellMap(TileBudget* budget) : budget_(budget) {}

  /// The state of a node; count 0 where nothing was ever left.
  NodeState Read(NodeIndex node) const;

  /// Replaces the state of a node. Returns false, changing nothing, when that needs a new tile and
  /// the budget is exhausted. Writing count 0 forgets the node.
  bool Write(NodeIndex node, NodeState state);

  /// Calls `visit(NodeIndex, NodeState)` for each remembered node, in no particular order.
  template <typename Visit>
  void ForEach(Visit&& visit) const {
    for (const auto& [key, tile] : tiles_) {
      VisitTile(key, tile, visit);
    }
  }

  /// The same for the remembered nodes of the rectangle between two nodes, both included.
  template <typename Visit>
  void ForEachIn(NodeIndex low, NodeIndex high, Visit&& visit) const {
    for (int32_t row = low.row >> kTileBits; row <= high.row >> kTileBits; ++row) {
      for (int32_t column = low.column >> kTileBits; column <= high.column >> kTileBits; ++column) {
        const auto found = tiles_.find(KeyOf(column, row));
        if (found == tiles_.end()) {
          continue;
        }
        VisitTile(found->first, found->second, [&](NodeIndex node, NodeState state) {
          if (node.column >= low.column && node.column <= high.column && node.row >= low.row &&
              node.row <= high.row) {
            visit(node, state);
          }
        });
      }
    }
  }

  size_t node_count() const { return node_count_; }
  size_t tile_count() const { return tiles_.size(); }

  /// What one tile costs, its share of the directory included.
  static constexpr size_t kTileBytes = 64 * (sizeof(uint64_t) + sizeof(uint16_t)) + 64;

 private:
  struct Tile {
    std::array<uint64_t, 64> time_ms{};
    std::array<uint16_t, 64> count{};
    uint64_t occupied = 0;  // bit i: count[i] > 0
  };

  static uint64_t KeyOf(int32_t tile_column, int32_t tile_row) {
    return (static_cast<uint64_t>(static_cast<uint32_t>(tile_row)) << 32) |
           static_cast<uint32_t>(tile_column);
  }
  static uint64_t KeyOf(NodeIndex node) {
    return KeyOf(node.column >> kTileBits, node.row >> kTileBits);
  }
  static size_t SlotOf(NodeIndex node) {
    const auto row = static_cast<size_t>(node.row % kTileSide);
    return row * kTileSide + static_cast<size_t>(node.column % kTileSide);
  }

  template <typename Visit>
  static void VisitTile(uint64_t key, const Tile& tile, Visit&& visit) {
    const auto column = static_cast<int32_t>(static_cast<uint32_t>(key)) << kTileBits;
    const auto row = static_cast<int32_t>(key >> 32) << kTileBits;
    for (uint64_t rest = tile.occupied; rest != 0; rest &= rest - 1) {
      const int slot = std::countr_zero(rest);
      const auto at = static_cast<size_t>(slot);
      visit(NodeIndex{column + slot % kTileSide, row + slot / kTileSide},
            NodeState{tile.count[at], tile.time_ms[at]});
    }
  }

  void EraseIfEmpty(std::unordered_map<uint64_t, Tile>::iterator tile);

  std::unordered_map<uint64_t, Tile> tiles_;
  size_t node_count_ = 0;
  TileBudget* budget_;
};

}  // namespace pheromone::field
