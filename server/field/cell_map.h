// The nodes of one pheromone type: a sparse map from node to (level, time).
//
// Nodes live in tiles of 8 x 8 that are made when a deposit first touches them and given back when
// their last node is forgotten, so memory follows the trails and not the size of the map. A
// directory of two levels finds a tile: a top table with a place for each 128 x 128 nodes of the
// map, and leaves with a bitmap of the occupied nodes beside each tile's address, so that a query
// knows which nodes to look at before it touches a tile. Memory is counted in a budget that all
// types share.
//
// One writer (the engine, behind its lock); any number of readers between Enter and Leave of the
// Reclaimer. A reader may see one node before and another one after a change that is under way.
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "server/base/bytes.h"
#include "server/field/geometry.h"
#include "server/field/kernel.h"
#include "server/field/law.h"
#include "server/field/memory.h"
#include "server/field/tile_pool.h"

namespace pheromone::field {

constexpr int kTileBits = 3;
constexpr int32_t kTileSide = 1 << kTileBits;
constexpr int kLeafBits = 4;
constexpr int32_t kLeafSide = 1 << kLeafBits;  ///< in tiles

/// A node's state in a word, and back.
inline uint64_t PackNode(NodeState state) {
  return (uint64_t{state.level} << kTimeBits) | (state.time_ms & kTimeMask);
}
inline NodeState UnpackNode(uint64_t word) {
  return {static_cast<uint32_t>(word >> kTimeBits), word & kTimeMask};
}

class FrozenCells;
struct KeptBytes;

class CellMap {
 public:
  static constexpr size_t kPlaces = size_t{kLeafSide} * kLeafSide;

  struct Place {
    std::atomic<uint64_t> occupied;  ///< bit 8 * row + column: the node's level is not 0
    std::atomic<Tile*> tile;
  };
  struct Leaf {
    std::array<Place, kPlaces> place;
    int tiles = 0;  // the writer's
  };

  /// What they cost, their share of the heap's own memory included.
  static constexpr uint64_t kTileBytes = sizeof(Tile) + 16;
  static constexpr uint64_t kLeafBytes = sizeof(Leaf) + 128;

  /// `columns` x `rows` nodes. The others are shared, and outlive the map.
  CellMap(int32_t columns, int32_t rows, MemoryBudget* budget, Reclaimer* reclaimer,
          TilePool* pool);
  CellMap(const CellMap&) = delete;
  CellMap& operator=(const CellMap&) = delete;
  ~CellMap();

  /// Forgets all nodes, at once and however many there are: budget and counts are those of an
  /// empty map, whose top table stays. Their memory goes to the pool as garbage when no reader can
  /// see it any more.
  void Clear();

  /// The state of a node; level 0 where nothing was ever left.
  NodeState Read(NodeIndex node) const;

  /// Replaces the state of a node. Returns false, changing nothing, when that needs memory that the
  /// budget has not. Writing level 0 forgets the node.
  bool Write(NodeIndex node, NodeState state);

  /// The leaf that holds a tile; null if nothing was left there. Loads with the order that the
  /// Reclaimer asks for.
  const Leaf* FindLeaf(int32_t leaf_column, int32_t leaf_row) const {
    const std::atomic<Leaf*>* top = top_.load();
    return top != nullptr ? top[leaf_row * leaf_columns_ + leaf_column].load() : nullptr;
  }

  /// What a tile would cost that is not there; 0 for one that is. `leaf_counted`,
  /// `top_counted`: the leaf that holds it, or the top table, is paid for.
  uint64_t BytesMissing(int32_t tile_column, int32_t tile_row, bool leaf_counted,
                        bool top_counted) const;

  /// Calls `visit(NodeIndex, NodeState)` for each remembered node, leaf by leaf and tile by tile.
  /// The map may be written to from inside.
  template <typename Visit>
  void ForEach(Visit&& visit) const {
    for (int32_t leaf = 0; leaf < leaf_count(); ++leaf) {
      ForEachInLeaf(leaf, visit);
    }
  }

  /// The same for the leaf in one place of the top table.
  template <typename Visit>
  void ForEachInLeaf(int32_t leaf_index, Visit&& visit) const {
    const int32_t leaf_column = leaf_index % leaf_columns_;
    const int32_t leaf_row = leaf_index / leaf_columns_;
    for (int32_t i = 0; i < kLeafSide * kLeafSide; ++i) {
      // Looked up again for each tile: the visitor may have emptied the leaf.
      const Leaf* leaf = FindLeaf(leaf_column, leaf_row);
      if (leaf == nullptr) {
        return;
      }
      const Place& place = leaf->place[static_cast<size_t>(i)];
      uint64_t rest = place.occupied.load(std::memory_order_acquire);
      const Tile* tile = place.tile.load();
      if (rest == 0 || tile == nullptr) {
        continue;
      }
      const int32_t column = (leaf_column * kLeafSide + i % kLeafSide) * kTileSide;
      const int32_t row = (leaf_row * kLeafSide + i / kLeafSide) * kTileSide;
      std::array<uint64_t, 64> words{};
      for (size_t slot = 0; slot < 64; ++slot) {
        words[slot] = tile->word[slot].load(std::memory_order_relaxed);
      }
      for (; rest != 0; rest &= rest - 1) {
        const int slot = std::countr_zero(rest);
        const NodeState state = UnpackNode(words[static_cast<size_t>(slot)]);
        if (state.level != 0) {
          visit(NodeIndex{column + slot % kTileSide, row + slot / kTileSide}, state);
        }
      }
    }
  }

  /// All that later changes depend on, and back into a map in which nothing was ever written
  /// (state.cc). Budgets are not asked. What cannot be is a failure of the reader.
  void Save(ByteWriter* writer) const;
  void Restore(ByteReader* reader, NodeIndex size, uint32_t max_level);

  /// The map's nodes as they are now, to be copied in portions (frozen_cells.h). At most one at a
  /// time; `kept` outlives it.
  std::unique_ptr<FrozenCells> Freeze(KeptBytes* kept) const;

  int32_t leaf_count() const { return leaf_columns_ * leaf_rows_; }
  size_t node_count() const { return node_count_; }
  size_t tile_count() const { return tile_count_; }
  size_t tiles_in_leaf(int32_t leaf_index) const {
    const Leaf* leaf = FindLeaf(leaf_index % leaf_columns_, leaf_index / leaf_columns_);
    return leaf != nullptr ? static_cast<size_t>(leaf->tiles) : 0;
  }

  /// What the top table of a map costs.
  static uint64_t TopBytes(int32_t columns, int32_t rows);

 private:
  friend class FrozenCells;
  class Removed;

  Place* FindPlace(NodeIndex node) const;
  Place* MakePlace(NodeIndex node);
  uint64_t BytesOfTop() const {
    return static_cast<uint64_t>(leaf_count()) * sizeof(std::atomic<Leaf*>);
  }
  void RemoveTile(NodeIndex node, Place* place);

  int32_t LeafOf(NodeIndex node) const {
    const int32_t row = node.row >> (kTileBits + kLeafBits);
    return row * leaf_columns_ + (node.column >> (kTileBits + kLeafBits));
  }
  std::atomic<Leaf*>* TopOf(NodeIndex node) const {
    return &top_.load(std::memory_order_relaxed)[LeafOf(node)];
  }
  static size_t PlaceOf(NodeIndex node) {
    const int32_t row = (node.row >> kTileBits) % kLeafSide;
    const int32_t index = row * kLeafSide + (node.column >> kTileBits) % kLeafSide;
    return static_cast<size_t>(index);
  }
  static size_t SlotOf(NodeIndex node) {
    const int32_t index = (node.row % kTileSide) * kTileSide + node.column % kTileSide;
    return static_cast<size_t>(index);
  }

  int32_t leaf_columns_;
  int32_t leaf_rows_;
  std::atomic<std::atomic<Leaf*>*> top_{nullptr};  // made at the first deposit, and after Clear
  bool has_top_ = false;                           // it is in the budget: made once, and for ever
  size_t node_count_ = 0;
  size_t tile_count_ = 0;
  size_t present_leaves_ = 0;
  MemoryBudget* budget_;
  Reclaimer* reclaimer_;
  TilePool* pool_;
  mutable FrozenCells* frozen_ = nullptr;  // what is being copied: asked before each change
};

}  // namespace pheromone::field
