#include "server/core/field/bench/baselines.h"

#if defined(__linux__)
#include <sys/mman.h>
#endif

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <new>

#include "server/core/field/heading.h"

namespace pheromone::field::bench {
namespace {

size_t RoundUp(size_t value, size_t unit) {
  return (value + unit - 1) / unit * unit;
}

constexpr size_t kTileSide = 8;
constexpr size_t kLineWords = 8;
constexpr size_t kTouchAhead = 64;  // more lines than a core can wait for at once

}  // namespace

AntennaPair AntennaPairOf(const PoseUm& pose, int64_t distance_um) {
  const DirectionQ14 heading = DirectionOf(pose.heading);
  const double half = static_cast<double>(distance_um) / 2 / 16384;
  const double across_x = -half * heading.sin;
  const double across_y = half * heading.cos;
  const auto x = static_cast<double>(pose.position.x);
  const auto y = static_cast<double>(pose.position.y);
  return {x + across_x, y + across_y, x - across_x, y - across_y};
}

ScannedMap::ScannedMap(const MapGeometry& map, int64_t antenna_distance_um, const PheromoneLaw& law)
    : map_(map),
      antenna_distance_um_(antenna_distance_um),
      law_(law),
      stride_(RoundUp(static_cast<size_t>(map.columns()), kWidestRegister)),
      words_(stride_ * static_cast<size_t>(map.rows())) {}

uint32_t ScannedMap::Ticks(uint64_t time_ms) const {
  return static_cast<uint32_t>((time_ms << kTicksPerTauBits) / static_cast<uint64_t>(law_.tau_ms)) &
         kTickMask;
}

void ScannedMap::Deposit(PointUm point, uint16_t quanta, uint64_t now_ms) {
  const NodeIndex node = map_.NearestNode(point);
  uint32_t& word =
      words_[static_cast<size_t>(node.row) * stride_ + static_cast<size_t>(node.column)];
  const uint32_t now = Ticks(now_ms);
  const uint32_t count = word >> kTickBits;
  const uint32_t gone = std::min(count, ((now - word) & kTickMask) >> kTicksPerTauBits);
  const uint32_t next = std::min<uint32_t>(count - gone + quanta, law_.max_count);
  word = (next << kTickBits) | now;
}

Smell ScannedMap::Scan(void (*scan)(const ScanQuery&, float*), const PoseUm& pose,
                       uint64_t now_ms) const {
  const auto cell = static_cast<double>(map_.cell_um);
  const auto cells_x = [&](double um) {
    return static_cast<float>((um - static_cast<double>(map_.origin.x)) / cell);
  };
  const auto cells_y = [&](double um) {
    return static_cast<float>((um - static_cast<double>(map_.origin.y)) / cell);
  };
  const AntennaPair antennas = AntennaPairOf(pose, antenna_distance_um_);
  const DirectionQ14 heading = DirectionOf(pose.heading);
  ScanQuery query;
  query.words = words_.data();
  query.rows = map_.rows();
  query.stride = static_cast<int32_t>(stride_);
  query.now_ticks = Ticks(now_ms);
  query.centre_x = cells_x(static_cast<double>(pose.position.x));
  query.centre_y = cells_y(static_cast<double>(pose.position.y));
  query.cos = static_cast<float>(heading.cos) / 16384;
  query.sin = static_cast<float>(heading.sin) / 16384;
  query.antenna_x[0] = cells_x(antennas.left_x);
  query.antenna_y[0] = cells_y(antennas.left_y);
  query.antenna_x[1] = cells_x(antennas.right_x);
  query.antenna_y[1] = cells_y(antennas.right_y);
  query.reach = static_cast<float>(static_cast<double>(law_.reach_um()) / cell);
  query.inverse_sigma = static_cast<float>(cell / static_cast<double>(law_.sigma_um));
  float sum[2] = {0, 0};
  scan(query, sum);
  const double quantum = static_cast<double>(law_.quantum_micro) / 1e6;
  return {sum[0] * quantum, sum[1] * quantum};
}

DenseGrid::DenseGrid(const MapGeometry& map, int64_t antenna_distance_um, int reach_cells)
    : map_(map),
      antenna_distance_um_(antenna_distance_um),
      reach_(reach_cells),
      side_(static_cast<int32_t>(
          RoundUp(static_cast<size_t>(map.columns()) + 2 * static_cast<size_t>(reach_cells),
                  kWidestRegister))) {
  for (int32_t dy = -reach_; dy <= reach_; ++dy) {
    for (int32_t dx = -reach_; dx <= reach_; ++dx) {
      const double distance = std::hypot(dx, dy);
      stamp_.push_back(static_cast<float>(std::max(0.0, 1 - distance / reach_)));
    }
  }
  cells_.resize(static_cast<size_t>(side_) *
                (static_cast<size_t>(map.rows()) + 2 * static_cast<size_t>(reach_cells)));
}

void DenseGrid::Stamp(const Wide& wide, PointUm point) {
  const NodeIndex node = map_.NearestNode(point);
  float* corner = &cells_[static_cast<size_t>(node.row) * static_cast<size_t>(side_) +
                          static_cast<size_t>(node.column)];
  wide.stamp(corner, static_cast<size_t>(side_), stamp_.data(), 2 * reach_ + 1);
}

float DenseGrid::At(double x_um, double y_um) const {
  const NodeIndex node = map_.NearestNode({static_cast<int64_t>(x_um), static_cast<int64_t>(y_um)});
  return cells_[static_cast<size_t>(node.row + reach_) * static_cast<size_t>(side_) +
                static_cast<size_t>(node.column + reach_)];
}

Smell DenseGrid::Sense(const PoseUm& pose) const {
  const AntennaPair antennas = AntennaPairOf(pose, antenna_distance_um_);
  return {At(antennas.left_x, antennas.left_y), At(antennas.right_x, antennas.right_y)};
}

std::vector<uint32_t> LinesUnder(const MapGeometry& map, int64_t antenna_distance_um,
                                 int64_t reach_um, const std::vector<PoseUm>& poses) {
  const auto cell = static_cast<double>(map.cell_um);
  const double reach = static_cast<double>(reach_um) / cell;
  const size_t tiles_in_a_row = RoundUp(static_cast<size_t>(map.columns()), kTileSide) / kTileSide;
  std::vector<uint32_t> lines;
  for (const PoseUm& pose : poses) {
    const AntennaPair antennas = AntennaPairOf(pose, antenna_distance_um);
    const DirectionQ14 heading = DirectionOf(pose.heading);
    const double x = static_cast<double>(pose.position.x - map.origin.x) / cell;
    const double y = static_cast<double>(pose.position.y - map.origin.y) / cell;
    const double half = static_cast<double>(antenna_distance_um) / 2 / cell;
    const auto within = [&](double low, int32_t count) {
      return static_cast<int32_t>(std::clamp<double>(low, 0, count - 1));
    };
    const int32_t top = within(std::floor(y + half + reach), map.rows());
    const int32_t last = within(std::floor(x + half + reach), map.columns());
    for (int32_t row = within(std::ceil(y - half - reach), map.rows()); row <= top; ++row) {
      size_t known = SIZE_MAX;
      for (int32_t column = within(std::ceil(x - half - reach), map.columns()); column <= last;
           ++column) {
        const double node_x = static_cast<double>(map.PositionOf({column, row}).x);
        const double node_y = static_cast<double>(map.PositionOf({column, row}).y);
        const bool in_reach =
            std::hypot(node_x - antennas.left_x, node_y - antennas.left_y) <= reach * cell ||
            std::hypot(node_x - antennas.right_x, node_y - antennas.right_y) <= reach * cell;
        const bool ahead = (column - x) * heading.cos + (row - y) * heading.sin >= 0;
        const size_t tile = static_cast<size_t>(row) / kTileSide * tiles_in_a_row +
                            static_cast<size_t>(column) / kTileSide;
        if (in_reach && ahead && tile != known) {
          known = tile;
          lines.push_back(
              static_cast<uint32_t>(tile * kTileSide + static_cast<size_t>(row) % kTileSide));
        }
      }
    }
  }
  return lines;
}

size_t TiledBytes(const MapGeometry& map) {
  return RoundUp(static_cast<size_t>(map.columns()), kTileSide) *
         RoundUp(static_cast<size_t>(map.rows()), kTileSide) * sizeof(uint64_t);
}

TiledMemory::TiledMemory(const MapGeometry& map) {
  constexpr size_t kLargePage = size_t{1} << 21;
  const size_t bytes = RoundUp(TiledBytes(map), kLargePage);
  void* memory = std::aligned_alloc(kLargePage, bytes);
  if (memory == nullptr) {
    throw std::bad_alloc();
  }
#if defined(__linux__)
  madvise(memory, bytes, MADV_HUGEPAGE);  // a wish; without it the bound is a little higher
#endif
  words_.reset(static_cast<uint64_t*>(memory));
  std::fill_n(words_.get(), bytes / sizeof(uint64_t), 1);  // so that there is memory behind it
}

void TiledMemory::Free::operator()(void* memory) const {
  std::free(memory);
}

uint64_t TiledMemory::Touch(const std::vector<uint32_t>& lines) const {
  uint64_t sum = 0;
  for (size_t i = 0; i < lines.size(); ++i) {
    __builtin_prefetch(&words_[lines[std::min(i + kTouchAhead, lines.size() - 1)] * kLineWords]);
    sum += words_[lines[i] * kLineWords];
  }
  return sum;
}

}  // namespace pheromone::field::bench
