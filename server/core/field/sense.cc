#include "server/core/field/sense.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "server/core/field/sight.h"
#include "server/core/field/wide_integer.h"

namespace pheromone::field {
namespace {

// The parts of a query that are the same for all types.
struct View {
  const Setup& setup;
  const Kernel& kernel;
  PointUm robot;
  std::span<const PointUm> antennas;
  uint64_t now_ms;
};

// How far ahead of the robot's axle line a tile reaches: column * per_column + row * per_row +
// least for its foremost node, in cells, with the margin of MaskQuery.
struct TileAhead {
  double per_column = 0;
  double per_row = 0;
  double least = 0;

  bool Reaches(int32_t column, int32_t row) const {
    return column * per_column + row * per_row + least >= 0;
  }
};

// Gathers the nodes that can contribute, for one type after the other, and sums them.
class Sum {  // NOLINT(clang-analyzer-optin.performance.Padding): in the order of their use
 public:
  Sum(const View& view, DirectionQ14 heading, const ObstacleMask* obstacles)
      : view_(view), heading_(heading), all_obstacles_(obstacles) {
    query_.now_ms = view.now_ms;
    for (const PointUm antenna : view.antennas) {
      const auto x = static_cast<double>(antenna.x - view.robot.x);
      const auto y = static_cast<double>(antenna.y - view.robot.y);
      farthest_um_ = std::max(farthest_um_, x * x + y * y);
    }
    farthest_um_ = std::sqrt(farthest_um_);
  }

  // Selects the type for the following calls.
  void Aim(const KernelLaw& law, bool directional, std::span<int64_t> sums) {
    law_ = &law;
    sums_ = sums;
    query_.cos = directional ? heading_.cos : 0;
    query_.sin = directional ? heading_.sin : 0;
    FindWindow();
  }

  // Prefetches the bitmaps that Over will read; `rows` finds the tiles (for example CellRows).
  template <typename Rows>
  void Prefetch(const Rows& rows) const {
    const int32_t far = std::min(last_.row, first_.row + kRowsAhead - 1);
    for (int32_t row = first_.row; row <= far; ++row) {
      rows.Prefetch(row, first_.column, std::min(last_.column, first_.column + kRowsAhead));
    }
  }

  // Adds the contents of a layer.
  template <typename Rows>
  void Over(const Rows& rows) {
    obstacles_ = all_obstacles_;
    if (obstacles_ != nullptr) {
      sight_.Load(*obstacles_, view_.setup.config.map, low_, high_);
      obstacles_ = sight_.any() ? obstacles_ : nullptr;
    }
    for (int32_t row = first_.row; row <= last_.row; ++row) {
      for (int32_t column = first_.column; column <= last_.column; column += kTilesAtOnce) {
        const int32_t end = std::min(last_.column + 1, column + kTilesAtOnce);
        if (tiles_.count + kTilesAtOnce > TileList::kMax) {
          AddTiles(rows);
        }
        rows.Append(row, column, end, ahead_, &tiles_);
      }
    }
    AddTiles(rows);
    Flush();
  }

 private:
  static constexpr int32_t kRowsAhead = 8;
  static constexpr int32_t kTilesAtOnce = 16;
  static constexpr uint64_t kTopBit = uint64_t{1} << 63;

  // The nodes that can contribute are in a circle around the robot that contains the reach of every
  // antenna; in cells. The margins are far larger than rounding errors at distances of at most a
  // few thousand cells.
  void FindWindow() {
    const double cells_per_um = view_.setup.cells_per_um;
    const double radius = (law_->reach_um + farthest_um_) * cells_per_um * 1.00001 + 0.05;
    mask_.radius_squared = static_cast<float>(radius * radius);
    mask_.margin = static_cast<float>(0.05 + radius * 1e-5);
    const MapGeometry& map = view_.setup.config.map;
    mask_.column = static_cast<double>(map.origin.x - view_.robot.x) * cells_per_um;
    mask_.row = static_cast<double>(map.origin.y - view_.robot.y) * cells_per_um;
    const double cos = query_.cos / 16384;
    const double sin = query_.sin / 16384;
    mask_.cos = static_cast<float>(cos);
    mask_.sin = static_cast<float>(sin);
    ahead_ = {kTileSide * cos, kTileSide * sin,
              mask_.column * cos + mask_.row * sin + mask_.margin +
                  (kTileSide - 1) * (std::max(cos, 0.0) + std::max(sin, 0.0))};
    const auto clamped = [](double node, int32_t count) {
      return static_cast<int32_t>(std::clamp(node, 0.0, static_cast<double>(count - 1)));
    };
    low_ = {clamped(-mask_.column - radius, view_.setup.columns),
            clamped(-mask_.row - radius, view_.setup.rows)};
    high_ = {clamped(-mask_.column + radius, view_.setup.columns),
             clamped(-mask_.row + radius, view_.setup.rows)};
    first_ = {low_.column >> kTileBits, low_.row >> kTileBits};
    last_ = {high_.column >> kTileBits, high_.row >> kTileBits};
  }

  template <typename Rows>
  void AddTiles(const Rows& rows) {
    view_.kernel.mask(mask_, &tiles_);
    for (size_t i = 0; i < tiles_.count; ++i) {
      Add(rows, tiles_.column[i], tiles_.row[i], tiles_.occupied[i], tiles_.words[i]);
    }
    tiles_.count = 0;
  }

  template <typename Rows>
  void Add(const Rows& rows, int32_t tile_column, int32_t tile_row, uint64_t nodes,
           const uint64_t* words) {
    if (count_ + 64 > Candidates::kMax) {
      Flush();
    }
    const MapGeometry& map = view_.setup.config.map;
    const std::array<double, 8>& cells_um = view_.setup.cells_um;
    const int64_t left = map.origin.x + int64_t{tile_column} * kTileSide * map.cell_um;
    const int64_t bottom = map.origin.y + int64_t{tile_row} * kTileSide * map.cell_um;
    const auto x = static_cast<double>(left - view_.robot.x);
    const auto y = static_cast<double>(bottom - view_.robot.y);
    // Four at a time, needed or not: their number is hard to predict, and a misprediction costs
    // more than a few unneeded stores.
    do {
      for (int i = 0; i < 4; ++i) {
        const auto slot = static_cast<size_t>(std::countr_zero(nodes | kTopBit));
        found_.x[count_] = x + cells_um[slot % kTileSide];
        found_.y[count_] = y + cells_um[slot / kTileSide];
        found_.word[count_] = rows.Word(words, slot, &made_[count_]);
        count_ += nodes != 0 ? 1 : 0;
        nodes &= nodes - 1;
      }
    } while (nodes != 0);
  }

  void Flush() {
    if (count_ == 0) {
      return;
    }
    found_.count = count_;
    const size_t antennas = view_.antennas.size();
    if (obstacles_ == nullptr) {
      for (size_t a = 0; a < antennas; a += 2) {
        Weigh(a, std::min<size_t>(antennas - a, 2), &found_);
      }
    } else {
      for (size_t a = 0; a < antennas; ++a) {
        WeighSeen(a);
      }
    }
    count_ = 0;
  }

  void Weigh(size_t first, size_t antennas, Candidates* candidates) {
    for (size_t a = 0; a < antennas; ++a) {
      const PointUm at = view_.antennas[first + a];
      query_.antenna_x[a] = static_cast<double>(at.x - view_.robot.x);
      query_.antenna_y[a] = static_cast<double>(at.y - view_.robot.y);
    }
    view_.kernel.weigh(*law_, query_, candidates, static_cast<int>(antennas), &sums_[first]);
  }

  // Only nodes in the line of sight of this antenna.
  void WeighSeen(size_t antenna);

  const View& view_;
  const DirectionQ14 heading_;
  const ObstacleMask* all_obstacles_;
  double farthest_um_ = 0;  // an antenna's distance from the robot

  const KernelLaw* law_ = nullptr;
  std::span<int64_t> sums_;
  const ObstacleMask* obstacles_ = nullptr;  // null if there are none within reach
  KernelQuery query_;
  MaskQuery mask_;
  TileAhead ahead_;
  NodeIndex low_;  // the circle's bounding box
  NodeIndex high_;
  NodeIndex first_;  // the same in tiles
  NodeIndex last_;
  TileList tiles_;
  size_t count_ = 0;
  Candidates found_;
  uint64_t made_[Candidates::kMax + 8];  // words of converted nodes
  Candidates seen_;
  SightWindow sight_;
};

void Sum::WeighSeen(size_t antenna) {
  const double cells_per_um = view_.setup.cells_per_um;
  const SightWindow::Viewpoint viewpoint = sight_.From(view_.antennas[antenna]);
  seen_.count = 0;
  // A non-negative whole number, except for rounding errors.
  const auto index = [](double node) {
    return static_cast<int32_t>(node + 0.5);  // NOLINT(bugprone-incorrect-roundings)
  };
  for (size_t i = 0; i < count_; ++i) {
    const NodeIndex node{index(found_.x[i] * cells_per_um - mask_.column),
                         index(found_.y[i] * cells_per_um - mask_.row)};
    seen_.x[seen_.count] = found_.x[i];
    seen_.y[seen_.count] = found_.y[i];
    seen_.word[seen_.count] = found_.word[i];
    seen_.count += sight_.Sees(viewpoint, node) ? 1u : 0u;
  }
  Weigh(antenna, 1, &seen_);
}

// The kernels load the words of a tile by themselves, atomically.
static_assert(sizeof(Tile) == 64 * sizeof(uint64_t));

// The tiles of a layer of cells.
struct CellRows {
  const CellMap& cells;

  const CellMap::Place* Find(int32_t tile_column, int32_t tile_row) const {
    const CellMap::Leaf* leaf = cells.FindLeaf(tile_column >> kLeafBits, tile_row >> kLeafBits);
    const int32_t at = (tile_row & (kLeafSide - 1)) * kLeafSide + (tile_column & (kLeafSide - 1));
    return leaf != nullptr ? &leaf->place[static_cast<size_t>(at)] : nullptr;
  }

  // Prefetches the bitmaps of a row of tiles.
  void Prefetch(int32_t tile_row, int32_t first, int32_t last) const {
    __builtin_prefetch(Find(first, tile_row));
    __builtin_prefetch(Find(last, tile_row));
  }

  // The address of a node's word, which is prefetched.
  static const uint64_t* Word(const uint64_t* words, size_t slot, uint64_t* /*made*/) {
    __builtin_prefetch(words + slot);
    return words + slot;
  }

  // Appends the tiles that have content and extend ahead of the axle line to the list, which has
  // room for all. Without a branch on this condition, which could not be predicted.
  void Append(int32_t row, int32_t first, int32_t end, const TileAhead& ahead,
              TileList* list) const {
    const CellMap::Place* place = nullptr;
    size_t count = list->count;
    for (int32_t column = first; column < end; ++column) {
      if (column == first || (column & (kLeafSide - 1)) == 0) {
        place = Find(column, row);
      }
      if (place == nullptr) {
        column |= kLeafSide - 1;  // nothing up to the next leaf
        continue;
      }
      const uint64_t occupied = place->occupied.load(std::memory_order_acquire);
      const Tile* tile = place->tile.load();
      list->occupied[count] = occupied;
      list->words[count] = reinterpret_cast<const uint64_t*>(tile);
      list->column[count] = column;
      list->row[count] = row;
      const bool wanted[] = {occupied != 0, tile != nullptr, ahead.Reaches(column, row)};
      count += (wanted[0] & wanted[1] & wanted[2]) ? 1u : 0u;
      ++place;
    }
    list->count = count;
  }
};

// The same if some nodes were stored under an earlier law: those are converted to the present one.
struct RebasedRows : CellRows {
  const LawChange* change;
  const PheromoneLaw* law;

  const uint64_t* Word(const uint64_t* words, size_t slot, uint64_t* made) const {
    const NodeState stored = UnpackNode(__atomic_load_n(words + slot, __ATOMIC_RELAXED));
    *made = PackNode(Rebased(change, *law, stored));
    return made;
  }
};

// The tiles of a diffusing layer: two contents per word, converted to nodes that do not evaporate.
struct DiffusingRows {
  const DiffusionLayer& layer;

  static const uint64_t* Word(const uint64_t* words, size_t slot, uint64_t* made) {
    const uint64_t pair = __atomic_load_n(words + slot / 2, __ATOMIC_RELAXED);
    const auto content = std::bit_cast<std::array<uint32_t, 2>>(pair)[slot % 2];
    *made = PackNode({LevelOfDiffusing(content), 0});
    return made;
  }

  void Append(int32_t row, int32_t first, int32_t end, const TileAhead& ahead,
              TileList* list) const {
    for (int32_t column = first; column < end; ++column) {
      const DiffusionLayer::TileView tile = layer.Find(column, row);
      list->occupied[list->count] = tile.occupied;
      list->words[list->count] = reinterpret_cast<const uint64_t*>(tile.pairs);
      list->column[list->count] = column;
      list->row[list->count] = row;
      list->count += tile.occupied != 0 && ahead.Reaches(column, row) ? 1u : 0u;
    }
  }
};

// P = 4096 * sum / (64 * 65 536), the factors of the parts in 10^-9; to nearest, halves away from
// zero; clamped to the range of the callers' type.
int64_t ToIntensity(Int128 total) {
  constexpr int64_t kDivisor = int64_t{1024} * 1'000'000'000;
  constexpr int64_t kMax = int64_t{1} << 62;
  if (total > -kMax && total < kMax) {
    return RoundDiv(static_cast<int64_t>(total), kDivisor);
  }
  const Int128 rounded =
      total < 0 ? -((-total + kDivisor / 2) / kDivisor) : (total + kDivisor / 2) / kDivisor;
  return static_cast<int64_t>(std::clamp<Int128>(rounded, -kMax, kMax));
}

}  // namespace

void SenseAt(const Setup& setup, const Layers& layers, const Kernel& kernel, uint8_t type,
             const PoseUm& pose, DirectionQ14 heading, std::span<const PointUm> antennas,
             uint64_t now_ms, std::span<int64_t> intensities) {
  constexpr size_t kAtOnce = 16;
  const ObstacleMask* obstacles = setup.config.obstacles ? &*setup.config.obstacles : nullptr;
  for (size_t first = 0; first < antennas.size(); first += kAtOnce) {
    const auto some = antennas.subspan(first, std::min(kAtOnce, antennas.size() - first));
    const View view{setup, kernel, pose.position, some, now_ms};
    Sum sum(view, heading, obstacles);
    int64_t sums[kAtOnce];
    const auto aim = [&](const Part& part) {
      sum.Aim(setup.kernel_law[part.type], setup.law[part.type]->directional, {sums, some.size()});
    };
    for (const Part& part : setup.parts[type]) {
      if (!setup.law[part.type]->diffuses()) {
        aim(part);
        sum.Prefetch(CellRows{*layers.cells[part.type]});
      }
    }
    Int128 total[kAtOnce] = {};
    for (const Part& part : setup.parts[type]) {
      std::fill_n(sums, some.size(), 0);
      aim(part);
      if (setup.law[part.type]->diffuses()) {
        sum.Over(DiffusingRows{*layers.diffusing[part.type]});
      } else if (const LawChange* change = setup.ChangeOf(part.type); change != nullptr) {
        sum.Over(RebasedRows{{*layers.cells[part.type]}, change, setup.law[part.type]});
      } else {
        sum.Over(CellRows{*layers.cells[part.type]});
      }
      for (size_t a = 0; a < some.size(); ++a) {
        total[a] += Int128{part.factor} * sums[a];
      }
    }
    for (size_t a = 0; a < some.size(); ++a) {
      intensities[first + a] = ToIntensity(total[a]);
    }
  }
}

}  // namespace pheromone::field
