#include "server/core/field/frozen_cells.h"

#include <algorithm>
#include <bit>
#include <new>
#include <utility>

#include "server/base/bytes.h"

namespace pheromone::field {
namespace {

// The format of CellMap::Save (state.cc): a flag and a count; for each tile its position and a
// bitmap of its nodes; a word for each node.
constexpr uint64_t kHeadBytes = 1 + 4;
constexpr uint64_t kTileHeadBytes = 4 + 1 + 8;
constexpr uint64_t kNodeBytes = 8;

// The heap's overhead for a block.
constexpr uint64_t kBlockBytes = 16;

void Put(uint64_t value, size_t bytes, char** to) {
  for (size_t i = 0; i < bytes; ++i) {
    *(*to)++ = static_cast<char>(value >> (8 * i));
  }
}

// `word(i, slot)` is that of the i-th of the occupied nodes.
template <typename Word>
void AppendTile(int32_t leaf, size_t place, uint64_t occupied, Word&& word, std::string* to) {
  std::array<char, kTileHeadBytes + 64 * kNodeBytes> raw;  // NOLINT(*-member-init): set below
  char* at = raw.data();
  Put(static_cast<uint32_t>(leaf), 4, &at);
  Put(place, 1, &at);
  Put(occupied, 8, &at);
  for (size_t i = 0; occupied != 0; ++i, occupied &= occupied - 1) {
    Put(word(i, static_cast<size_t>(std::countr_zero(occupied))), 8, &at);
  }
  to->append(raw.data(), static_cast<size_t>(at - raw.data()));
}

}  // namespace

FrozenCells::FrozenCells(const CellMap* map, KeptBytes* kept)
    : map_(map),
      top_(map->top_.load(std::memory_order_relaxed)),
      has_top_(map->has_top_),
      leaf_count_(map->leaf_count()),
      tile_count_(map->tile_count()),
      bytes_(kHeadBytes + map->tile_count() * kTileHeadBytes + map->node_count() * kNodeBytes),
      leaf_(tile_count_ == 0 ? leaf_count_ : 0),
      kept_bytes_(kept) {}

void FrozenCells::LetGo() {
  if (map_ != nullptr) {
    map_->frozen_ = nullptr;
    map_ = nullptr;
  }
  if (reader_ != nullptr) {
    *std::exchange(reader_, nullptr) = nullptr;
  }
  top_ = nullptr;
  if (!done()) {
    kept_bytes_->failed = true;
  }
}

void FrozenCells::ReadOn(FrozenCells** reader) {
  map_->frozen_ = nullptr;
  map_ = nullptr;
  reader_ = reader;
  *reader = this;
}

// A change in progress must not be interrupted by an exception: without memory, the copy fails.
void FrozenCells::BeforeChange(int32_t leaf, size_t place, const CellMap::Place& now) {
  if (leaf < leaf_ || kept_bytes_->failed) {
    return;
  }
  try {
    kept_bytes_->failed = !Keep(&kept_[leaf], place, now);
  } catch (const std::bad_alloc&) {
    kept_bytes_->failed = true;
  }
}

// False if there is no room for it.
bool FrozenCells::Keep(KeptLeaf* kept, size_t place, const CellMap::Place& now) {
  const uint64_t bit = uint64_t{1} << (place % 64);
  if ((kept->settled[place / 64] & bit) != 0) {
    return true;
  }
  const uint64_t occupied = now.occupied.load(std::memory_order_relaxed);
  const auto nodes = static_cast<size_t>(std::popcount(occupied));
  uint64_t bytes = kept->settled == decltype(kept->settled){} ? sizeof(KeptLeaf) + 64 : 0;
  bytes += occupied != 0 ? sizeof(KeptTile) + kBlockBytes + nodes * kNodeBytes : 0;
  if (!kept_bytes_->budget.Take(bytes)) {
    return false;
  }
  kept->bytes += bytes;
  kept->settled[place / 64] |= bit;
  if (occupied == 0) {
    return true;  // there was no tile
  }
  const Tile* tile = now.tile.load(std::memory_order_relaxed);
  auto words = std::make_unique_for_overwrite<uint64_t[]>(nodes);
  uint64_t rest = occupied;
  for (size_t i = 0; rest != 0; ++i, rest &= rest - 1) {
    words[i] =
        tile->word[static_cast<size_t>(std::countr_zero(rest))].load(std::memory_order_relaxed);
  }
  kept->tiles.push_back({static_cast<uint8_t>(place), occupied, std::move(words)});
  return true;
}

void FrozenCells::AppendLeaf(const CellMap::Leaf* leaf, KeptLeaf* kept, std::string* to) const {
  auto next = decltype(KeptLeaf::tiles)::iterator{};
  auto end = next;
  if (kept != nullptr) {
    std::sort(kept->tiles.begin(), kept->tiles.end(),
              [](const KeptTile& a, const KeptTile& b) { return a.place < b.place; });
    next = kept->tiles.begin();
    end = kept->tiles.end();
  }
  for (size_t place = 0; place < CellMap::kPlaces; ++place) {
    if (kept != nullptr && (kept->settled[place / 64] >> (place % 64) & 1) != 0) {
      if (next != end && next->place == place) {
        AppendTile(
            leaf_, place, next->occupied, [&](size_t i, size_t) { return next->words[i]; }, to);
        ++next;
      }
      continue;
    }
    const Tile* tile =
        leaf != nullptr ? leaf->place[place].tile.load(std::memory_order_relaxed) : nullptr;
    if (tile != nullptr) {
      AppendTile(
          leaf_, place, leaf->place[place].occupied.load(std::memory_order_relaxed),
          [&](size_t, size_t slot) { return tile->word[slot].load(std::memory_order_relaxed); },
          to);
    }
  }
}

int FrozenCells::CopySome(int work, std::string* to) {
  if (!begun_) {
    begun_ = true;
    ByteWriter head;
    head.Flag(has_top_);
    head.Count(tile_count_);
    *to += head.bytes();
  }
  int done_work = 0;
  for (; leaf_ < leaf_count_ && done_work < work; ++leaf_) {
    const CellMap::Leaf* leaf =
        top_ != nullptr ? top_[leaf_].load(std::memory_order_relaxed) : nullptr;
    const auto kept = kept_.empty() ? kept_.end() : kept_.find(leaf_);
    if (leaf == nullptr && kept == kept_.end()) {
      done_work += kWorkOfNoLeaf;
      continue;
    }
    const size_t before = to->size();
    AppendLeaf(leaf, kept != kept_.end() ? &kept->second : nullptr, to);
    // The nodes of a whole tile count as a tile.
    done_work +=
        kWorkOfLeaf + static_cast<int>((to->size() - before) / (64 * kNodeBytes)) * kWorkOfTile;
    if (kept != kept_.end()) {
      kept_bytes_->budget.Give(kept->second.bytes);
      kept_.erase(kept);
    }
  }
  if (done()) {
    LetGo();
  }
  return done_work;
}

}  // namespace pheromone::field
