// The nodes of one pheromone type as they were at one moment, copied out in portions while the map
// goes on changing: tile-level copy-on-write.
//
//   std::unique_ptr<FrozenCells> frozen = cells.Freeze(&kept);   // costs nothing
//   ...                                                          // the map is written to
//   while (!frozen->done()) frozen->CopySome(4096, &bytes);      // what CellMap::Save would have
//   said
//
// A tile that is not yet copied is kept as it was by the first write to it. What is kept is counted
// in a budget that all types share; when it has no room the copy has failed, and the map goes on
// as if there were none. The writer's, as the map; either may go first.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/field/cell_map.h"
#include "server/field/memory.h"

namespace pheromone::field {

/// What a copy may keep of what is changed meanwhile. Any thread may ask whether it has failed.
struct KeptBytes {
  MemoryBudget budget;
  std::atomic<bool> failed =
      false;  ///< there was no room, or the map is gone: the copy is of no use
};

class FrozenCells {
 public:
  /// What there is to do, in sixteenths of a tile.
  static constexpr int kWorkOfTile = 16;
  static constexpr int kWorkOfLeaf = 8 * kWorkOfTile;
  static constexpr int kWorkOfNoLeaf = 1;

  FrozenCells(const FrozenCells&) = delete;
  FrozenCells& operator=(const FrozenCells&) = delete;
  ~FrozenCells() { LetGo(); }

  /// What is copied altogether.
  uint64_t bytes() const { return bytes_; }
  bool done() const { return begun_ && leaf_ >= leaf_count_; }

  /// Appends what comes next, whole leaves, until that much work is done; returns what was. Not to
  /// be called when the copy has failed.
  int CopySome(int work, std::string* to);

  /// Leaves the map alone from now on; if not all was copied, the copy has failed.
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
  /// The map's: all that it held was taken away from it, but stays where it is until `*reader`,
  /// which is this one, is null, or leaf() is beyond it.
  void ReadOn(FrozenCells** reader);
  /// The map's: a tile is about to be changed, or was made just now.
  void BeforeChange(int32_t leaf, size_t place, const CellMap::Place& now);
  bool Keep(KeptLeaf* kept, size_t place, const CellMap::Place& now);
  void AppendLeaf(const CellMap::Leaf* leaf, KeptLeaf* kept, std::string* to) const;

  const CellMap* map_;              // null: nothing more is heard from it
  FrozenCells** reader_ = nullptr;  // of what was taken away from the map
  const Top* top_;  // of the map, or what Clear took away from it; null: there was none
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
