// Memory for tiles and for the leaves of their directories. It comes from the system in chunks of 2
// MiB, for which a large page is asked for: a query touches a dozen tiles in a dozen places, and
// with small pages each costs a walk through the page tables. A chunk goes back to the system when
// its last block does, so memory follows the trails; the heap has no part in it, whose holes would
// stay.
//
// What a map gives up all at once (CellMap::Clear) comes as garbage, and is given back in portions:
// whenever the owner finds time, and before memory is taken for something new, so that both
// together are never much more than before.
//
// Not thread-safe: one owner, the field's writer. The Reclaimer sees to it that no reader is
// looking at what is given back.
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

/// Blocks of one size, on cache lines of their own; beside them a word for each, if wanted.
class BlockPool {
 public:
  static constexpr size_t kChunkBytes = size_t{2} << 20;
  static constexpr size_t kHeaderBytes = 64;

  /// Of a chunk, what goes before the blocks: in blocks.
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
  ~BlockPool();  ///< all blocks were given back

  /// Bytes of any value. Throws std::bad_alloc when the machine has no memory.
  void* Take();
  void Give(void* block);

  /// The word of a block of a pool with words; of any value when the block is taken.
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

/// Tiles and leaves that nobody finds any more.
class Garbage {
 public:
  Garbage() = default;
  Garbage(const Garbage&) = delete;
  Garbage& operator=(const Garbage&) = delete;
  virtual ~Garbage() = default;

  /// Gives back about so many tiles, and what goes with them. A look at an empty place counts as a
  /// sixteenth of a tile. False if somebody needs what comes next, and nothing could be done.
  virtual bool Release(int tiles, TilePool* pool) = 0;
  virtual bool empty() const = 0;
  /// Whoever needs it does without.
  virtual void LetGo() {}
};

class TilePool {
 public:
  static constexpr size_t kTilesPerChunk =
      BlockPool::kChunkBytes / sizeof(Tile) - BlockPool::BlocksBefore(sizeof(Tile), true);
  /// A leaf is as large as eight tiles.
  static constexpr size_t kLeafBytes = 65 * 64;
  /// Released of the garbage for each one that is taken.
  static constexpr int kTilesForATile = 2;
  static constexpr int kTilesForALeaf = 18;

  TilePool() = default;
  TilePool(const TilePool&) = delete;
  TilePool& operator=(const TilePool&) = delete;
  ~TilePool();  ///< all tiles and leaves were given back, or are garbage

  /// A tile of zeros. Throws std::bad_alloc when the machine has no memory.
  Tile* Take() {
    ReleaseSome(kTilesForATile);
    Tile* tile = new (tiles_.Take()) Tile{};
    new (StampOf(tile)) std::atomic<uint64_t>{0};
    return tile;
  }
  void Give(Tile* tile) { tiles_.Give(tile); }

  /// A word of each tile's for its owner: 0 at first. It lies apart from the tile, whose nodes fill
  /// their lines.
  static std::atomic<uint64_t>* StampOf(const Tile* tile) {
    return BlockPool::WordOf(tile, sizeof(Tile));
  }

  /// A leaf of a directory, all zeros.
  template <typename Leaf>
  Leaf* TakeLeaf() {
    static_assert(sizeof(Leaf) <= kLeafBytes && alignof(Leaf) <= 64);
    ReleaseSome(kTilesForALeaf);
    return new (leaves_.Take()) Leaf{};
  }
  template <typename Leaf>
  void GiveLeaf(Leaf* leaf) {
    leaf->~Leaf();
    leaves_.Give(leaf);
  }

  /// To be released from now on.
  void Bury(std::unique_ptr<Garbage> garbage) { garbage_.push_back(std::move(garbage)); }
  /// Releases about so many tiles.
  void ReleaseSome(int tiles) {
    if (!garbage_.empty()) {
      ReleaseGarbage(tiles);
    }
  }
  bool has_garbage() const { return !garbage_.empty(); }

  size_t chunks() const { return tiles_.chunks(); }
  size_t leaf_chunks() const { return leaves_.chunks(); }

 private:
  void ReleaseGarbage(int tiles);

  BlockPool tiles_{sizeof(Tile), true};
  BlockPool leaves_{kLeafBytes};
  std::vector<std::unique_ptr<Garbage>> garbage_;  // the oldest first
};

}  // namespace pheromone::field
