#include "server/field/cell_map.h"

#include <cassert>

#include "server/field/frozen_cells.h"

namespace pheromone::field {
namespace {

int32_t Leaves(int32_t nodes) {
  constexpr int32_t kNodes = kLeafSide * kTileSide;
  return (nodes + kNodes - 1) / kNodes;
}

}  // namespace

CellMap::CellMap(int32_t columns, int32_t rows, MemoryBudget* budget, Reclaimer* reclaimer,
                 TilePool* pool)
    : leaf_columns_(Leaves(columns)),
      leaf_rows_(Leaves(rows)),
      budget_(budget),
      reclaimer_(reclaimer),
      pool_(pool) {}

CellMap::~CellMap() {
  if (frozen_ != nullptr) {
    frozen_->LetGo();
  }
  std::atomic<Leaf*>* top = top_.load(std::memory_order_relaxed);
  for (int32_t i = 0; top != nullptr && i < leaf_count(); ++i) {
    Leaf* leaf = top[i].load(std::memory_order_relaxed);
    for (size_t p = 0; leaf != nullptr && p < leaf->place.size(); ++p) {
      if (Tile* tile = leaf->place[p].tile.load(std::memory_order_relaxed); tile != nullptr) {
        pool_->Give(tile);
      }
    }
    delete leaf;
  }
  delete[] top;
}

uint64_t CellMap::TopBytes(int32_t columns, int32_t rows) {
  return static_cast<uint64_t>(Leaves(columns)) * static_cast<uint64_t>(Leaves(rows)) *
         sizeof(std::atomic<Leaf*>);
}

CellMap::Place* CellMap::FindPlace(NodeIndex node) const {
  if (top_.load(std::memory_order_relaxed) == nullptr) {
    return nullptr;
  }
  Leaf* leaf = TopOf(node)->load(std::memory_order_relaxed);
  return leaf != nullptr ? &leaf->place[PlaceOf(node)] : nullptr;
}

NodeState CellMap::Read(NodeIndex node) const {
  const Place* place = FindPlace(node);
  const Tile* tile = place != nullptr ? place->tile.load(std::memory_order_relaxed) : nullptr;
  return tile != nullptr ? UnpackNode(tile->word[SlotOf(node)].load(std::memory_order_relaxed))
                         : NodeState{};
}

void CellMap::MakeTop() {
  top_.store(
      new std::atomic<Leaf*>[static_cast<size_t>(leaf_count())] {}, std::memory_order_release);
}

// The node's place with a tile in it; null when the budget has no room for all that is missing.
CellMap::Place* CellMap::MakePlace(NodeIndex node) {
  const bool has_top = top_.load(std::memory_order_relaxed) != nullptr;
  Place* place = FindPlace(node);
  const uint64_t bytes =
      kTileBytes + (place == nullptr ? kLeafBytes : 0) + (has_top ? 0 : BytesOfTop());
  if (!budget_->Take(bytes)) {
    return nullptr;
  }
  if (!has_top) {
    MakeTop();
  }
  if (place == nullptr) {
    auto* leaf = new Leaf{};
    TopOf(node)->store(leaf);
    place = &leaf->place[PlaceOf(node)];
  }
  place->tile.store(pool_->Take());
  ++TopOf(node)->load(std::memory_order_relaxed)->tiles;
  ++tile_count_;
  return place;
}

uint64_t CellMap::BytesMissing(int32_t tile_column, int32_t tile_row, bool leaf_counted,
                               bool top_counted) const {
  const Place* place = FindPlace({tile_column * kTileSide, tile_row * kTileSide});
  if (place != nullptr) {
    return place->tile.load(std::memory_order_relaxed) != nullptr ? 0 : kTileBytes;
  }
  const bool has_top = top_counted || top_.load(std::memory_order_relaxed) != nullptr;
  return kTileBytes + (leaf_counted ? 0 : kLeafBytes) + (has_top ? 0 : BytesOfTop());
}

bool CellMap::Write(NodeIndex node, NodeState state) {
  Place* place = FindPlace(node);
  Tile* tile = place != nullptr ? place->tile.load(std::memory_order_relaxed) : nullptr;
  if (tile == nullptr) {
    if (state.level == 0) {
      return true;
    }
    place = MakePlace(node);
    if (place == nullptr) {
      return false;
    }
    tile = place->tile.load(std::memory_order_relaxed);
  }
  if (frozen_ != nullptr) [[unlikely]] {
    frozen_->BeforeChange(LeafOf(node), PlaceOf(node), *place);
  }
  const size_t slot = SlotOf(node);
  const uint64_t bit = uint64_t{1} << slot;
  const uint64_t before = place->occupied.load(std::memory_order_relaxed);
  const uint64_t after = state.level != 0 ? before | bit : before & ~bit;
  tile->word[slot].store(state.level != 0 ? PackNode(state) : 0, std::memory_order_relaxed);
  if (after != before) {
    // Whoever sees the bit sees the tile and the word.
    place->occupied.store(after, std::memory_order_release);
    node_count_ += state.level != 0 ? 1 : static_cast<size_t>(-1);
    if (after == 0) {
      RemoveTile(node, place);
    }
  }
  return true;
}

std::unique_ptr<FrozenCells> CellMap::Freeze(KeptBytes* kept) const {
  assert(frozen_ == nullptr);
  std::unique_ptr<FrozenCells> frozen(new FrozenCells(this, kept));
  frozen_ = frozen.get();
  return frozen;
}

void CellMap::RemoveTile(NodeIndex node, Place* place) {
  Tile* tile = place->tile.exchange(nullptr);
  TilePool* pool = pool_;
  budget_->Give(kTileBytes);
  --tile_count_;
  reclaimer_->Retire([pool, tile] { pool->Give(tile); });
  Leaf* leaf = TopOf(node)->load(std::memory_order_relaxed);
  if (--leaf->tiles == 0) {
    TopOf(node)->store(nullptr);
    budget_->Give(kLeafBytes);
    reclaimer_->Retire([leaf] { delete leaf; });
  }
}

}  // namespace pheromone::field
