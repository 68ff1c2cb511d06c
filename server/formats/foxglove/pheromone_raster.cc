#include "server/formats/foxglove/pheromone_raster.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <sstream>

#include "server/base/bytes.h"
#include "server/formats/foxglove/messages.h"

namespace pheromone::web {
namespace {

// How far below the next scale the peak has to be before that is used.
constexpr double kMargin = 0.8;

int32_t NodesPerCell(const field::MapGeometry& map) {
  const int32_t most = std::max(map.columns(), map.rows());
  return (most + PheromoneRaster::kMaxSide - 1) / PheromoneRaster::kMaxSide;
}

int32_t Parts(int32_t whole, int32_t part) {
  return (whole + part - 1) / part;
}

}  // namespace

double RoundScale(double peak) {
  const double power = std::pow(10, std::floor(std::log10(peak)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (peak <= step * power * (1 + 1e-9)) {  // a peak of 0.2 is not above a scale of 0.2
      return step * power;
    }
  }
  return 10 * power;
}

PheromoneRaster::PheromoneRaster(const field::FieldConfig& config, uint8_t type, uint64_t version)
    : map_(config.map),
      obstacles_(config.obstacles),
      type_(type),
      evaporates_(config.FindLaw(type)->tau_ms != 0),
      unit_(static_cast<double>(config.FindLaw(type)->quantum_micro) / field::kLevelsPerQuantum /
            1e6),
      nodes_per_cell_(NodesPerCell(config.map)),
      columns_(Parts(config.map.columns(), nodes_per_cell_)),
      rows_(Parts(config.map.rows(), nodes_per_cell_)),
      tile_columns_(Parts(columns_, kTileSide)),
      tile_rows_(Parts(rows_, kTileSide)),
      cell_um_(config.map.cell_um * nodes_per_cell_),
      centre_{config.map.origin.x + (nodes_per_cell_ - 1) * config.map.cell_um / 2,
              config.map.origin.y + (nodes_per_cell_ - 1) * config.map.cell_um / 2},
      levels_(static_cast<size_t>(columns_) * static_cast<size_t>(rows_)),
      bytes_(levels_.size()),
      tiles_(static_cast<size_t>(tile_columns_) * static_cast<size_t>(tile_rows_)),
      scale_(RoundScale(unit_ * field::kLevelsPerQuantum)),
      version_(version) {
  if (obstacles_ && !obstacles_->empty()) {
    blocked_.resize(levels_.size());
    obstacles_->ForEach([&](field::NodeIndex node) {
      blocked_[IndexOf(node.column / nodes_per_cell_, node.row / nodes_per_cell_)] = 1;
    });
  }
}

PheromoneRaster::Span PheromoneRaster::ColumnsOf(int32_t tile) const {
  return {tile * kTileSide, std::min(columns_, (tile + 1) * kTileSide)};
}

PheromoneRaster::Span PheromoneRaster::RowsOf(int32_t tile) const {
  return {tile * kTileSide, std::min(rows_, (tile + 1) * kTileSide)};
}

void PheromoneRaster::MarkDirty(const field::NodeArea& area) {
  const int32_t nodes = nodes_per_cell_ * kTileSide;
  for (int32_t row = area.begin.row / nodes; row <= (area.end.row - 1) / nodes; ++row) {
    for (int32_t column = area.begin.column / nodes; column <= (area.end.column - 1) / nodes;
         ++column) {
      At(column, row).is_dirty = true;
    }
  }
}

bool PheromoneRaster::Update(const field::FieldReader& reader, uint64_t now_ms, bool evaporates,
                             const std::function<void()>& between_pieces) {
  now_ms_ = std::max(now_ms_, now_ms);
  seen_ = reader
              .VisitChanged(type_, {{0, 0}, {map_.columns(), map_.rows()}}, seen_,
                            [&](const field::NodeArea& area) { MarkDirty(area); })
              .number;
  std::vector<std::pair<int32_t, int32_t>> changed;
  for (int32_t row = 0; row < tile_rows_; ++row) {
    for (int32_t column = 0; column < tile_columns_; ++column) {
      Tile& tile = At(column, row);
      if (tile.is_dirty || (evaporates && evaporates_ && tile.peak != 0)) {
        ReadLevels(reader, column, row, between_pieces);
        changed.emplace_back(column, row);
      }
    }
  }
  const bool rescaled = ChooseScale() || is_new_;
  is_new_ = false;
  const uint64_t before = version_++;
  bool any = rescaled;
  if (rescaled) {
    full_version_ = version_;
    for (int32_t row = 0; row < tile_rows_; ++row) {
      for (int32_t column = 0; column < tile_columns_; ++column) {
        WriteBytes(column, row, &At(column, row));
        between_pieces();
      }
    }
  } else {
    for (const auto& [column, row] : changed) {
      any |= WriteBytes(column, row, &At(column, row));
      between_pieces();
    }
  }
  if (!any) {
    version_ = before;
  }
  return any;
}

// The levels of one tile's cells, and their peak.
void PheromoneRaster::ReadLevels(const field::FieldReader& reader, int32_t tile_column,
                                 int32_t tile_row, const std::function<void()>& between_pieces) {
  const Span columns = ColumnsOf(tile_column);
  const Span rows = RowsOf(tile_row);
  for (int32_t row = rows.first; row < rows.end; ++row) {
    std::fill_n(levels_.begin() + static_cast<ptrdiff_t>(IndexOf(columns.first, row)),
                columns.end - columns.first, 0u);
  }
  Tile& tile = At(tile_column, tile_row);
  tile.is_dirty = false;
  tile.peak = 0;
  const int32_t nodes_in_row = kTileSide * nodes_per_cell_ * nodes_per_cell_;
  const int32_t rows_at_once = std::max(1, kPieceNodes / nodes_in_row);
  for (int32_t row = rows.first; row < rows.end; row += rows_at_once) {
    const int32_t end = std::min(rows.end, row + rows_at_once);
    reader.VisitLevels(
        type_,
        {{columns.first * nodes_per_cell_, row * nodes_per_cell_},
         {columns.end * nodes_per_cell_, end * nodes_per_cell_}},
        now_ms_, [&](field::NodeIndex node, uint32_t level) {
          uint32_t& cell =
              levels_[IndexOf(node.column / nodes_per_cell_, node.row / nodes_per_cell_)];
          cell = std::max(cell, level);
          tile.peak = std::max(tile.peak, level);
        });
    between_pieces();
  }
}

// Whether it is another one.
bool PheromoneRaster::ChooseScale() {
  uint32_t peak_level = 0;
  for (const Tile& tile : tiles_) {
    peak_level = std::max(peak_level, tile.peak);
  }
  if (peak_level == 0) {
    return false;
  }
  const double peak = peak_level * unit_;
  const double wanted =
      peak > scale_ * (1 + 1e-9) ? RoundScale(peak) : std::min(scale_, RoundScale(peak / kMargin));
  const bool differs = std::fabs(wanted - scale_) > scale_ * 1e-9;
  scale_ = differs ? wanted : scale_;
  return differs;
}

uint8_t PheromoneRaster::ByteOf(size_t cell) const {
  const uint32_t level = levels_[cell];
  if (level == 0) {
    return !blocked_.empty() && blocked_[cell] != 0 ? kBlocked : uint8_t{0};
  }
  const double share = std::round(level * unit_ / scale_ * kFullScale);
  return static_cast<uint8_t>(std::clamp(share, 1.0, double{kFullScale}));
}

// Whether one of them changed.
bool PheromoneRaster::WriteBytes(int32_t tile_column, int32_t tile_row, Tile* tile) {
  const Span columns = ColumnsOf(tile_column);
  const Span rows = RowsOf(tile_row);
  bool changed = false;
  uint8_t all = 0;
  for (int32_t row = rows.first; row < rows.end; ++row) {
    for (size_t cell = IndexOf(columns.first, row); cell < IndexOf(columns.end, row); ++cell) {
      const uint8_t byte = ByteOf(cell);
      changed |= byte != bytes_[cell];
      bytes_[cell] = byte;
      all |= byte;
    }
  }
  tile->is_empty = all == 0;
  if (changed) {
    tile->version = version_;
  }
  return changed;
}

std::string PheromoneRaster::Encode(uint64_t since) const {
  const bool full = since < full_version_;
  std::vector<std::pair<int32_t, int32_t>> wanted;
  for (int32_t row = 0; row < tile_rows_; ++row) {
    for (int32_t column = 0; column < tile_columns_; ++column) {
      const Tile& tile = At(column, row);
      if (full ? !tile.is_empty : tile.version > since) {
        wanted.emplace_back(column, row);
      }
    }
  }
  ByteWriter writer;
  writer.U8(1);
  writer.U8(type_);
  writer.U8(uint8_t{kTileSide});
  writer.U8(full ? 1 : 0);
  writer.U16(static_cast<uint16_t>(columns_));
  writer.U16(static_cast<uint16_t>(rows_));
  writer.I64(centre_.x);
  writer.I64(centre_.y);
  writer.U32(static_cast<uint32_t>(std::min<int64_t>(cell_um_, UINT32_MAX)));
  writer.U32(std::bit_cast<uint32_t>(static_cast<float>(scale_)));
  writer.U64(now_ms_);
  writer.U16(static_cast<uint16_t>(wanted.size()));
  for (const auto& [tile_column, tile_row] : wanted) {
    writer.U16(static_cast<uint16_t>(tile_column));
    writer.U16(static_cast<uint16_t>(tile_row));
    const Span columns = ColumnsOf(tile_column);
    const Span rows = RowsOf(tile_row);
    for (int32_t row = rows.first; row < rows.end; ++row) {
      writer.Raw(bytes().substr(IndexOf(columns.first, row),
                                static_cast<size_t>(columns.end - columns.first)));
    }
  }
  return foxglove::EncodeTiles(writer.Take());
}

std::string PheromoneRaster::EncodeGrid(uint64_t unix_ns) const {
  constexpr double kUmPerM = 1e6;
  const field::PointUm corner = twice_corner_um();
  std::ostringstream meaning;  // in ASCII: it is shown in a menu
  meaning << int{kFullScale} << " = " << scale_ << " units";
  return foxglove::EncodeGrid(unix_ns,
                              {.corner = {static_cast<double>(corner.x) / 2 / kUmPerM,
                                          static_cast<double>(corner.y) / 2 / kUmPerM, 0},
                               .columns = static_cast<uint32_t>(columns_),
                               .cell_m = static_cast<double>(cell_um_) / kUmPerM,
                               .names = {"level", meaning.str()}},
                              bytes());
}

}  // namespace pheromone::web
