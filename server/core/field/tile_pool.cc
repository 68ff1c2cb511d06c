#include "server/core/field/tile_pool.h"

#include <sys/mman.h>

#include <utility>

namespace pheromone::field {
namespace {

// A free block.
struct FreeBlock {
  FreeBlock* next;
};

void* Map(size_t bytes) {
  void* memory = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) {
    throw std::bad_alloc();
  }
  return memory;
}

// A chunk aligned to its size. Not from the heap, which would put a few bytes of its own before
// each chunk, using up a large page, and keep released memory.
void* MapChunk() {
  constexpr size_t kBytes = BlockPool::kChunkBytes;
  const auto above = [](const void* memory) {
    return reinterpret_cast<uintptr_t>(memory) & (kBytes - 1);
  };
  void* memory = Map(kBytes);
  if (above(memory) == 0) {
    return memory;  // the usual case: the system maps chunks side by side
  }
  munmap(memory, kBytes);
  memory = Map(2 * kBytes);
  const size_t before = kBytes - above(memory);  // a whole chunk if already aligned
  char* begin = static_cast<char*>(memory) + before;
  munmap(memory, before);
  if (before != kBytes) {
    munmap(begin + kBytes, kBytes - before);
  }
  return begin;
}

}  // namespace

// At the start of its memory, so that it can be found from the address of any of its blocks.
struct alignas(64) BlockPool::Chunk {
  Chunk* next;
  Chunk* previous;
  size_t used;     // allocated blocks
  size_t touched;  // blocks ever allocated: the others have no memory yet
  FreeBlock* free;
};

BlockPool::~BlockPool() {
  static_assert(sizeof(Chunk) <= kHeaderBytes);
  for (Chunk* chunk = with_room_; chunk != nullptr;) {
    munmap(std::exchange(chunk, chunk->next), kChunkBytes);
  }
}

void BlockPool::Link(Chunk* chunk) {
  chunk->previous = nullptr;
  chunk->next = with_room_;
  if (with_room_ != nullptr) {
    with_room_->previous = chunk;
  }
  with_room_ = chunk;
}

void BlockPool::Unlink(Chunk* chunk) {
  (chunk->previous != nullptr ? chunk->previous->next : with_room_) = chunk->next;
  if (chunk->next != nullptr) {
    chunk->next->previous = chunk->previous;
  }
}

void* BlockPool::Take() {
  if (with_room_ == nullptr) {
    void* memory = MapChunk();
    if (chunks_ > 0) {  // small maps stay small
      madvise(memory, kChunkBytes, MADV_HUGEPAGE);
    }
    Link(new (memory) Chunk{nullptr, nullptr, 0, 0, nullptr});
    ++chunks_;
  }
  Chunk* chunk = with_room_;
  void* block = chunk->free;
  if (block != nullptr) {
    chunk->free = chunk->free->next;
  } else {
    // The chunk's header and words precede the first block.
    block = reinterpret_cast<char*>(chunk) + (blocks_before_ + chunk->touched++) * block_bytes_;
  }
  if (++chunk->used == blocks_per_chunk_) {
    Unlink(chunk);
  }
  return block;
}

void BlockPool::Give(void* block) {
  const auto address = reinterpret_cast<uintptr_t>(block);
  auto* chunk = reinterpret_cast<Chunk*>(address & ~uintptr_t{kChunkBytes - 1});
  chunk->free = new (block) FreeBlock{chunk->free};
  if (chunk->used-- == blocks_per_chunk_) {
    Link(chunk);
  }
  // One empty chunk is kept, so that repeated allocation and release of a block does not map a
  // chunk each time.
  if (chunk->used == 0 && (chunk->next != nullptr || chunk->previous != nullptr)) {
    Unlink(chunk);
    munmap(chunk, kChunkBytes);
    --chunks_;
  }
}

TilePool::~TilePool() {
  for (const auto& garbage : garbage_) {
    garbage->LetGo();
  }
  while (has_garbage()) {
    ReleaseGarbage(kTilesPerChunk);
  }
}

void TilePool::ReleaseGarbage(int tiles) {
  for (auto it = garbage_.begin(); it != garbage_.end(); ++it) {
    if ((*it)->Release(tiles, this)) {
      if ((*it)->empty()) {
        garbage_.erase(it);
      }
      return;
    }
  }
}

}  // namespace pheromone::field
