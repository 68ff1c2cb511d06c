#include "server/field/tile_pool.h"

#include <sys/mman.h>

#include <cstdlib>
#include <new>
#include <utility>

namespace pheromone::field {
namespace {

// A tile that nobody has.
struct FreeTile {
  FreeTile* next;
};

}  // namespace

// Lies at the beginning of its memory, where the address of any of its tiles leads.
struct alignas(64) TilePool::Chunk {
  Chunk* next;
  Chunk* previous;
  size_t used;     // tiles that are taken
  size_t touched;  // tiles that ever were: the others have no memory yet
  FreeTile* free;

  Tile* TileAt(size_t index) { return reinterpret_cast<Tile*>(this) + 1 + index; }
};

TilePool::~TilePool() {
  for (Chunk* chunk = with_room_; chunk != nullptr;) {
    std::free(std::exchange(chunk, chunk->next));
  }
}

void TilePool::Link(Chunk* chunk) {
  chunk->previous = nullptr;
  chunk->next = with_room_;
  if (with_room_ != nullptr) {
    with_room_->previous = chunk;
  }
  with_room_ = chunk;
}

void TilePool::Unlink(Chunk* chunk) {
  (chunk->previous != nullptr ? chunk->previous->next : with_room_) = chunk->next;
  if (chunk->next != nullptr) {
    chunk->next->previous = chunk->previous;
  }
}

Tile* TilePool::Take() {
  static_assert(sizeof(Chunk) <= sizeof(Tile));
  if (with_room_ == nullptr) {
    void* memory = std::aligned_alloc(kChunkBytes, kChunkBytes);
    if (memory == nullptr) {
      throw std::bad_alloc();
    }
    if (chunks_ > 0) {  // small maps stay small
      madvise(memory, kChunkBytes, MADV_HUGEPAGE);
    }
    Link(new (memory) Chunk{nullptr, nullptr, 0, 0, nullptr});
    ++chunks_;
  }
  Chunk* chunk = with_room_;
  void* place = chunk->free;
  if (place != nullptr) {
    chunk->free = chunk->free->next;
  } else {
    place = chunk->TileAt(chunk->touched++);
  }
  if (++chunk->used == kTilesPerChunk) {
    Unlink(chunk);
  }
  return new (place) Tile{};
}

void TilePool::Give(Tile* tile) {
  const auto address = reinterpret_cast<uintptr_t>(tile);
  auto* chunk = reinterpret_cast<Chunk*>(address & ~uintptr_t{kChunkBytes - 1});
  chunk->free = new (tile) FreeTile{chunk->free};
  if (chunk->used-- == kTilesPerChunk) {
    Link(chunk);
  }
  // One empty chunk is kept, so that a tile that comes and goes does not cost a chunk each time.
  if (chunk->used == 0 && (chunk->next != nullptr || chunk->previous != nullptr)) {
    Unlink(chunk);
    std::free(chunk);
    --chunks_;
  }
}

}  // namespace pheromone::field
