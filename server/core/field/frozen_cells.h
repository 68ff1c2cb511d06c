// A frozen snapshot of the nodes of one pheromone type, copied in portions while the map changes:
// copy-on-write by tiles.
//
//   std::unique_ptr<FrozenCells> frozen = cells.Freeze(&kept);   // costs nothing
//   ...                                                          // the map is written to
//   while (!frozen->done()) frozen->CopySome(4096, &bytes);      // the bytes of CellMap::Save
//
// The first write to a tile that is not yet copied saves the tile's old contents. These are counted
// in a budget shared by all types; if it is exceeded, the copy fails and the map is not affected.
// To be used by the map's writer only; either object may be destroyed first.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/core/field/cell_map.h"
#include "server/core/field/memory.h"

namespace pheromone::field {

/// The budget for old contents that a copy saves. Any thread may ask whether it has failed.
struct KeptBytes {
  MemoryBudget budget;
  std::atomic<bool> failed =
      false;  ///< the budget was exceeded, or the map is gone: the copy is useless
};

class FrozenCells {
 public:
  /// The remaining work, in sixteenths of a tile.
  static constexpr int kWorkOfTile = 16;
  static constexpr int kWorkOfLeaf = 8 * kWorkOfTile;
  static constexpr int kWorkOfNoLeaf = 1;

  FrozenCells(const FrozenCells&) = delete;
  FrozenCells& operator=(const FrozenCells&) = delete;
  ~FrozenCells() { LetGo(); }

  /// The total work.
  uint64_t bytes() const { return bytes_; }
  bool done() const { return begun_ && leaf_ >= leaf_count_; }

  /// Appends the next leaves until that much work is done; returns the work done. Must not be
  /// called if the copy has failed.
  int CopySome(int work, std::string* to);

  /// Detaches from the map; if not everything was copied, the copy has failed.
  void LetGo();

 private:
  friend class CellMap;

  struct KeptTile {
    uint8_t place = 0;
    uint64_t occupied = 0;
    std::unique_ptr<uint64_t[]> words;  // of the occupied nodes only
  };
  struct KeptLeaf {
    std::array<uint64_t, 4> settled{};  // bit i: place[i] was changed, and what it held is in tiles
    std::vector<KeptTile> tiles;        // as they were changed
    uint64_t bytes = 0;
  };
  using Top = std::atomic<CellMap::Leaf*>;

  FrozenCells(const CellMap* map, KeptBytes* kept);

  int32_t leaf() const { return leaf_; }
  /// Called by the map: all its nodes were detached, but stay in memory until `*reader`, which is
  /// this object, is null or leaf() is beyond them.
  void ReadOn(FrozenCells** reader);
  /// Called by the map: a tile is about to be changed, or was just allocated.
  void BeforeChange(int32_t leaf, size_t place, const CellMap::Place& now);
  bool Keep(KeptLeaf* kept, size_t place, const CellMap::Place& now);
  void AppendLeaf(const CellMap::Leaf* leaf, KeptLeaf* kept, std::string* to) const;

  const CellMap* map_;              // null: detached
  FrozenCells** reader_ = nullptr;  // of the nodes detached from the map
  const Top* top_;                  // the map's, or the one detached by Clear; null: none
  bool has_top_;
  int32_t leaf_count_;
  size_t tile_count_;
  uint64_t bytes_;
  bool begun_ = false;
  int32_t leaf_ = 0;  // the next one
  KeptBytes* kept_bytes_;
  std::unordered_map<int32_t, KeptLeaf> kept_;
};

}  // namespace pheromone::field
