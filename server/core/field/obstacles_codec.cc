// Encoding and decoding of obstacles.

#include <algorithm>
#include <bit>
#include <string>
#include <utility>
#include <vector>

#include "server/core/field/config.h"

namespace pheromone {
namespace {

using field::NodeIndex;
using field::ObstacleMask;

constexpr int32_t kMaxNodes = int32_t{field::MapGeometry::kMaxCells} + 1;

int32_t BlocksAlong(int32_t nodes) {
  return (nodes - 1) / ObstacleMask::kBlockSide + 1;
}

std::vector<NodeIndex> UsedBlocks(const ObstacleMask& mask) {
  std::vector<NodeIndex> used;
  for (int32_t row = 0; row < BlocksAlong(mask.rows()); ++row) {
    for (int32_t column = 0; column < BlocksAlong(mask.columns()); ++column) {
      if (mask.BlockAt(column, row) != ObstacleMask::Block{}) {
        used.push_back({column, row});
      }
    }
  }
  return used;
}

// Blocks the nodes of a word. Returns whether all of them are on the map.
bool BlockWord(uint64_t word, int32_t column, int32_t row, ObstacleMask* mask) {
  while (word != 0) {
    const int first = std::countr_zero(word);
    const int count = std::countr_one(word >> first);
    mask->BlockRow(row, column + first, column + first + count - 1);
    if (row >= mask->rows() || column + first + count > mask->columns()) {
      return false;
    }
    word &= count == 64 ? 0 : ~(((uint64_t{1} << count) - 1) << first);
  }
  return true;
}

void DecodeBlock(NodeIndex block, ByteReader* reader, ObstacleMask* mask) {
  uint64_t any = 0;
  for (int32_t i = 0; i < ObstacleMask::kBlockSide; ++i) {
    const uint64_t word = reader->U64();
    any |= word;
    if (!BlockWord(word, block.column * ObstacleMask::kBlockSide,
                   block.row * ObstacleMask::kBlockSide + i, mask)) {
      reader->Fail("an obstacle outside the map");
    }
  }
  if (any == 0) {
    reader->Fail("an empty block of obstacles");
  }
}

}  // namespace

using MaskCodec = FieldCodec<field::Shared<ObstacleMask>>;

void MaskCodec::Encode(const Mask& mask, ByteWriter* writer) {
  writer->Flag(static_cast<bool>(mask));
  if (!mask) {
    return;
  }
  writer->I32(mask->columns());
  writer->I32(mask->rows());
  const std::vector<NodeIndex> used = UsedBlocks(*mask);
  writer->Count(used.size());
  for (const NodeIndex block : used) {
    EncodeFields(block, writer);
    for (const uint64_t word : mask->BlockAt(block.column, block.row)) {
      writer->U64(word);
    }
  }
}

void MaskCodec::Decode(ByteReader* reader, Mask* to) {
  *to = {};
  if (!reader->Flag()) {
    return;
  }
  const int32_t columns = reader->I32();
  const int32_t rows = reader->I32();
  if (std::min(columns, rows) < 1 || std::max(columns, rows) > kMaxNodes) {
    reader->Fail("obstacles on " + std::to_string(columns) + " x " + std::to_string(rows) +
                 " nodes, expected 1 to " + std::to_string(kMaxNodes) + " each way");
  }
  if (!reader->ok()) {
    return;
  }
  ObstacleMask mask(columns, rows);
  int64_t next = 0;  // in order, so that each mask has exactly one encoding
  for (uint32_t left = reader->Count(); left > 0 && reader->ok(); --left) {
    NodeIndex block;
    DecodeFields(reader, &block);
    const bool on_map = block.column >= 0 && block.column < BlocksAlong(columns) &&
                        block.row >= 0 && block.row < BlocksAlong(rows);
    const int64_t key = int64_t{block.row} * BlocksAlong(columns) + block.column;
    if (!on_map || key < next) {
      reader->Fail("blocks of obstacles out of order, or outside the map");
      return;
    }
    next = key + 1;
    DecodeBlock(block, reader, &mask);
  }
  *to = Mask(std::move(mask));
}

uint64_t MaskCodec::Hash(const Mask& mask) {
  return mask ? Hash64({1, static_cast<uint64_t>(mask->columns()),
                        static_cast<uint64_t>(mask->rows()), mask->Hash()})
              : 0;
}

Status MaskCodec::Check(const Mask& /*mask*/, const std::string& /*name*/) {
  return Ok();  // server/core/engine/config_check.h checks whether it fits the map
}

size_t MaskCodec::BytesAtMost(const Mask& mask) {
  constexpr size_t kHeadBytes = 1 + 3 * sizeof(uint32_t);
  constexpr size_t kBlockBytes = sizeof(NodeIndex) + sizeof(ObstacleMask::Block);
  if (!mask) {
    return 1;
  }
  const size_t blocks = static_cast<size_t>(BlocksAlong(mask->columns())) *
                        static_cast<size_t>(BlocksAlong(mask->rows()));
  return kHeadBytes + kBlockBytes * std::min(blocks, mask->count());
}

std::string MaskCodec::Describe(std::string_view name, const std::string& indent) {
  const std::string nodes = ": 1 to " + std::to_string(kMaxNodes) + "\n";
  return indent + "flag " + std::string(name) + "; if it is 1:\n" +    //
         indent + "  i32 " + std::string(name) + ".columns" + nodes +  //
         indent + "  i32 " + std::string(name) + ".rows" + nodes +     //
         indent +
         "  list of blocks of 64 x 64 nodes in which something is blocked, by row and column, "
         "each\n" +
         indent + "    i32 column\n" + indent + "    i32 row\n" + indent +
         "    64 u64: a row of nodes each, the lowest bit at the left\n";
}

}  // namespace pheromone
