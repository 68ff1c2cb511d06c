// The nodes of one pheromone type: a sparse map from node to (level, time).
//
// Nodes are stored in tiles of 8 x 8 that are allocated by the first deposit on them and released
// when their last node is removed, so memory use follows the trails and not the size of the map. A
// directory of two levels finds a tile: a top table with an entry for each 128 x 128 nodes of the
// map, and leaves with a bitmap of the occupied nodes beside each tile's address, so that a query
// knows which nodes to read before it touches a tile. Memory is counted in a budget shared by all
// types.
//
// Changes are numbered, and each tile keeps the number of its last change, so that a viewer can ask
// for the tiles that have changed since its last look (VisitChanged). Evaporation does not count as
// a change, since it follows from the law; neither does the removal of evaporated nodes by a sweep.
//
// One writer (the engine, behind its lock); any number of readers between Enter and Leave of the
// Reclaimer. A reader may see one node before and another one after a change that is in progress.
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "server/base/bytes.h"
#include "server/core/field/geometry.h"
#include "server/core/field/kernel.h"
#include "server/core/field/law.h"
#include "server/core/field/memory.h"
#include "server/core/field/tile_pool.h"

namespace pheromone::field {

constexpr int kTileBits = 3;
constexpr int32_t kTileSide = 1 << kTileBits;
constexpr int kLeafBits = 4;
constexpr int32_t kLeafSide = 1 << kLeafBits;  ///< in tiles

/// Packs a node's state into a word, and unpacks it.
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
    // Change numbers: the last one of any tile of this leaf, and of its removed tiles.
    std::atomic<uint64_t> changed;
    std::atomic<uint64_t> emptied;
  };

  /// The memory accounted for each. It decides which deposits a full map refuses, so other values
  /// would change the replay of existing logs: everything stored with a tile or leaf must fit.
  static constexpr uint64_t kTileBytes = 528;
  static constexpr uint64_t kLeafBytes = 4232;
  static_assert(sizeof(Leaf) <= TilePool::kLeafBytes && TilePool::kLeafBytes <= kLeafBytes);
  static_assert(BlockPool::kChunkBytes / TilePool::kTilesPerChunk < kTileBytes);

  /// `columns` x `rows` nodes. The other arguments are shared, and outlive the map.
  CellMap(int32_t columns, int32_t rows, MemoryBudget* budget, Reclaimer* reclaimer,
          TilePool* pool);
  CellMap(const CellMap&) = delete;
  CellMap& operator=(const CellMap&) = delete;
  ~CellMap();

  /// Removes all nodes, at once and however many there are: budget and counts are then those of an
  /// empty map, which keeps its top table. All nodes count as changed. Their memory is passed to
  /// the pool as garbage once no reader can see it.
  void Clear();

  /// The state of a node; level 0 where nothing was ever deposited.
  NodeState Read(NodeIndex node) const;

  /// Replaces the state of a node. Returns false, changing nothing, if this needs memory beyond the
  /// budget. Writing level 0 removes the node.
  bool Write(NodeIndex node, NodeState state);

  /// Removes a node whose content has evaporated; this does not count as a change.
  void Forget(NodeIndex node);

  /// Marks all nodes, including absent ones, as changed: their law has changed, or their content is
  /// in another layer.
  void MarkAll();

  /// The result of VisitChanged.
  struct Changes {
    uint64_t number = 0;  ///< `since` of the next call
    bool all = false;     ///< anything may have changed
  };
  /// Calls `visit(NodeArea)` for each part of `area`, which lies in the map, that may have changed
  /// after change number `since`; 0 for the first call. A part is a tile or larger. Removed tiles
  /// may be reported again, in larger parts, when others beside them are removed. Read the nodes
  /// during or after the call. Any thread, between Enter and Leave; the numbers belong to this
  /// object.
  template <typename Visit>
  Changes VisitChanged(const NodeArea& area, uint64_t since, Visit&& visit) const {
    // All loads after this one see the stamps of all changes up to this number.
    const uint64_t number = number_.load(std::memory_order_acquire);
    const Changes changes{number,
                          since > number || all_changed_.load(std::memory_order_acquire) > since};
    if (changes.all && !area.empty()) {
      visit(area);
    }
    if (!changes.all && since < number) {
      ForEachLeafIn(area, [&](NodeIndex leaf_at, const Leaf* leaf) {
        VisitChangedOf(leaf_at, leaf, area, since, visit);
      });
    }
    return changes;
  }

  /// Calls `visit(NodeIndex, NodeState)` for each stored node in `area`, which lies in the map.
  template <typename Visit>
  void ForEachIn(const NodeArea& area, Visit&& visit) const {
    ForEachLeafIn(area, [&](NodeIndex leaf_at, const Leaf* leaf) {
      if (leaf != nullptr) {
        ForEachTileIn(leaf_at, area, [&](size_t place, NodeIndex at) {
          VisitTile(leaf->place[place], at, MaskOf(at, area), visit);
        });
      }
    });
  }

  /// The leaf that holds a tile; null if nothing was deposited there. Loads with the memory order
  /// that the Reclaimer requires.
  const Leaf* FindLeaf(int32_t leaf_column, int32_t leaf_row) const {
    const std::atomic<Leaf*>* top = top_.load();
    return top != nullptr ? top[leaf_row * leaf_columns_ + leaf_column].load() : nullptr;
  }

  /// The memory that a missing tile would need; 0 for an existing one. `leaf_counted`,
  /// `top_counted`: the leaf that holds it, or the top table, is paid for.
  uint64_t BytesMissing(int32_t tile_column, int32_t tile_row, bool leaf_counted,
                        bool top_counted) const;

  /// Calls `visit(NodeIndex, NodeState)` for each stored node, leaf by leaf and tile by tile. The
  /// visitor may write to the map.
  template <typename Visit>
  void ForEach(Visit&& visit) const {
    for (int32_t leaf = 0; leaf < leaf_count(); ++leaf) {
      ForEachInLeaf(leaf, visit);
    }
  }

  /// The same for the leaf in one entry of the top table.
  template <typename Visit>
  void ForEachInLeaf(int32_t leaf_index, Visit&& visit) const {
    for (int32_t row = 0; row < kLeafSide; ++row) {
      ForEachInLeafRow(leaf_index, row, visit);
    }
  }

  /// The same for one row of tiles in it. Returns how many tiles there were.
  template <typename Visit>
  int ForEachInLeafRow(int32_t leaf_index, int32_t leaf_tile_row, Visit&& visit) const {
    const int32_t leaf_column = leaf_index % leaf_columns_;
    const int32_t leaf_row = leaf_index / leaf_columns_;
    int tiles = 0;
    const Leaf* leaf = FindLeaf(leaf_column, leaf_row);
    for (int32_t i = 0; i < kLeafSide && leaf != nullptr; ++i) {
      const Place& place =
          leaf->place[static_cast<size_t>(leaf_tile_row) * kLeafSide + static_cast<size_t>(i)];
      if (place.occupied.load(std::memory_order_acquire) != 0) {
        const NodeIndex at{(leaf_column * kLeafSide + i) * kTileSide,
                           (leaf_row * kLeafSide + leaf_tile_row) * kTileSide};
        tiles += VisitTile(place, at, UINT64_MAX, visit) ? 1 : 0;
        leaf = FindLeaf(leaf_column, leaf_row);  // the visitor may have emptied it
      }
    }
    return tiles;
  }

  /// Saves everything that later changes depend on, and loads it into a map that was never written
  /// to (state.cc). Budgets are not checked. Invalid data is a failure of the reader.
  void Save(ByteWriter* writer) const;
  void Restore(ByteReader* reader, NodeIndex size, uint32_t max_level);

  /// The map's nodes as they are now, to be copied in portions (frozen_cells.h). At most one at a
  /// time; `kept` outlives it.
  std::unique_ptr<FrozenCells> Freeze(KeptBytes* kept) const;

  int32_t leaf_count() const { return leaf_columns_ * leaf_rows_; }
  int32_t leaf_columns() const { return leaf_columns_; }
  size_t node_count() const { return node_count_; }
  size_t tile_count() const { return tile_count_; }
  size_t tiles_in_leaf(int32_t leaf_index) const {
    const Leaf* leaf = FindLeaf(leaf_index % leaf_columns_, leaf_index / leaf_columns_);
    return leaf != nullptr ? static_cast<size_t>(leaf->tiles) : 0;
  }

  /// The memory of a map's top table.
  static uint64_t TopBytes(int32_t columns, int32_t rows);

 private:
  friend class FrozenCells;
  class Removed;

  static constexpr int32_t kLeafNodes = kLeafSide * kTileSide;  // along a side

  // Calls `visit` for the nodes of a tile that `mask` has. False if there is no tile.
  template <typename Visit>
  static bool VisitTile(const Place& place, NodeIndex at, uint64_t mask, Visit&& visit) {
    const uint64_t occupied = place.occupied.load(std::memory_order_acquire);
    const Tile* tile = place.tile.load();
    if (occupied == 0 || tile == nullptr) {
      return false;
    }
    std::array<uint64_t, 64> words{};
    for (size_t slot = 0; slot < 64; ++slot) {
      words[slot] = tile->word[slot].load(std::memory_order_relaxed);
    }
    for (uint64_t rest = occupied & mask; rest != 0; rest &= rest - 1) {
      const int slot = std::countr_zero(rest);
      const NodeState state = UnpackNode(words[static_cast<size_t>(slot)]);
      if (state.level != 0) {
        visit(NodeIndex{at.column + slot % kTileSide, at.row + slot / kTileSide}, state);
      }
    }
    return true;
  }

  // Calls `visit(its first node, leaf or null)` for each leaf that overlaps an area of the map.
  template <typename Visit>
  void ForEachLeafIn(const NodeArea& area, Visit&& visit) const {
    for (int32_t row = area.begin.row / kLeafNodes; row * kLeafNodes < area.end.row; ++row) {
      for (int32_t column = area.begin.column / kLeafNodes; column * kLeafNodes < area.end.column;
           ++column) {
        visit(NodeIndex{column * kLeafNodes, row * kLeafNodes}, FindLeaf(column, row));
      }
    }
  }

  // Calls `visit(place, its first node)` for each place of a leaf that overlaps `area`.
  template <typename Visit>
  static void ForEachTileIn(NodeIndex leaf_at, const NodeArea& area, Visit&& visit) {
    for (size_t place = 0; place < kPlaces; ++place) {
      const auto i = static_cast<int32_t>(place);
      const NodeIndex at{leaf_at.column + i % kLeafSide * kTileSide,
                         leaf_at.row + i / kLeafSide * kTileSide};
      if (!TileAt(at, kTileSide).Within(area).empty()) {
        visit(place, at);
      }
    }
  }
  static NodeArea TileAt(NodeIndex at, int32_t side) {
    return {at, {at.column + side, at.row + side}};
  }

  // The slots of a tile that lie in `area`.
  static uint64_t MaskOf(NodeIndex at, const NodeArea& area) {
    const NodeArea inside = TileAt(at, kTileSide).Within(area);
    const int first = inside.begin.column - at.column;
    const int end = inside.end.column - at.column;
    const uint64_t in_row = (uint64_t{1} << end) - (uint64_t{1} << first);
    uint64_t mask = 0;
    for (int row = inside.begin.row - at.row; row < inside.end.row - at.row; ++row) {
      mask |= in_row << (kTileSide * row);
    }
    return mask;
  }

  // A removed tile is reported by the last removal in its leaf (or of leaves). That number is
  // stored before the tile or leaf disappears, so a reader that finds none sees it.
  template <typename Visit>
  void VisitChangedOf(NodeIndex leaf_at, const Leaf* leaf, const NodeArea& area, uint64_t since,
                      Visit&& visit) const {
    if (leaf == nullptr) {
      if (leaf_emptied_.load(std::memory_order_acquire) > since) {
        visit(TileAt(leaf_at, kLeafNodes).Within(area));
      }
      return;
    }
    if (leaf->changed.load(std::memory_order_acquire) <= since &&
        leaf->emptied.load(std::memory_order_acquire) <= since) {
      return;
    }
    ForEachTileIn(leaf_at, area, [&](size_t place, NodeIndex at) {
      const Tile* tile = leaf->place[place].tile.load();
      const std::atomic<uint64_t>& last =
          tile != nullptr ? *TilePool::StampOf(tile) : leaf->emptied;
      if (last.load(std::memory_order_acquire) > since) {
        visit(TileAt(at, kTileSide).Within(area));
      }
    });
  }

  Place* FindPlace(NodeIndex node) const;
  Place* MakePlace(NodeIndex node);
  uint64_t BytesOfTop() const {
    return static_cast<uint64_t>(leaf_count()) * sizeof(std::atomic<Leaf*>);
  }
  template <typename Mark>
  void Replace(NodeIndex node, Place* place, Tile* tile, NodeState state, Mark&& mark);
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
  bool has_top_ = false;                           // it is counted in the budget, once and for ever
  size_t node_count_ = 0;
  size_t tile_count_ = 0;
  size_t present_leaves_ = 0;
  // Published last in a change, so that whoever sees the number sees the change.
  std::atomic<uint64_t> number_{1};
  std::atomic<uint64_t> all_changed_{1};   // the last change that may affect all nodes
  std::atomic<uint64_t> leaf_emptied_{0};  // the last one of a tile whose leaf is gone
  MemoryBudget* budget_;
  Reclaimer* reclaimer_;
  TilePool* pool_;
  mutable FrozenCells* frozen_ = nullptr;  // the copy in progress; called before each change
};

}  // namespace pheromone::field
