// A diffusing pheromone: the contents of the nodes of one type, moved in discrete steps.
//
//   DiffusionLayer layer(map.columns(), map.rows(), &budget, &reclaimer, &pool);
//   layer.Add({40, 12}, 3 << 16, 100 << 16);   // three quanta, at most a hundred
//   layer.Step(law.diffusion, obstacles);      // every law.diffusion.step_ms
//   layer.Read({41, 12});
//
// A step is Fick's second law on the nodes' five-point stencil, explicit in time, written as flows
// over the edges between nodes (Crank 1975, ch. 8), then evaporation, then the cut-off:
//
//   flow from i to j   trunc((v_i - v_j) x / 65 536)    j right of or above i, neither blocked
//   evaporation        v <- floor(v k / 2^32)           k = 0: none
//   cut-off            v <- 0 where v < cutoff
//
// Everything is computed from the values before the step and in integers: what leaves a node
// arrives at its neighbour exactly, and no flow crosses the map's edge. As x is at most 1/4, a new
// value is within the range of the old value and its four neighbours: v + sum of inflows <= v + 4 *
// (max - v) / 4, and the same from below. So nothing becomes negative, and no step exceeds the
// largest value that deposits have reached.
//
// Units: contents in 1/65 536 quantum, at most kMaxContent a node.
//
// Only tiles with content are stepped, and their neighbours into which something flows; an empty
// layer costs nothing. A tile is allocated when it is first needed, in the order of rows and
// columns; if the budget has no room for it, its border is a wall in that step. The contents of a
// layer and its share of the budget depend only on the order of changes, not on readers, the
// processor, or the addresses of tiles.
//
// One writer; any number of readers between Enter and Leave of the Reclaimer. A step becomes
// visible to them at once; only those that are reading at that moment may see nodes from before and
// after it.
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/core/field/cell_map.h"
#include "server/core/field/diffusion_kernel.h"
#include "server/core/field/geometry.h"
#include "server/core/field/law.h"
#include "server/core/field/memory.h"
#include "server/core/field/obstacles.h"
#include "server/core/field/tile_pool.h"

namespace pheromone::field {

/// Totals of a layer's pheromone since it was created, in 1/65 536 quantum, modulo 2^64: deposited
/// == sum + evaporated + lost, at any time and exactly.
struct DiffusionTotals {
  uint64_t deposited = 0;
  uint64_t sum = 0;         ///< what the nodes hold now
  uint64_t evaporated = 0;  ///< removed by the evaporation of steps
  uint64_t lost = 0;        ///< cut off, beyond a node's maximum, or erased
  bool operator==(const DiffusionTotals&) const = default;
};

class DiffusionLayer {
 public:
  static constexpr uint32_t kMaxContent = INT32_MAX;  ///< a little less than 32 768 quanta
  static_assert(kMaxContent >> 16 == kMaxDiffusingCount);

  /// The memory accounted for each, including the heap's overhead.
  static constexpr uint64_t kTileBytes = CellMap::kTileBytes;
  static constexpr uint64_t kLeafBytes = CellMap::kLeafBytes + 64;

  /// `columns` x `rows` nodes. Budget, reclaimer and pool are shared and outlive the layer; the
  /// pool outlives the reclaimer. `kernel` is for tests and benchmarks; it does not affect results.
  DiffusionLayer(int32_t columns, int32_t rows, MemoryBudget* budget, Reclaimer* reclaimer,
                 TilePool* pool, const DiffusionKernel& kernel = BestDiffusionKernel());
  DiffusionLayer(const DiffusionLayer&) = delete;
  DiffusionLayer& operator=(const DiffusionLayer&) = delete;
  ~DiffusionLayer();

  /// Adds to a node, up to a content of `most` (or kMaxContent); the excess is lost. A node that
  /// already holds more is not changed. False, changing nothing, if there is no memory for it.
  bool Add(NodeIndex node, uint64_t amount_q16, uint32_t most_q16);

  /// Replaces the content of a node, by kMaxContent at most. The difference counts as deposited or
  /// lost. False, changing nothing, if there is no memory for it; never for 0.
  bool Set(NodeIndex node, uint32_t content_q16);

  /// Removes everything, at once and however much there is. It counts as lost. Memory is released
  /// as in CellMap::Clear.
  void Clear();

  /// As CellMap::BytesMissing.
  uint64_t BytesMissing(int32_t tile_column, int32_t tile_row, bool leaf_counted,
                        bool top_counted) const;

  /// One step. `obstacles` may be null; pheromone on a blocked node stays there and evaporates.
  void Step(const DiffusionLaw& law, const ObstacleMask* obstacles);

  /// The evaporation of `steps` steps at once, without diffusion: v <- floor(v K / 2^32), K =
  /// k^steps by squaring from the lowest bit up, each product rounded down to 2^-32; then the
  /// cut-off.
  void Decay(const DiffusionLaw& law, uint64_t steps);

  uint32_t Read(NodeIndex node) const;

  /// The tile at (8 * tile_column, 8 * tile_row), as one step left it.
  struct TileView {
    uint64_t occupied = 0;  ///< bit 8 * row + column: that node has content; 0: no more tiles
    const std::atomic<uint64_t>* pairs = nullptr;

    /// The content of a node; `slot` is the number of its bit.
    uint32_t operator[](size_t slot) const {
      if (pairs == nullptr) {
        return 0;
      }
      const uint64_t pair = pairs[slot / 2].load(std::memory_order_relaxed);
      return std::bit_cast<std::array<uint32_t, 2>>(pair)[slot % 2];
    }
  };
  TileView Find(int32_t tile_column, int32_t tile_row) const {
    const Leaf* leaf = FindLeaf(tile_column >> kLeafBits, tile_row >> kLeafBits);
    return leaf != nullptr ? View(leaf->place[PlaceOf(tile_column, tile_row)]) : TileView{};
  }

  /// Calls `visit(NodeIndex, content)` for each node with content, tile by tile. The visitor must
  /// not change the layer.
  template <typename Visit>
  void ForEach(Visit&& visit) const {
    const std::atomic<Leaf*>* top = top_.load();
    for (int32_t i = 0; top != nullptr && i < leaf_columns_ * leaf_rows_; ++i) {
      if (const Leaf* leaf = top[i].load(); leaf != nullptr) {
        ForEachInLeaf(*leaf, visit);
      }
    }
  }

  /// The same for the nodes in `area`, which lies in the map.
  template <typename Visit>
  void ForEachIn(const NodeArea& area, Visit&& visit) const {
    constexpr int32_t kSide = kLeafSide * kTileSide;
    const auto visit_inside = [&](NodeIndex node, uint32_t content) {
      if (area.Contains(node)) {
        visit(node, content);
      }
    };
    for (int32_t row = area.begin.row / kSide; row * kSide < area.end.row; ++row) {
      for (int32_t column = area.begin.column / kSide; column * kSide < area.end.column; ++column) {
        if (const Leaf* leaf = FindLeaf(column, row); leaf != nullptr) {
          ForEachInLeaf(*leaf, visit_inside);
        }
      }
    }
  }

  /// Saves everything that later changes depend on, and loads it into a layer that was always empty
  /// (state.cc). Budgets are not checked. Invalid data is a failure of the reader.
  void Save(ByteWriter* writer) const;
  void Restore(ByteReader* reader);

  // The writer's:
  bool empty() const { return tile_count_ == 0; }
  size_t tile_count() const { return tile_count_; }
  const DiffusionTotals& totals() const { return totals_; }
  /// How often a step needed a tile for which there was no memory.
  uint64_t refused_tiles() const { return refused_tiles_; }

  /// The sum over the nodes of Hash64({row * 2^32 + column, content}).
  uint64_t Hash() const;

 private:
  using Place = CellMap::Place;
  struct Leaf {
    std::array<Place, size_t{kLeafSide} * kLeafSide> place;
    // The writer's:
    int32_t column;  // in leaves
    int32_t row;
    std::array<uint64_t, 4> tiles{};  // bit i: place[i] has a tile
  };
  static_assert(sizeof(Leaf) <= sizeof(CellMap::Leaf) + 64);

  static size_t PlaceOf(int32_t tile_column, int32_t tile_row) {
    const int32_t place = tile_row % kLeafSide * kLeafSide + tile_column % kLeafSide;
    return static_cast<size_t>(place);
  }
  static size_t SlotOf(NodeIndex node) {
    const int32_t slot = node.row % kTileSide * kTileSide + node.column % kTileSide;
    return static_cast<size_t>(slot);
  }
  static NodeIndex TileIndex(const Leaf& leaf, size_t place) {
    return {leaf.column * kLeafSide + static_cast<int32_t>(place) % kLeafSide,
            leaf.row * kLeafSide + static_cast<int32_t>(place) / kLeafSide};
  }

  // Calls `visit(place)` for each tile of a leaf; the writer's.
  template <typename Visit>
  static void ForEachPlace(const Leaf& leaf, Visit&& visit) {
    for (size_t word = 0; word < leaf.tiles.size(); ++word) {
      for (uint64_t rest = leaf.tiles[word]; rest != 0; rest &= rest - 1) {
        visit(64 * word + static_cast<size_t>(std::countr_zero(rest)));
      }
    }
  }

  template <typename Visit>
  void ForEachInLeaf(const Leaf& leaf, Visit&& visit) const {
    for (size_t p = 0; p < leaf.place.size(); ++p) {
      const TileView tile = View(leaf.place[p]);
      const NodeIndex at = TileIndex(leaf, p);
      for (uint64_t rest = tile.occupied; rest != 0; rest &= rest - 1) {
        const int slot = std::countr_zero(rest);
        if (const uint32_t content = tile[static_cast<size_t>(slot)]; content != 0) {
          visit(NodeIndex{at.column * kTileSide + slot % kTileSide,
                          at.row * kTileSide + slot / kTileSide},
                content);
        }
      }
    }
  }

  // A tile's 64 words are twice 64 contents: the present ones, and those of the next step.
  static std::atomic<uint64_t>* PairsOf(Tile* tile, size_t side) {
    return tile->word.data() + 32 * side;
  }
  TileView View(const Place& place) const {
    const uint64_t occupied = place.occupied.load(std::memory_order_acquire);
    Tile* tile = occupied != 0 ? place.tile.load() : nullptr;
    return tile != nullptr
               ? TileView{occupied, PairsOf(tile, side_.load(std::memory_order_acquire))}
               : TileView{};
  }
  Leaf* FindLeaf(int32_t leaf_column, int32_t leaf_row) const {
    std::atomic<Leaf*>* top = top_.load();
    return top != nullptr ? top[leaf_row * leaf_columns_ + leaf_column].load() : nullptr;
  }

  struct alignas(64) Contents : std::array<uint32_t, 64> {};
  struct Surroundings;
  class Removed;
  Leaf* MakeTile(NodeIndex tile);
  void RemoveTile(NodeIndex tile);
  bool Write(NodeIndex node, uint32_t content);
  uint64_t FreeNodes(NodeIndex tile, const ObstacleMask* obstacles) const;
  bool MakeRoom(const DiffusionLaw& law, const ObstacleMask* obstacles);
  void LookAround(const Surroundings& around, size_t place, bool room,
                  const ObstacleMask* obstacles, DiffusionTile* work) const;
  void Replace(Place* place, size_t side, const Contents& contents, uint64_t occupied);
  void Account(uint64_t sum, uint64_t cut);

  int32_t columns_;
  int32_t rows_;
  int32_t leaf_columns_;
  int32_t leaf_rows_;
  MemoryBudget* budget_;
  Reclaimer* reclaimer_;
  TilePool* pool_;
  const DiffusionKernel& kernel_;

  std::atomic<std::atomic<Leaf*>*> top_{nullptr};  // null while the layer is empty
  std::atomic<size_t> side_{0};                    // of all tiles
  std::vector<Leaf*> leaves_;                      // by row, then column
  size_t tile_count_ = 0;
  DiffusionTotals totals_;
  uint64_t refused_tiles_ = 0;
};

}  // namespace pheromone::field
