// Memory for tiles: blocks of 64 words, each on a cache line of its own. It comes in chunks of 2
// MiB, for which the system is asked for a large page: a query touches a dozen tiles in a dozen
// places, and with small pages each costs a walk through the page tables. A chunk goes back when
// its last tile does, so memory follows the trails.
//
// Not thread-safe: one owner, the field's writer. The Reclaimer sees to it that no reader is
// looking at a tile that is given back.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace pheromone::field {

/// The nodes of 8 x 8 cells, row by row, each packed in one word (kernel.h).
struct alignas(64) Tile {
  std::array<std::atomic<uint64_t>, 64> word;
};

class TilePool {
 public:
  static constexpr size_t kChunkBytes = size_t{2} << 20;
  static constexpr size_t kTilesPerChunk = kChunkBytes / sizeof(Tile) - 1;

  TilePool() = default;
  TilePool(const TilePool&) = delete;
  TilePool& operator=(const TilePool&) = delete;
  ~TilePool();  ///< all tiles were given back

  /// A tile of zeros. Throws std::bad_alloc when the machine has no memory.
  Tile* Take();
  void Give(Tile* tile);

  size_t chunks() const { return chunks_; }

 private:
  struct Chunk;

  void Unlink(Chunk* chunk);
  void Link(Chunk* chunk);

  Chunk* with_room_ = nullptr;  // a list of the chunks that have a free tile
  size_t chunks_ = 0;
};

}  // namespace pheromone::field
