#include "server/store/journal/durable_note.h"

#include "server/base/bytes.h"
#include "server/store/journal/crc32c.h"

namespace pheromone::journal {
namespace {

constexpr std::string_view kMagic = "PHERODUR";
constexpr uint32_t kVersion = 1;
constexpr size_t kSealedBytes = 8 + 4 + 3 * 8;  // before the checksum

std::optional<DurableNote> Decode(std::string_view bytes) {
  if (bytes.size() < kSealedBytes + 4 || !bytes.starts_with(kMagic)) {
    return std::nullopt;
  }
  ByteReader reader(bytes.substr(kMagic.size()));
  const uint32_t version = reader.U32();
  DurableNote note;
  note.count = reader.U64();
  note.sequence = reader.U64();
  note.utc_ms = reader.I64();
  const bool is_whole = reader.U32() == Crc32c(bytes.substr(0, kSealedBytes));
  return is_whole && version == kVersion ? std::optional(note) : std::nullopt;
}

}  // namespace

std::string EncodeNote(const DurableNote& note) {
  ByteWriter writer;
  for (const char c : kMagic) {
    writer.U8(static_cast<uint8_t>(c));
  }
  writer.U32(kVersion);
  writer.U64(note.count);
  writer.U64(note.sequence);
  writer.I64(note.utc_ms);
  writer.U32(Crc32c(writer.bytes()));
  std::string bytes = writer.Take();
  bytes.resize(kNoteBytes);
  return bytes;
}

std::optional<DurableNote> ReadDurableNote(const Folder& folder) {
  const Result<std::string> file = folder.Read(std::string(kDurableName), 0, 2 * kNoteBytes);
  if (!file.ok()) {
    return std::nullopt;
  }
  const std::string_view bytes = file.value();
  const std::optional<DurableNote> first = Decode(bytes.substr(0, kNoteBytes));
  const std::optional<DurableNote> second =
      bytes.size() > kNoteBytes ? Decode(bytes.substr(kNoteBytes)) : std::nullopt;
  if (!first || !second) {
    return first ? first : second;
  }
  return first->count > second->count ? first : second;
}

}  // namespace pheromone::journal
