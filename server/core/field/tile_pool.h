// Memory for tiles and for the leaves of their directories. It comes from the system in chunks of 2
// MiB, for which a large page is requested: a query touches a dozen scattered tiles, and with small
// pages each costs a page-table walk. A chunk is returned to the system with its last block, so
// memory use follows the trails; the heap is not used, since fragmentation would keep its memory.
//
// Memory that a map releases all at once (CellMap::Clear) is queued as garbage and released in
// portions: whenever the owner has time, and before each new allocation, so that garbage and new
// memory together are never much more than before.
//
// Not thread-safe: one owner, the field's writer. The Reclaimer ensures that no reader uses
// released memory.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace pheromone::field {

/// The nodes of 8 x 8 cells, row by row, each packed in one word (kernel.h).
struct alignas(64) Tile {
  std::array<std::atomic<uint64_t>, 64> word;
};

/// Blocks of one size, aligned to cache lines, optionally with a separate word for each.
class BlockPool {
 public:
  static constexpr size_t kChunkBytes = size_t{2} << 20;
  static constexpr size_t kHeaderBytes = 64;

  /// The size of a chunk's header, in blocks.
  static constexpr size_t BlocksBefore(size_t block_bytes, bool with_words) {
    const size_t words = with_words ? kChunkBytes / block_bytes * sizeof(uint64_t) : 0;
    return (kHeaderBytes + words + block_bytes - 1) / block_bytes;
  }

  /// A multiple of 64, at least 64.
  explicit BlockPool(size_t block_bytes, bool with_words = false)
      : block_bytes_(block_bytes),
        blocks_before_(BlocksBefore(block_bytes, with_words)),
        blocks_per_chunk_(kChunkBytes / block_bytes - blocks_before_) {}
  BlockPool(const BlockPool&) = delete;
  BlockPool& operator=(const BlockPool&) = delete;
  ~BlockPool();  ///< all blocks must have been released

  /// Uninitialized. Throws std::bad_alloc if the machine has no memory.
  void* Take();
  void Give(void* block);

  /// The word of a block, in a pool with words; uninitialized when the block is allocated.
  static std::atomic<uint64_t>* WordOf(const void* block, size_t block_bytes) {
    const auto address = reinterpret_cast<uintptr_t>(block);
    const uintptr_t chunk = address & ~uintptr_t{kChunkBytes - 1};
    return reinterpret_cast<std::atomic<uint64_t>*>(chunk + kHeaderBytes) +
           (address - chunk) / block_bytes;
  }

  size_t chunks() const { return chunks_; }

 private:
  struct Chunk;

  void Unlink(Chunk* chunk);
  void Link(Chunk* chunk);

  const size_t block_bytes_;
  const size_t blocks_before_;
  const size_t blocks_per_chunk_;
  Chunk* with_room_ = nullptr;  // a list of the chunks that have a free block
  size_t chunks_ = 0;
};

class TilePool;

/// Tiles and leaves that are no longer reachable.
class Garbage {
 public:
  Garbage() = default;
  Garbage(const Garbage&) = delete;
  Garbage& operator=(const Garbage&) = delete;
  virtual ~Garbage() = default;

  /// Releases about so many tiles, and their leaves. An empty place counts as a sixteenth of a
  /// tile. False if a frozen copy still needs the next ones, so that nothing could be released.
  virtual bool Release(int tiles, TilePool* pool) = 0;
  virtual bool empty() const = 0;
  /// Detaches the copy that still needs it; the copy fails.
  virtual void LetGo() {}
};

class TilePool {
 public:
  static constexpr size_t kTilesPerChunk =
      BlockPool::kChunkBytes / sizeof(Tile) - BlockPool::BlocksBefore(sizeof(Tile), true);
  /// A leaf is as large as eight tiles.
  static constexpr size_t kLeafBytes = size_t{65} * 64;
  /// Tiles of garbage released for each allocated tile.
  static constexpr int kTilesForATile = 2;
  static constexpr int kTilesForALeaf = 18;

  TilePool() = default;
  TilePool(const TilePool&) = delete;
  TilePool& operator=(const TilePool&) = delete;
  ~TilePool();  ///< all tiles and leaves must have been released, or be garbage

  /// A tile of zeros. Throws std::bad_alloc if the machine has no memory.
  Tile* Take() {
    ReleaseSome(kTilesForATile);
    Tile* tile = new (tiles_.Take()) Tile{};
    new (StampOf(tile)) std::atomic<uint64_t>{0};
    return tile;
  }
  void Give(Tile* tile) { tiles_.Give(tile); }

  /// A word for the owner of each tile, initially 0. It is stored apart from the tile, whose nodes
  /// fill their cache lines.
  static std::atomic<uint64_t>* StampOf(const Tile* tile) {
    return BlockPool::WordOf(tile, sizeof(Tile));
  }

  /// A leaf of a directory, all zeros.
  template <typename Leaf>
  Leaf* TakeLeaf() {
    static_assert(sizeof(Leaf) <= kLeafBytes);
    static_assert(alignof(Leaf) <= 64);
    ReleaseSome(kTilesForALeaf);
    return new (leaves_.Take()) Leaf{};
  }
  template <typename Leaf>
  void GiveLeaf(Leaf* leaf) {
    leaf->~Leaf();
    leaves_.Give(leaf);
  }

  /// Queues memory for release.
  void Bury(std::unique_ptr<Garbage> garbage) { garbage_.push_back(std::move(garbage)); }
  /// Releases about so many tiles of garbage.
  void ReleaseSome(int tiles) {
    if (!garbage_.empty()) {
      ReleaseGarbage(tiles);
    }
  }
  bool has_garbage() const { return !garbage_.empty(); }

  size_t chunks() const { return tiles_.chunks(); }

 private:
  void ReleaseGarbage(int tiles);

  BlockPool tiles_{sizeof(Tile), true};
  BlockPool leaves_{kLeafBytes};
  std::vector<std::unique_ptr<Garbage>> garbage_;  // the oldest first
};

}  // namespace pheromone::field
