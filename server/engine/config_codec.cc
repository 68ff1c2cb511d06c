#include "server/engine/config_codec.h"

#include <algorithm>
#include <bit>
#include <utility>
#include <vector>

#include "server/engine/config_check.h"

namespace pheromone::engine {
namespace {

using field::ObstacleMask;

// Lists: the number of items, then each.
template <typename T, typename Encode>
void EncodeList(const std::vector<T>& list, ByteWriter* writer, Encode&& encode) {
  writer->Count(list.size());
  for (const T& item : list) {
    encode(item);
  }
}

template <typename T, typename Decode>
std::vector<T> DecodeList(ByteReader* reader, Decode&& decode) {
  std::vector<T> list;
  for (uint32_t left = reader->Count(); left > 0 && reader->ok(); --left) {
    list.push_back(decode());
  }
  return list;
}

void EncodePoint(field::PointUm point, ByteWriter* writer) {
  writer->I64(point.x);
  writer->I64(point.y);
}

field::PointUm DecodePoint(ByteReader* reader) {
  const int64_t x = reader->I64();
  return {x, reader->I64()};
}

void EncodeLaw(const field::PheromoneLaw& law, ByteWriter* writer) {
  writer->U8(law.type);
  writer->Text(law.name);
  writer->U8(static_cast<uint8_t>(law.profile));
  writer->I64(law.core_um);
  writer->I64(law.sigma_um);
  writer->I64(law.cutoff_um);
  writer->U8(static_cast<uint8_t>(law.evaporation));
  writer->I64(law.tau_ms);
  writer->I64(law.quantum_micro);
  writer->U16(law.max_count);
  writer->Flag(law.directional);
  writer->I32(law.weight_milli);
  writer->U32(law.diffusion.exchange_q16);
  writer->U32(law.diffusion.step_ms);
  writer->U32(law.diffusion.keep_q32);
  writer->U32(law.diffusion.cutoff_q16);
  EncodeList(law.blend, writer, [&](const field::BlendPart& part) {
    writer->U8(part.type);
    writer->I32(part.weight_milli);
  });
}

field::PheromoneLaw DecodeLaw(ByteReader* reader) {
  field::PheromoneLaw law;
  law.type = reader->U8();
  law.name = reader->Text();
  law.profile = static_cast<field::Profile>(
      reader->U8UpTo(static_cast<uint8_t>(field::Profile::kGaussian), "a profile"));
  law.core_um = reader->I64();
  law.sigma_um = reader->I64();
  law.cutoff_um = reader->I64();
  law.evaporation = static_cast<field::Evaporation>(
      reader->U8UpTo(static_cast<uint8_t>(field::Evaporation::kExponential), "an evaporation"));
  law.tau_ms = reader->I64();
  law.quantum_micro = reader->I64();
  law.max_count = reader->U16();
  law.directional = reader->Flag();
  law.weight_milli = reader->I32();
  law.diffusion.exchange_q16 = reader->U32();
  law.diffusion.step_ms = reader->U32();
  law.diffusion.keep_q32 = reader->U32();
  law.diffusion.cutoff_q16 = reader->U32();
  law.blend = DecodeList<field::BlendPart>(reader, [&] {
    const uint8_t type = reader->U8();
    return field::BlendPart{type, reader->I32()};
  });
  return law;
}

void EncodePath(const field::Path& path, ByteWriter* writer) {
  writer->U8(path.type);
  writer->U16(path.count);
  writer->Flag(path.closed);
  EncodeList(path.points, writer, [&](field::PointUm point) { EncodePoint(point, writer); });
}

field::Path DecodePath(ByteReader* reader) {
  field::Path path;
  path.type = reader->U8();
  path.count = reader->U16();
  path.closed = reader->Flag();
  path.points = DecodeList<field::PointUm>(reader, [&] { return DecodePoint(reader); });
  return path;
}

void EncodePrint(const field::Print& print, ByteWriter* writer) {
  writer->U8(print.type);
  writer->Flag(static_cast<bool>(print.nodes));
  if (print.nodes) {
    EncodeList(*print.nodes, writer, [&](const field::PrintNode& it) {
      writer->I32(it.node.column);
      writer->I32(it.node.row);
      writer->U32(it.level);
    });
  }
}

field::Print DecodePrint(ByteReader* reader) {
  field::Print print;
  print.type = reader->U8();
  if (reader->Flag()) {
    print.nodes = field::Shared(DecodeList<field::PrintNode>(reader, [&] {
      const int32_t column = reader->I32();
      const int32_t row = reader->I32();
      return field::PrintNode{{column, row}, reader->U32()};
    }));
  }
  return print;
}

int32_t BlocksAlong(int32_t nodes) {
  return (nodes - 1) / ObstacleMask::kBlockSide + 1;
}

// The blocks in which something is blocked, by row and column, each as its 64 words.
void EncodeObstacles(const ObstacleMask& mask, ByteWriter* writer) {
  std::vector<field::NodeIndex> used;
  for (int32_t row = 0; row < BlocksAlong(mask.rows()); ++row) {
    for (int32_t column = 0; column < BlocksAlong(mask.columns()); ++column) {
      if (mask.BlockAt(column, row) != ObstacleMask::Block{}) {
        used.push_back({column, row});
      }
    }
  }
  writer->I32(mask.columns());
  writer->I32(mask.rows());
  EncodeList(used, writer, [&](field::NodeIndex block) {
    writer->I32(block.column);
    writer->I32(block.row);
    for (const uint64_t word : mask.BlockAt(block.column, block.row)) {
      writer->U64(word);
    }
  });
}

// Blocks the nodes of a word, and says whether all of them are on the map.
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

field::Shared<ObstacleMask> DecodeObstacles(ByteReader* reader, const field::MapGeometry& map) {
  const int32_t columns = reader->I32();
  const int32_t rows = reader->I32();
  if (!reader->ok() || columns != map.columns() || rows != map.rows()) {
    reader->Fail("obstacles for a map of another size");
    return {};
  }
  ObstacleMask mask(columns, rows);
  int64_t next = 0;  // in order, so that there is one way to write a mask
  for (uint32_t left = reader->Count(); left > 0 && reader->ok(); --left) {
    const int32_t column = reader->I32();
    const int32_t row = reader->I32();
    const bool on_map =
        column >= 0 && column < BlocksAlong(columns) && row >= 0 && row < BlocksAlong(rows);
    const int64_t key = int64_t{row} * BlocksAlong(columns) + column;
    if (!on_map || key < next) {
      reader->Fail("obstacles out of order or not on the map");
      return {};
    }
    next = key + 1;
    uint64_t any = 0;
    for (int32_t i = 0; i < ObstacleMask::kBlockSide; ++i) {
      const uint64_t word = reader->U64();
      any |= word;
      if (!BlockWord(word, column * ObstacleMask::kBlockSide, row * ObstacleMask::kBlockSide + i,
                     &mask)) {
        reader->Fail("an obstacle is not on the map");
      }
    }
    if (any == 0) {
      reader->Fail("an empty block of obstacles");
    }
  }
  return field::Shared(std::move(mask));
}

void EncodeField(const field::FieldConfig& config, ByteWriter* writer) {
  EncodePoint(config.map.origin, writer);
  writer->I64(config.map.width_um);
  writer->I64(config.map.height_um);
  writer->I64(config.map.cell_um);
  writer->I64(config.antennas.distance_um);
  writer->I64(config.antennas.forward_um);
  writer->U16(config.antennas.angle);
  EncodeList(config.pheromones, writer, [&](const auto& law) { EncodeLaw(law, writer); });
  EncodeList(config.paths, writer, [&](const auto& path) { EncodePath(path, writer); });
  EncodeList(config.prints, writer, [&](const auto& print) { EncodePrint(print, writer); });
  writer->Flag(static_cast<bool>(config.obstacles));
  if (config.obstacles) {
    EncodeObstacles(*config.obstacles, writer);
  }
  writer->U64(config.memory_bytes);
}

field::FieldConfig DecodeField(ByteReader* reader) {
  field::FieldConfig config;
  config.map.origin = DecodePoint(reader);
  config.map.width_um = reader->I64();
  config.map.height_um = reader->I64();
  config.map.cell_um = reader->I64();
  config.antennas.distance_um = reader->I64();
  config.antennas.forward_um = reader->I64();
  config.antennas.angle = reader->U16();
  if (reader->ok()) {
    reader->Check(CheckGeometry(config));  // what follows is looked at on this map
  }
  config.pheromones = DecodeList<field::PheromoneLaw>(reader, [&] { return DecodeLaw(reader); });
  config.paths = DecodeList<field::Path>(reader, [&] { return DecodePath(reader); });
  config.prints = DecodeList<field::Print>(reader, [&] { return DecodePrint(reader); });
  if (reader->Flag()) {
    config.obstacles = DecodeObstacles(reader, config.map);
  }
  config.memory_bytes = reader->U64();
  return config;
}

}  // namespace

void EncodeConfig(const EngineConfig& config, ByteWriter* writer) {
  EncodeField(config.field, writer);
  writer->U16(config.pose_unit_10um);
  writer->U16(config.robots_per_link);
  EncodeList(config.links, writer, [&](const LinkSettings& link) {
    writer->Text(link.name);
    writer->U8(link.slot_ms);
    writer->U8(link.response_window_ms);
  });
  EncodeList(config.frames, writer, [&](const RobotFrame& frame) {
    writer->Text(frame.link);
    writer->U8(frame.id);
    writer->I64(frame.x_um);
    writer->I64(frame.y_um);
    writer->U16(frame.heading);
    writer->I32(frame.cos_q30);
    writer->I32(frame.sin_q30);
  });
}

uint64_t EncodedBytes(const EngineConfig& config) {
  uint64_t bytes = 0;
  ByteWriter writer([&bytes](std::string_view portion) { bytes += portion.size(); });
  EncodeConfig(config, &writer);
  writer.Flush();
  return bytes;
}

size_t EncodedBytesAtMost(const EngineConfig& config) {
  constexpr size_t kFixedBytes = 112;  // the map, the antennas, the lengths of the lists
  constexpr size_t kLawBytes = 80;     // without what is of any length, as all of these
  constexpr size_t kPathBytes = 8;
  constexpr size_t kPrintBytes = 8;
  constexpr size_t kObstacleBytes = 12;
  constexpr size_t kLinkBytes = 6;
  constexpr size_t kFrameBytes = 40;
  constexpr size_t kPointBytes = 16;
  constexpr size_t kPrintNodeBytes = 12;
  constexpr size_t kBlendPartBytes = 5;
  constexpr size_t kBlockBytes = 8 + sizeof(ObstacleMask::Block);
  size_t bytes = kFixedBytes;
  for (const field::PheromoneLaw& law : config.field.pheromones) {
    bytes += kLawBytes + law.name.size() + kBlendPartBytes * law.blend.size();
  }
  for (const field::Path& path : config.field.paths) {
    bytes += kPathBytes + kPointBytes * path.points.size();
  }
  for (const field::Print& print : config.field.prints) {
    bytes += kPrintBytes + (print.nodes ? kPrintNodeBytes * print.nodes->size() : 0);
  }
  if (const auto& mask = config.field.obstacles) {
    const size_t blocks = static_cast<size_t>(BlocksAlong(mask->columns())) *
                          static_cast<size_t>(BlocksAlong(mask->rows()));
    bytes += kObstacleBytes + kBlockBytes * std::min(blocks, mask->count());
  }
  for (const LinkSettings& link : config.links) {
    bytes += kLinkBytes + link.name.size();
  }
  for (const RobotFrame& frame : config.frames) {
    bytes += kFrameBytes + frame.link.size();
  }
  return bytes;
}

// All versions so far have written the same.
EngineConfig DecodeConfig(ByteReader* reader, uint8_t /*version*/) {
  EngineConfig config;
  config.field = DecodeField(reader);
  config.pose_unit_10um = reader->U16();
  config.robots_per_link = reader->U16();
  config.links = DecodeList<LinkSettings>(reader, [&] {
    LinkSettings link;
    link.name = reader->Text();
    link.slot_ms = reader->U8();
    link.response_window_ms = reader->U8();
    return link;
  });
  config.frames = DecodeList<RobotFrame>(reader, [&] {
    RobotFrame frame;
    frame.link = reader->Text();
    frame.id = reader->U8();
    frame.x_um = reader->I64();
    frame.y_um = reader->I64();
    frame.heading = reader->U16();
    frame.cos_q30 = reader->I32();
    frame.sin_q30 = reader->I32();
    return frame;
  });
  if (reader->ok()) {
    reader->Check(CheckValues(config));
  }
  return config;
}

}  // namespace pheromone::engine
