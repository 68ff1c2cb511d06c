// One pheromone on the whole map, as bytes for viewers, kept up to date from what changes in the
// field: at most 512 x 512 cells, in tiles of 32 x 32 that say when they changed.
//
//   PheromoneRaster raster(config, type);
//   if (raster.Update(reader, now_ms, true)) {
//     std::string message = raster.Encode(since);   // what changed after version `since`
//     since = raster.version();
//   }
//
// A cell's byte is its level in units, divided by scale() and multiplied by 254, rounded, but at
// least 1 where there is something; 255 where there is nothing and an obstacle. A cell of several
// nodes shows the highest of them. The scale is 1, 2 or 5 times a power of ten: the least that is
// not below the peak; it falls only when the peak is well below the lower one.
//
// The message of tiles is pheromone.Tiles of protobuf, since viewers take every other encoding for
// a fault: the key 0x0A, the length as a varint, and then, little-endian:
//   u8 version = 1, u8 pheromone type, u8 side of a tile = 32, u8 flags: bit 0: tiles that are not
//   listed are 0; u16 columns, u16 rows, i64 x, i64 y in micrometres: the centre of cell (0, 0),
//   the lower left one; u32 side of a cell in micrometres; f32 scale; u64 field time in ms; u16
//   number of tiles; for each: u16 column, u16 row of the tile, then its bytes, row by row from the
//   bottom, as far as they are in the raster.
//
// One thread at a time. It takes no lock.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "server/core/field/field.h"

namespace pheromone::web {

class PheromoneRaster {
 public:
  static constexpr int32_t kMaxSide = 512;
  static constexpr int32_t kTileSide = 32;
  static constexpr int32_t kPieceNodes = 16384;  // a row of a tile's cells may have more
  static constexpr uint8_t kBlocked = 255;
  static constexpr uint8_t kFullScale = 254;

  /// `type` is one of the configuration's, and not a blend. Versions begin after `version`.
  PheromoneRaster(const field::FieldConfig& config, uint8_t type, uint64_t version = 0);

  /// Reads what changed since the last call, and with `evaporates` also what only evaporates. True
  /// if a byte changed. `reader` is of the field that has this configuration. `between_pieces`
  /// is called about as often as kPieceNodes have been read.
  bool Update(
      const field::FieldReader& reader, uint64_t now_ms, bool evaporates,
      const std::function<void()>& between_pieces = [] {});

  /// Increases when a byte changes, and with the first Update.
  uint64_t version() const { return version_; }
  /// Tiles that changed after a version; all that are not 0, if that is 0 or the scale changed.
  std::string Encode(uint64_t since) const;
  /// All of it, as foxglove.Grid, which tells the scale as the second name of its values.
  std::string EncodeGrid(uint64_t unix_ns) const;

  int32_t columns() const { return columns_; }
  int32_t rows() const { return rows_; }
  int64_t cell_um() const { return cell_um_; }
  /// The lower left corner, in half micrometres.
  field::PointUm twice_corner_um() const {
    return {2 * centre_.x - cell_um_, 2 * centre_.y - cell_um_};
  }
  double scale() const { return scale_; }
  uint64_t field_time_ms() const { return now_ms_; }
  /// columns * rows, the bottom row first.
  std::string_view bytes() const {
    return {reinterpret_cast<const char*>(bytes_.data()), bytes_.size()};
  }

 private:
  struct Tile {
    bool is_dirty = true;
    uint32_t peak = 0;  // level
    uint64_t version = 0;
    bool is_empty = true;  // all bytes are 0
  };
  struct Span {
    int32_t first = 0;
    int32_t end = 0;
  };

  Tile& At(int32_t column, int32_t row) {
    return tiles_[static_cast<size_t>(row) * static_cast<size_t>(tile_columns_) +
                  static_cast<size_t>(column)];
  }
  const Tile& At(int32_t column, int32_t row) const {
    return tiles_[static_cast<size_t>(row) * static_cast<size_t>(tile_columns_) +
                  static_cast<size_t>(column)];
  }
  Span ColumnsOf(int32_t tile) const;
  Span RowsOf(int32_t tile) const;
  size_t IndexOf(int32_t column, int32_t row) const {
    return static_cast<size_t>(row) * static_cast<size_t>(columns_) + static_cast<size_t>(column);
  }
  void MarkDirty(const field::NodeArea& area);
  void ReadLevels(const field::FieldReader& reader, int32_t tile_column, int32_t tile_row,
                  const std::function<void()>& between_pieces);
  bool ChooseScale();
  bool WriteBytes(int32_t tile_column, int32_t tile_row, Tile* tile);
  uint8_t ByteOf(size_t cell) const;

  const field::MapGeometry map_;
  const field::Shared<field::ObstacleMask> obstacles_;
  const uint8_t type_;
  const bool evaporates_;
  const double unit_;  // of a level
  const int32_t nodes_per_cell_;
  const int32_t columns_;
  const int32_t rows_;
  const int32_t tile_columns_;
  const int32_t tile_rows_;
  const int64_t cell_um_;
  const field::PointUm centre_;  // of cell (0, 0)
  std::vector<uint32_t> levels_;
  std::vector<uint8_t> bytes_;
  std::vector<uint8_t> blocked_;  // empty: no cell is
  std::vector<Tile> tiles_;
  double scale_ = 0;
  uint64_t seen_ = 0;  // change number of the field
  bool is_new_ = true;
  uint64_t version_;
  uint64_t full_version_ = 0;  // when all bytes were written anew
  uint64_t now_ms_ = 0;
};

/// The least of 1, 2 and 5 times a power of ten that is at least `peak` > 0.
double RoundScale(double peak);

}  // namespace pheromone::web
