#include "server/core/field/diffusion.h"

#include <algorithm>
#include <memory>
#include <tuple>
#include <utility>

#include "server/base/hash.h"

namespace pheromone::field {
namespace {

using Pair = std::array<uint32_t, 2>;

}  // namespace

DiffusionLayer::DiffusionLayer(int32_t columns, int32_t rows, MemoryBudget* budget,
                               Reclaimer* reclaimer, TilePool* pool, const DiffusionKernel& kernel)
    : columns_(columns),
      rows_(rows),
      leaf_columns_((columns - 1) / (kLeafSide * kTileSide) + 1),
      leaf_rows_((rows - 1) / (kLeafSide * kTileSide) + 1),
      budget_(budget),
      reclaimer_(reclaimer),
      pool_(pool),
      kernel_(kernel) {}

// The detached tiles of a layer, leaf by leaf.
class DiffusionLayer::Removed final : public Garbage {
 public:
  Removed(std::atomic<Leaf*>* top, std::vector<Leaf*> leaves)
      : top_(top), leaves_(std::move(leaves)) {}
  ~Removed() override { delete[] top_; }

  bool Release(int tiles, TilePool* pool) override {
    while (tiles > 0 && !leaves_.empty()) {
      Leaf* leaf = leaves_.back();
      leaves_.pop_back();
      ForEachPlace(*leaf, [&](size_t place) {
        pool->Give(leaf->place[place].tile.load(std::memory_order_relaxed));
        --tiles;
      });
      pool->GiveLeaf(leaf);
    }
    return true;
  }
  bool empty() const override { return leaves_.empty(); }

 private:
  std::atomic<Leaf*>* const top_;
  std::vector<Leaf*> leaves_;
};

DiffusionLayer::~DiffusionLayer() {
  Removed(top_.load(), std::move(leaves_)).Release(INT32_MAX, pool_);
}

// The tile's leaf, now with the tile; null if the budget has no room for everything that is
// missing.
DiffusionLayer::Leaf* DiffusionLayer::MakeTile(NodeIndex tile) {
  const NodeIndex at{tile.column / kLeafSide, tile.row / kLeafSide};
  const bool has_top = top_.load() != nullptr;
  Leaf* leaf = FindLeaf(at.column, at.row);
  const uint64_t bytes = kTileBytes + (leaf == nullptr ? kLeafBytes : 0) +
                         (has_top ? 0 : CellMap::TopBytes(columns_, rows_));
  if (!budget_->Take(bytes)) {
    return nullptr;
  }
  if (!has_top) {
    top_.store(new std::atomic<Leaf*>[static_cast<size_t>(leaf_columns_) *
                                      static_cast<size_t>(leaf_rows_)] {});
  }
  if (leaf == nullptr) {
    leaf = pool_->TakeLeaf<Leaf>();
    leaf->column = at.column;
    leaf->row = at.row;
    const auto before = [](const Leaf* a, const Leaf* b) {
      return std::tie(a->row, a->column) < std::tie(b->row, b->column);
    };
    leaves_.insert(std::upper_bound(leaves_.begin(), leaves_.end(), leaf, before), leaf);
    top_.load()[at.row * leaf_columns_ + at.column].store(leaf);
  }
  const size_t place = PlaceOf(tile.column, tile.row);
  leaf->place[place].tile.store(pool_->Take());
  leaf->tiles[place / 64] |= uint64_t{1} << (place % 64);
  ++tile_count_;
  return leaf;
}

void DiffusionLayer::RemoveTile(NodeIndex tile) {
  std::atomic<Leaf*>* top = top_.load();
  std::atomic<Leaf*>& entry = top[tile.row / kLeafSide * leaf_columns_ + tile.column / kLeafSide];
  Leaf* leaf = entry.load();
  const size_t place = PlaceOf(tile.column, tile.row);
  leaf->place[place].occupied.store(0);
  Tile* gone = leaf->place[place].tile.exchange(nullptr);
  leaf->tiles[place / 64] &= ~(uint64_t{1} << (place % 64));
  --tile_count_;
  budget_->Give(kTileBytes);
  reclaimer_->Retire([pool = pool_, gone] { pool->Give(gone); });
  if (leaf->tiles != decltype(leaf->tiles){}) {
    return;
  }
  entry.store(nullptr);
  leaves_.erase(std::find(leaves_.begin(), leaves_.end(), leaf));
  budget_->Give(kLeafBytes);
  reclaimer_->Retire([pool = pool_, leaf] { pool->GiveLeaf(leaf); });
  if (leaves_.empty()) {
    top_.store(nullptr);
    budget_->Give(CellMap::TopBytes(columns_, rows_));
    reclaimer_->Retire([top] { delete[] top; });
  }
}

uint32_t DiffusionLayer::Read(NodeIndex node) const {
  return Find(node.column / kTileSide, node.row / kTileSide)[SlotOf(node)];
}

bool DiffusionLayer::Write(NodeIndex node, uint32_t content) {
  const NodeIndex tile{node.column / kTileSide, node.row / kTileSide};
  Leaf* leaf = FindLeaf(tile.column / kLeafSide, tile.row / kLeafSide);
  const size_t place_index = PlaceOf(tile.column, tile.row);
  if (leaf == nullptr || leaf->place[place_index].tile.load() == nullptr) {
    if (content == 0) {
      return true;
    }
    leaf = MakeTile(tile);
    if (leaf == nullptr) {
      return false;
    }
  }
  Place& place = leaf->place[place_index];
  const size_t slot = SlotOf(node);
  std::atomic<uint64_t>& word = PairsOf(place.tile.load(), side_.load())[slot / 2];
  auto pair = std::bit_cast<Pair>(word.load(std::memory_order_relaxed));
  totals_.sum += uint64_t{content} - pair[slot % 2];
  pair[slot % 2] = content;
  word.store(std::bit_cast<uint64_t>(pair), std::memory_order_relaxed);

  const uint64_t bit = uint64_t{1} << slot;
  const uint64_t before = place.occupied.load(std::memory_order_relaxed);
  const uint64_t after = content != 0 ? before | bit : before & ~bit;
  place.occupied.store(after, std::memory_order_release);
  if (after == 0) {
    RemoveTile(tile);
  }
  return true;
}

bool DiffusionLayer::Add(NodeIndex node, uint64_t amount_q16, uint32_t most_q16) {
  const uint32_t before = Read(node);
  const uint32_t most = std::max(std::min(most_q16, kMaxContent), before);
  const auto added = static_cast<uint32_t>(std::min<uint64_t>(amount_q16, most - before));
  if (!Write(node, before + added)) {
    return false;
  }
  totals_.deposited += amount_q16;
  totals_.lost += amount_q16 - added;
  return true;
}

bool DiffusionLayer::Set(NodeIndex node, uint32_t content_q16) {
  const uint32_t before = Read(node);
  const uint32_t after = std::min(content_q16, kMaxContent);
  if (!Write(node, after)) {
    return false;
  }
  totals_.deposited += after > before ? after - before : 0;
  totals_.lost += after < before ? before - after : 0;
  return true;
}

uint64_t DiffusionLayer::BytesMissing(int32_t tile_column, int32_t tile_row, bool leaf_counted,
                                      bool top_counted) const {
  const Leaf* leaf = FindLeaf(tile_column / kLeafSide, tile_row / kLeafSide);
  if (leaf != nullptr) {
    return leaf->place[PlaceOf(tile_column, tile_row)].tile.load() != nullptr ? 0 : kTileBytes;
  }
  const bool has_top = top_counted || top_.load() != nullptr;
  return kTileBytes + (leaf_counted ? 0 : kLeafBytes) +
         (has_top ? 0 : CellMap::TopBytes(columns_, rows_));
}

void DiffusionLayer::Clear() {
  if (!leaves_.empty()) {
    budget_->Give(tile_count_ * kTileBytes + leaves_.size() * kLeafBytes +
                  CellMap::TopBytes(columns_, rows_));
    tile_count_ = 0;
    auto* removed = new Removed(top_.exchange(nullptr), std::exchange(leaves_, {}));
    reclaimer_->Retire([pool = pool_, removed] { pool->Bury(std::unique_ptr<Garbage>(removed)); });
  }
  totals_.lost += totals_.sum;
  totals_.sum = 0;
}

uint64_t DiffusionLayer::Hash() const {
  uint64_t sum = 0;
  for (const Leaf* leaf : leaves_) {
    ForEachInLeaf(*leaf, [&](NodeIndex node, uint32_t content) {
      sum += Hash64(
          {static_cast<uint64_t>(node.row) << 32 | static_cast<uint64_t>(node.column), content});
    });
  }
  return sum;
}

}  // namespace pheromone::field
