// A viewer's picture, from messages pheromone.Tiles, as pheromone_raster.h describes them.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <string_view>
#include <vector>

#include "server/base/bytes.h"

namespace pheromone::web::testing {

struct TilesViewer {
  uint8_t type = 0;
  bool full = false;  // of the last message
  uint16_t columns = 0;
  uint16_t rows = 0;
  int64_t x_um = 0;
  int64_t y_um = 0;
  uint32_t cell_um = 0;
  float scale = 0;
  uint64_t field_time_ms = 0;
  uint16_t tiles = 0;  // in the last message
  std::vector<uint8_t> bytes;

  /// False if the message is not well-formed.
  bool Take(std::string_view message) {
    ByteReader reader(Data(message));
    const bool is_known = reader.U8() == 1;
    type = reader.U8();
    const int side = reader.U8();
    full = (reader.U8() & 1) != 0;
    columns = reader.U16();
    rows = reader.U16();
    x_um = reader.I64();
    y_um = reader.I64();
    cell_um = reader.U32();
    scale = std::bit_cast<float>(reader.U32());
    field_time_ms = reader.U64();
    tiles = reader.U16();
    bytes.resize(size_t{columns} * rows);
    if (full) {
      std::fill(bytes.begin(), bytes.end(), uint8_t{0});
    }
    for (int i = 0; i < tiles && reader.ok(); ++i) {
      const int first_column = reader.U16() * side;
      const int first_row = reader.U16() * side;
      for (int row = first_row; row < std::min(first_row + side, int{rows}); ++row) {
        for (int column = first_column; column < std::min(first_column + side, int{columns});
             ++column) {
          bytes[static_cast<size_t>(row) * columns + static_cast<size_t>(column)] = reader.U8();
        }
      }
    }
    return is_known && side == 32 && reader.ok() && reader.AtEnd();
  }

 private:
  // Field 1 of the protobuf message, if that is all of it.
  static std::string_view Data(std::string_view message) {
    size_t at = 1;
    size_t length = 0;
    for (bool more = message.starts_with('\x0A'); more && at < message.size() && at < 6; ++at) {
      length |= size_t{static_cast<uint8_t>(message[at]) & 0x7Fu} << (7 * (at - 1));
      more = (static_cast<uint8_t>(message[at]) & 0x80u) != 0;
    }
    return message.size() == at + length ? message.substr(at) : std::string_view();
  }
};

}  // namespace pheromone::web::testing
