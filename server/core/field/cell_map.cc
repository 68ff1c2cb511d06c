#include "server/core/field/cell_map.h"

#include <cassert>
#include <utility>

#include "server/core/field/frozen_cells.h"

namespace pheromone::field {
namespace {

int32_t Leaves(int32_t nodes) {
  constexpr int32_t kNodes = kLeafSide * kTileSide;
  return (nodes + kNodes - 1) / kNodes;
}

// The writer's.
void Raise(std::atomic<uint64_t>* number, const std::atomic<uint64_t>& to) {
  const uint64_t wanted = to.load(std::memory_order_relaxed);
  if (number->load(std::memory_order_relaxed) < wanted) {
    number->store(wanted, std::memory_order_release);
  }
}

}  // namespace

// The detached nodes of a map, leaf by leaf. An incomplete copy still reads them.
class CellMap::Removed final : public Garbage {
 public:
  Removed(std::atomic<Leaf*>* top, int32_t leaf_count, FrozenCells* frozen)
      : top_(top), leaf_count_(top != nullptr ? leaf_count : 0) {
    if (frozen != nullptr) {
      frozen->ReadOn(&frozen_);
    }
  }
  ~Removed() override { delete[] top_; }

  bool Release(int tiles, TilePool* pool) override {
    const int32_t end = frozen_ != nullptr ? frozen_->leaf() : leaf_count_;
    const std::pair begin{leaf_, place_};
    for (int64_t work = int64_t{tiles} * kWorkOfTile; work > 0 && leaf_ < end;) {
      Leaf* leaf = top_[leaf_].load(std::memory_order_relaxed);
      if (leaf != nullptr && place_ < kPlaces) {
        Tile* tile = leaf->place[place_++].tile.load(std::memory_order_relaxed);
        work -= tile != nullptr ? kWorkOfTile : kWorkOfPlace;
        if (tile != nullptr) {
          pool->Give(tile);
        }
        continue;
      }
      if (leaf != nullptr) {
        pool->GiveLeaf(leaf);
      }
      work -= kWorkOfPlace;
      place_ = 0;
      ++leaf_;
    }
    return begin != std::pair{leaf_, place_} || empty();
  }
  bool empty() const override { return leaf_ == leaf_count_ && frozen_ == nullptr; }
  void LetGo() override {
    if (frozen_ != nullptr) {
      frozen_->LetGo();
    }
  }

 private:
  static constexpr int kWorkOfTile = 16;
  static constexpr int kWorkOfPlace = 1;

  std::atomic<Leaf*>* const top_;
  const int32_t leaf_count_;
  FrozenCells* frozen_ = nullptr;
  int32_t leaf_ = 0;  // the next ones
  size_t place_ = 0;
};

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
  Removed(top_.load(std::memory_order_relaxed), leaf_count(), nullptr).Release(INT32_MAX, pool_);
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

// The node's directory entry, with a tile; null if the budget has no room for everything that is
// missing.
CellMap::Place* CellMap::MakePlace(NodeIndex node) {
  Place* place = FindPlace(node);
  const uint64_t bytes =
      kTileBytes + (place == nullptr ? kLeafBytes : 0) + (has_top_ ? 0 : BytesOfTop());
  if (!budget_->Take(bytes)) {
    return nullptr;
  }
  has_top_ = true;
  reclaimer_->Collect();  // first use what readers no longer need
  if (top_.load(std::memory_order_relaxed) == nullptr) {
    top_.store(new std::atomic<Leaf*>[static_cast<size_t>(leaf_count())] {});
  }
  if (place == nullptr) {
    Leaf* leaf = pool_->TakeLeaf<Leaf>();
    leaf->emptied.store(leaf_emptied_.load(std::memory_order_relaxed), std::memory_order_relaxed);
    ++present_leaves_;
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
  const bool top_is_paid = top_counted || has_top_;
  return kTileBytes + (leaf_counted ? 0 : kLeafBytes) + (top_is_paid ? 0 : BytesOfTop());
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
  const uint64_t number = number_.load(std::memory_order_relaxed) + 1;
  // First the change, then the stamps, then the number: readers load them in reverse order.
  Leaf* leaf = TopOf(node)->load(std::memory_order_relaxed);
  std::atomic<uint64_t>* const stamp = TilePool::StampOf(tile);
  Replace(node, place, tile, state, [&] {
    stamp->store(number, std::memory_order_release);
    leaf->changed.store(number, std::memory_order_release);
  });
  number_.store(number, std::memory_order_release);
  return true;
}

void CellMap::Forget(NodeIndex node) {
  Place* place = FindPlace(node);
  Tile* tile = place != nullptr ? place->tile.load(std::memory_order_relaxed) : nullptr;
  if (tile != nullptr) {
    Replace(node, place, tile, {}, [] {});
  }
}

void CellMap::MarkAll() {
  const uint64_t number = number_.load(std::memory_order_relaxed) + 1;
  all_changed_.store(number, std::memory_order_release);
  number_.store(number, std::memory_order_release);
}

// `mark` is called after the node has its new state, and before an empty tile is removed.
template <typename Mark>
void CellMap::Replace(NodeIndex node, Place* place, Tile* tile, NodeState state, Mark&& mark) {
  if (frozen_ != nullptr) [[unlikely]] {
    frozen_->BeforeChange(LeafOf(node), PlaceOf(node), *place);
  }
  const size_t slot = SlotOf(node);
  const uint64_t bit = uint64_t{1} << slot;
  const uint64_t before = place->occupied.load(std::memory_order_relaxed);
  const uint64_t after = state.level != 0 ? before | bit : before & ~bit;
  tile->word[slot].store(state.level != 0 ? PackNode(state) : 0, std::memory_order_relaxed);
  if (after != before) {
    // A reader that sees the bit sees the tile and the word.
    place->occupied.store(after, std::memory_order_release);
    node_count_ += state.level != 0 ? 1 : static_cast<size_t>(-1);
  }
  mark();
  if (after == 0) {
    RemoveTile(node, place);
  }
}

std::unique_ptr<FrozenCells> CellMap::Freeze(KeptBytes* kept) const {
  assert(frozen_ == nullptr);
  std::unique_ptr<FrozenCells> frozen(new FrozenCells(this, kept));
  frozen_ = frozen.get();
  return frozen;
}

void CellMap::RemoveTile(NodeIndex node, Place* place) {
  Leaf* leaf = TopOf(node)->load(std::memory_order_relaxed);
  Tile* tile = place->tile.load(std::memory_order_relaxed);
  // Before the tile is removed: a reader that finds no tile sees this number.
  Raise(&leaf->emptied, *TilePool::StampOf(tile));
  place->tile.store(nullptr);
  TilePool* pool = pool_;
  budget_->Give(kTileBytes);
  --tile_count_;
  reclaimer_->Retire([pool, tile] { pool->Give(tile); });
  if (--leaf->tiles == 0) {
    Raise(&leaf_emptied_, leaf->emptied);
    TopOf(node)->store(nullptr);
    --present_leaves_;
    budget_->Give(kLeafBytes);
    reclaimer_->Retire([pool, leaf] { pool->GiveLeaf(leaf); });
  }
}

void CellMap::Clear() {
  if (tile_count_ != 0) {
    budget_->Give(tile_count_ * kTileBytes + present_leaves_ * kLeafBytes);
    node_count_ = 0;
    tile_count_ = 0;
    present_leaves_ = 0;
    auto* removed = new Removed(top_.exchange(nullptr), leaf_count(), frozen_);
    reclaimer_->Retire([pool = pool_, removed] { pool->Bury(std::unique_ptr<Garbage>(removed)); });
  }
  MarkAll();
}

}  // namespace pheromone::field
