#include "server/store/journal/format.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "server/base/hex.h"
#include "server/store/journal/crc32c.h"

namespace pheromone::journal {
namespace {

std::string LittleEndian(uint32_t value) {
  ByteWriter writer;
  writer.U32(value);
  return writer.Take();
}

std::string SmallSegment() {
  std::string file = EncodeHeader(SegmentHeader{3, 41, false});
  ByteWriter scratch;
  AppendGroup(40, &file);
  AppendEvent(41, {1'000, -5}, engine::Advance{}, &scratch, &file);
  AppendHash(41, 0xABCD, &file);
  AppendEnd(41, &file);
  return file;
}

TEST(Format, NamesSayWhatTheFilesAre) {
  EXPECT_EQ(SegmentName(42), "00000042.segment");
  EXPECT_EQ(SegmentName(123'456'789), "123456789.segment");
  EXPECT_EQ(SnapshotName(4'711), "00000000000000004711.snapshot");
  EXPECT_EQ(OrdinalOf("00000042.segment"), 42u);
  EXPECT_EQ(SnapshotSequenceOf("00000000000000004711.snapshot"), 4'711u);
  for (const char* name : {"42.segment", "00000042.segment.damaged", "0000004x.segment", ".segment",
                           "lock", "+0000042.segment", "00000042.snapshot"}) {
    EXPECT_FALSE(OrdinalOf(name)) << name;
  }
  EXPECT_FALSE(SnapshotSequenceOf("00000000000000004711.snapshot.new"));
}

// From README.md, by hand; the checksums are computed over the bytes that it names.
TEST(Format, TheBytesAreThoseOfTheDescription) {
  const std::string file = SmallSegment();
  const std::string head = file.substr(0, 32);
  EXPECT_EQ(HexText(head), HexText("PHEROLOG") +
                               "02000000"
                               "00000000"
                               "0300000000000000"
                               "2900000000000000");
  EXPECT_EQ(file.substr(32, 4), LittleEndian(Crc32c(head)));
  const std::string length = file.substr(36, 4);
  const std::string group = file.substr(44, 9);
  EXPECT_EQ(HexText(length), "09000000");
  EXPECT_EQ(HexText(group),
            "02"
            "2800000000000000");
  EXPECT_EQ(file.substr(40, 4), LittleEndian(Crc32c(length + group)));
  const std::string event = file.substr(61, 27);
  EXPECT_EQ(HexText(file.substr(53, 4)), "1b000000");
  EXPECT_EQ(HexText(event),
            "01"
            "2900000000000000"
            "e803000000000000"
            "fbffffffffffffff"
            "0402");
  EXPECT_EQ(HexText(file.substr(96, 17)),
            "03"
            "2900000000000000"
            "cdab000000000000");
  EXPECT_EQ(HexText(file.substr(121, 9)),
            "04"
            "2900000000000000");
  EXPECT_EQ(file.size(), 130u);
}

TEST(Format, RecordsComeBack) {
  const std::string file = SmallSegment();
  const auto header = DecodeSegmentHeader(file);
  ASSERT_TRUE(header.ok());
  EXPECT_EQ(header.value(), (SegmentHeader{3, 41, false}));
  RecordReader reader(file);
  Record record;
  std::vector<RecordKind> kinds;
  while (reader.Next(&record) == RecordReader::Found::kRecord) {
    kinds.push_back(record.kind);
    if (record.kind == RecordKind::kEvent) {
      EXPECT_EQ(record.sequence, 41u);
      EXPECT_EQ(record.stamp.field_time_ms, 1'000u);
      EXPECT_EQ(record.stamp.utc_ms, -5);
      EXPECT_EQ(record.at, 53u);
    }
  }
  EXPECT_EQ(kinds, (std::vector{RecordKind::kGroup, RecordKind::kEvent, RecordKind::kHash,
                                RecordKind::kEnd}));
  EXPECT_EQ(reader.at(), file.size());
}

TEST(Format, EveryChangedByteAndEveryCutIsNoticedWhereItIs) {
  const std::string file = SmallSegment();
  const size_t begins[] = {36, 53, 88, 113, 130};
  for (size_t at = 36; at < file.size(); ++at) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string damaged = file;
      damaged[at] = static_cast<char>(damaged[at] ^ (1 << bit));
      RecordReader reader(damaged);
      Record record;
      RecordReader::Found found{};
      while ((found = reader.Next(&record)) == RecordReader::Found::kRecord) {
      }
      ASSERT_EQ(found, RecordReader::Found::kBad);
      ASSERT_EQ(reader.at(), *(std::upper_bound(begins, begins + 5, at) - 1)) << at;
    }
  }
  for (size_t at = 0; at < 36; ++at) {
    std::string damaged = file;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    EXPECT_FALSE(DecodeSegmentHeader(damaged).ok()) << at;
    EXPECT_FALSE(DecodeSegmentHeader(file.substr(0, at)).ok());
  }
  for (size_t length = 36; length < file.size(); ++length) {
    const std::string cut = file.substr(0, length);
    RecordReader reader(cut);
    Record record;
    RecordReader::Found found{};
    while ((found = reader.Next(&record)) == RecordReader::Found::kRecord) {
    }
    const bool at_a_border = std::find(begins, begins + 5, length) != begins + 5;
    ASSERT_EQ(found, at_a_border ? RecordReader::Found::kEnd : RecordReader::Found::kBad);
  }
}

TEST(Format, AnotherVersionIsNoDamage) {
  std::string file = SmallSegment();
  EXPECT_FALSE(IsOfAnotherVersion(file));
  file[8] = 3;
  EXPECT_FALSE(IsOfAnotherVersion(file));  // its checksum says that this is a damaged 2
  file.replace(32, 4, LittleEndian(Crc32c(file.substr(0, 32))));
  EXPECT_TRUE(IsOfAnotherVersion(file));
  EXPECT_EQ(DecodeSegmentHeader(file).error(),
            "has version 3, but this program reads version 2; use the program that wrote it, or "
            "another journal folder");
}

// From README.md, by hand.
TEST(Format, PiecesAreThoseOfTheDescription) {
  std::string file;
  AppendPiece(0x0102, "abc", &file);
  EXPECT_EQ(HexText(file.substr(0, 4)), "0c000000");
  EXPECT_EQ(HexText(file.substr(8)),
            "05"
            "0201000000000000" +
                HexText("abc"));
  file.clear();
  AppendEventInPieces(41, {1'000, -5}, {3, 0x010203, 0xAABBCCDD}, &file);
  EXPECT_EQ(HexText(file.substr(0, 4)), "25000000");
  EXPECT_EQ(HexText(file.substr(8)),
            "06"
            "2900000000000000"
            "e803000000000000"
            "fbffffffffffffff"
            "0302010000000000"
            "ddccbbaa");
}

TEST(Format, AMarkFurtherOnIsFoundBehindAnyDamage) {
  std::string file = SmallSegment();
  file[60] = static_cast<char>(file[60] ^ 1);
  EXPECT_EQ(DurableIn(file, 53), 41u);
  EXPECT_EQ(DurableIn(file.substr(0, 113), 53), 0u);  // without the end
  EXPECT_EQ(DurableIn(file, 36), 41u);
  EXPECT_EQ(DurableIn(std::string(500, '\x09'), 0), 0u);
}

}  // namespace
}  // namespace pheromone::journal
