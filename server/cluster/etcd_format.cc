#include "server/cluster/etcd_format.h"

#include <charconv>
#include <cstdio>
#include <utility>

#include "server/base/bytes.h"
#include "server/base/escape.h"
#include "server/store/journal/crc32c.h"

namespace pheromone::cluster {
namespace {

constexpr uint8_t kGroupVersion = 1;
constexpr std::string_view kLogFolder = "log/";

// What is before the checksum.
std::string EncodeHead(const Group& group, uint32_t pieces) {
  ByteWriter writer;
  writer.U8(kGroupVersion);
  writer.U32(group.count);
  writer.U64(group.term);
  writer.U32(pieces);
  return writer.Take();
}

uint32_t ChecksumOf(const Group& group, std::string_view head) {
  ByteWriter first;
  first.U64(group.first);
  return journal::Crc32c(group.records, journal::Crc32c(head, journal::Crc32c(first.bytes())));
}

}  // namespace

Result<Sequence> FromHex(std::string_view digits) {
  Sequence number = 0;
  std::from_chars(digits.data(), digits.data() + digits.size(), number, 16);
  if (HexText(number) != digits) {
    return Error{"expected a number of 16 hexadecimal digits"};
  }
  return number;
}

std::string EtcdKeys::Piece(const Group& group, uint32_t index) const {
  char text[16];
  std::snprintf(text, sizeof text, "%04x", index);
  return PiecesOf(group.first) + "/" + HexText(group.term) + "/" + text;
}

std::optional<Result<Sequence>> EtcdKeys::FirstOf(std::string_view key) const {
  if (!key.starts_with(prefix_) || !key.substr(prefix_.size()).starts_with(kLogFolder)) {
    return std::nullopt;
  }
  return FromHex(key.substr(prefix_.size() + kLogFolder.size()));
}

Status KeepId(const EtcdKeys& keys, const std::string& id, std::string* known) {
  if (known->empty()) {
    *known = id;
  }
  if (id == *known) {
    return Ok();
  }
  return Error{"key " + EscapeControls(keys.id(), "") + ": found \"" + EscapeControls(id, "") +
               "\", expected \"" + EscapeControls(*known, "") +
               "\": this is another log; check addresses and data of etcd"};
}

std::vector<KeyAndValue> EncodeGroup(const EtcdKeys& keys, const Group& group) {
  std::vector<KeyAndValue> entries;
  uint32_t pieces = 0;
  if (group.records.size() > kMaxInlineBytes) {
    for (size_t at = 0; at < group.records.size(); at += kPieceBytes) {
      entries.push_back({keys.Piece(group, pieces++), group.records.substr(at, kPieceBytes)});
    }
  }
  std::string value = EncodeHead(group, pieces);
  ByteWriter checksum;
  checksum.U32(ChecksumOf(group, value));
  value += checksum.bytes();
  if (pieces == 0) {
    value += group.records;
  }
  entries.push_back({keys.Log(group.first), std::move(value)});
  return entries;
}

Result<StoredGroup> DecodeGroup(Sequence first, std::string_view value) {
  constexpr size_t kHeaderBytes = 1 + 4 + 8 + 4 + 4;
  ByteReader reader(value);
  const uint8_t version = reader.U8();
  StoredGroup stored;
  stored.group.first = first;
  stored.group.count = reader.U32();
  stored.group.term = reader.U64();
  stored.pieces = reader.U32();
  stored.checksum = reader.U32();
  if (!reader.ok()) {
    return Error{"a group of " + std::to_string(value.size()) + " bytes, expected at least " +
                 std::to_string(kHeaderBytes)};
  }
  if (version != kGroupVersion) {
    return Error{"a group of version " + std::to_string(version) + ", expected " +
                 std::to_string(kGroupVersion)};
  }
  if (stored.group.count == 0) {
    return Error{"a group of 0 events, expected at least 1"};
  }
  if (first == 0 || stored.end() < first) {
    return Error{"a group of " + std::to_string(stored.group.count) + " events from " +
                 std::to_string(first) + ", expected sequences from 1 to 2^64 - 2"};
  }
  stored.group.records = value.substr(kHeaderBytes);
  if (stored.pieces == 0) {
    PHEROMONE_TRY_STATUS(CheckGroup(stored));
  } else if (!stored.group.records.empty()) {
    return Error{"a group in " + std::to_string(stored.pieces) + " pieces with " +
                 std::to_string(stored.group.records.size()) + " bytes of records, expected none"};
  }
  return stored;
}

Status CheckGroup(const StoredGroup& stored) {
  const uint32_t expected = ChecksumOf(stored.group, EncodeHead(stored.group, stored.pieces));
  if (stored.checksum != expected) {
    char text[80];
    std::snprintf(text, sizeof text, "the checksum is %08x, expected %08x, that of the group",
                  stored.checksum, expected);
    return Error{text};
  }
  return Ok();
}

}  // namespace pheromone::cluster
