// A step of a layer: allocates tiles for flows, runs the kernel on every tile, and releases tiles
// that have become empty.

#include <algorithm>
#include <cassert>
#include <tuple>

#include "server/core/field/diffusion.h"

namespace pheromone::field {
namespace {

using Pair = std::array<uint32_t, 2>;
constexpr size_t kPairs = 32;

// One side of a tile: the position of the neighbour, and the nodes along the border.
struct Side {
  int32_t columns;  // to the neighbour, in tiles
  int32_t rows;
  int first;   // slot along the border
  int stride;  // to the next one
  int across;  // to the neighbour's slot beyond the border
};
constexpr size_t kSides = DiffusionTile::kSides;
// In the order of DiffusionTile::beside.
constexpr std::array<Side, kSides> kSide = {
    {{-1, 0, 0, 8, 7}, {1, 0, 7, 8, -7}, {0, -1, 0, 1, 56}, {0, 1, 56, 1, -56}}};

constexpr uint64_t kAll = UINT64_MAX;
constexpr uint64_t kColumn0 = 0x0101'0101'0101'0101;

// The byte of a tile's leftmost column: bit `row` is bit 8 * row.
uint8_t FirstColumn(uint64_t nodes) {
  return static_cast<uint8_t>(((nodes & kColumn0) * 0x0102'0408'1020'4080) >> 56);
}

// The edges between free nodes, `beside` being the free nodes of the four neighbours.
void OpenEdges(uint64_t free, const std::array<uint64_t, kSides>& beside, DiffusionTile* tile) {
  const uint64_t to_the_right =
      ((free & ~kColumn0) >> 1) | ((beside[DiffusionTile::kRight] & kColumn0) << (kTileSide - 1));
  tile->open_right = free & to_the_right;
  tile->open_above = free & ((free >> 8) | (beside[DiffusionTile::kAbove] << 56));
  tile->open_left = FirstColumn(free & (beside[DiffusionTile::kLeft] >> (kTileSide - 1)));
  tile->open_below = static_cast<uint8_t>(free & (beside[DiffusionTile::kBelow] >> 56));
}

// k^n in 2^-32, for k < 1.
uint64_t PowerQ32(uint64_t k, uint64_t n) {
  uint64_t power = uint64_t{1} << 32;
  for (; n != 0 && power != 0; n >>= 1) {
    if (n % 2 != 0) {
      power = (power * k) >> 32;
    }
    k = (k * k) >> 32;
  }
  return power;
}

}  // namespace

// A leaf and its neighbours.
struct DiffusionLayer::Surroundings {
  Surroundings(const DiffusionLayer& layer, const Leaf& leaf_in) : leaf(leaf_in) {
    for (size_t s = 0; s < kSides; ++s) {
      const int32_t column = leaf.column + kSide[s].columns;
      const int32_t row = leaf.row + kSide[s].rows;
      const bool on_map =
          column >= 0 && column < layer.leaf_columns_ && row >= 0 && row < layer.leaf_rows_;
      beside[s] = on_map ? layer.FindLeaf(column, row) : nullptr;
    }
    // Each word has four rows of the leaf's tiles.
    constexpr uint64_t kMiddle = 0x7FFE'7FFE'7FFE'7FFE;
    for (size_t i = 0; i < 4; ++i) {
      const uint64_t tiles = leaf.tiles[i];
      const uint64_t above = tiles >> 16 | (i < 3 ? leaf.tiles[i + 1] << 48 : 0);
      const uint64_t below = tiles << 16 | (i > 0 ? leaf.tiles[i - 1] >> 48 : 0);
      surrounded[i] = tiles & tiles >> 1 & tiles << 1 & above & below & kMiddle;
    }
  }

  // All four neighbours exist, and are in this leaf.
  bool IsSurrounded(size_t place) const {
    return (surrounded[place / 64] >> (place % 64) & 1) != 0;
  }

  // Null where there is none.
  Tile* TileBeside(size_t place, size_t side) const {
    const int32_t column = static_cast<int32_t>(place) % kLeafSide + kSide[side].columns;
    const int32_t row = static_cast<int32_t>(place) / kLeafSide + kSide[side].rows;
    const bool inside = column >= 0 && column < kLeafSide && row >= 0 && row < kLeafSide;
    const Leaf* in = inside ? &leaf : beside[side];
    return in != nullptr
               ? in->place[PlaceOf(column & (kLeafSide - 1), row & (kLeafSide - 1))].tile.load(
                     std::memory_order_relaxed)
               : nullptr;
  }

  const Leaf& leaf;
  std::array<const Leaf*, kSides> beside{};  // null where there is none
  std::array<uint64_t, 4> surrounded{};
};

// The nodes of a tile that are on the map and not blocked; 0 off the map.
uint64_t DiffusionLayer::FreeNodes(NodeIndex tile, const ObstacleMask* obstacles) const {
  const int32_t columns = columns_ - tile.column * kTileSide;
  const int32_t rows = rows_ - tile.row * kTileSide;
  if (tile.column < 0 || tile.row < 0 || columns <= 0 || rows <= 0) {
    return 0;
  }
  const uint64_t row = columns < kTileSide ? (uint64_t{1} << columns) - 1 : 0xFF;
  const uint64_t on_map =
      row * kColumn0 & (rows < kTileSide ? (uint64_t{1} << (rows * kTileSide)) - 1 : kAll);
  return obstacles != nullptr ? on_map & ~obstacles->TileBits(tile.column, tile.row) : on_map;
}

// Allocates the tiles into which something will flow. False if there was no memory for all of them.
bool DiffusionLayer::MakeRoom(const DiffusionLaw& law, const ObstacleMask* obstacles) {
  if (law.exchange_q16 == 0) {
    return true;
  }
  const uint32_t least = (65535 + law.exchange_q16) / law.exchange_q16;  // for a flow of 1
  std::vector<NodeIndex> wanted;
  for (const Leaf* leaf : leaves_) {
    const Surroundings around(*this, *leaf);
    ForEachPlace(*leaf, [&](size_t place) {
      for (size_t s = around.IsSurrounded(place) ? kSides : 0; s < kSides; ++s) {
        if (around.TileBeside(place, s) != nullptr) {
          continue;
        }
        const Side& side = kSide[s];
        const NodeIndex tile = TileIndex(*leaf, place);
        const NodeIndex beside{tile.column + side.columns, tile.row + side.rows};
        const uint64_t free = FreeNodes(tile, obstacles);
        const uint64_t free_beside = FreeNodes(beside, obstacles);
        const TileView view = View(leaf->place[place]);
        for (int slot = side.first, i = 0; i < kTileSide; ++i, slot += side.stride) {
          if ((free >> slot & free_beside >> (slot + side.across) & 1) != 0 &&
              view[static_cast<size_t>(slot)] >= least) {
            wanted.push_back(beside);
            break;
          }
        }
      }
    });
  }
  // The order decides which tiles get the last memory.
  std::sort(wanted.begin(), wanted.end(), [](NodeIndex a, NodeIndex b) {
    return std::tie(a.row, a.column) < std::tie(b.row, b.column);
  });
  wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
  const uint64_t refused_before = refused_tiles_;
  for (const NodeIndex tile : wanted) {
    if (MakeTile(tile) == nullptr) {
      ++refused_tiles_;
    }
  }
  return refused_tiles_ == refused_before;
}

void DiffusionLayer::Replace(Place* place, size_t side, const Contents& contents,
                             uint64_t occupied) {
  std::atomic<uint64_t>* pairs = PairsOf(place->tile.load(std::memory_order_relaxed), side);
  for (size_t i = 0; i < kPairs; ++i) {
    const Pair pair{contents[2 * i], contents[2 * i + 1]};
    pairs[i].store(std::bit_cast<uint64_t>(pair), std::memory_order_relaxed);
  }
  place->occupied.store(occupied, std::memory_order_release);
}

// Finds the neighbours of a tile. If `room` is false, there may have been no memory for a missing
// tile; otherwise nothing flows into it.
void DiffusionLayer::LookAround(const Surroundings& around, size_t place, bool room,
                                const ObstacleMask* obstacles, DiffusionTile* work) const {
  static Tile nothing{};
  const NodeIndex tile = TileIndex(around.leaf, place);
  const size_t side = side_.load(std::memory_order_relaxed);
  const auto contents = [&](size_t at) {
    return PairsOf(around.leaf.place[at].tile.load(std::memory_order_relaxed), side);
  };
  work->centre = contents(place);
  const bool on_map = tile.column > 0 && tile.row > 0 &&
                      (tile.column + 2) * kTileSide <= columns_ &&
                      (tile.row + 2) * kTileSide <= rows_;
  if (obstacles == nullptr && on_map && around.IsSurrounded(place)) {  // most of a large blob
    for (size_t s = 0; s < kSides; ++s) {
      work->beside[s] =
          contents(place + static_cast<size_t>(kSide[s].columns + kSide[s].rows * kLeafSide));
    }
    work->open_right = work->open_above = kAll;
    work->open_left = work->open_below = UINT8_MAX;
    return;
  }
  std::array<uint64_t, kSides> free_beside{};
  for (size_t s = 0; s < kSides; ++s) {
    Tile* there = around.TileBeside(place, s);
    const NodeIndex at{tile.column + kSide[s].columns, tile.row + kSide[s].rows};
    free_beside[s] = there == nullptr && !room ? 0 : FreeNodes(at, obstacles);
    work->beside[s] = PairsOf(there != nullptr ? there : &nothing, side);
  }
  OpenEdges(FreeNodes(tile, obstacles), free_beside, work);
}

void DiffusionLayer::Step(const DiffusionLaw& law, const ObstacleMask* obstacles) {
  assert(law.exchange_q16 <= kMaxExchangeQ16);
  if (empty()) {
    return;
  }
  const bool room = MakeRoom(law, obstacles);
  const DiffusionNumbers numbers{law.exchange_q16, law.keep_q32, law.cutoff_q16};
  const size_t other_side = 1 - side_.load(std::memory_order_relaxed);
  Contents next;
  std::vector<NodeIndex> emptied;
  uint64_t sum = 0;
  uint64_t cut = 0;
  for (Leaf* leaf : leaves_) {
    const Surroundings around(*this, *leaf);
    ForEachPlace(*leaf, [&](size_t place) {
      DiffusionTile work;  // NOLINT(*-member-init): all of it is set below
      LookAround(around, place, room, obstacles, &work);
      work.next = next.data();
      kernel_.step(numbers, &work);
      Replace(&leaf->place[place], other_side, next, work.occupied);
      sum += work.sum;
      cut += work.cut;
      if (work.occupied == 0) {
        emptied.push_back(TileIndex(*leaf, place));
      }
    });
  }
  side_.store(other_side, std::memory_order_release);
  Account(sum, cut);
  for (const NodeIndex tile : emptied) {
    RemoveTile(tile);
  }
}

void DiffusionLayer::Decay(const DiffusionLaw& law, uint64_t steps) {
  if (steps == 0) {
    return;
  }
  const uint64_t keep = law.keep_q32 != 0 ? PowerQ32(law.keep_q32, steps) : uint64_t{1} << 32;
  std::vector<NodeIndex> emptied;
  uint64_t sum = 0;
  uint64_t cut = 0;
  for (Leaf* leaf : leaves_) {
    ForEachPlace(*leaf, [&](size_t index) {
      const TileView before = View(leaf->place[index]);
      Contents next;
      uint64_t occupied = 0;
      for (size_t slot = 0; slot < next.size(); ++slot) {
        const auto kept = static_cast<uint32_t>((before[slot] * keep) >> 32);
        next[slot] = kept < law.cutoff_q16 ? 0 : kept;
        occupied |= uint64_t{next[slot] != 0} << slot;
        sum += next[slot];
        cut += kept - next[slot];
      }
      Replace(&leaf->place[index], side_.load(std::memory_order_relaxed), next, occupied);
      if (occupied == 0) {
        emptied.push_back(TileIndex(*leaf, index));
      }
    });
  }
  Account(sum, cut);
  for (const NodeIndex tile : emptied) {
    RemoveTile(tile);
  }
}

// Updates the totals: `sum` is left and `cut` was cut off.
void DiffusionLayer::Account(uint64_t sum, uint64_t cut) {
  totals_.evaporated += totals_.sum - sum - cut;
  totals_.lost += cut;
  totals_.sum = sum;
}

}  // namespace pheromone::field
