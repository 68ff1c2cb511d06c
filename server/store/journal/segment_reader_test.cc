// Events in pieces, as a reader puts them together. What else it does is tried by recovery's tests.

#include "server/store/journal/segment_reader.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <string_view>

#include "server/core/engine/event_codec.h"
#include "server/core/engine/testing/random_traffic.h"
#include "server/store/journal/crc32c.h"
#include "server/store/journal/testing/crash_folder.h"

namespace pheromone::journal {
namespace {

using Found = RecordReader::Found;

constexpr engine::Stamp kStamp{1'000, -5};

engine::Event LargeEvent() {
  return engine::ConfigChanged{engine::testing::RichConfig(true), 3};
}

std::string BytesOf(const engine::Event& event) {
  ByteWriter writer;
  engine::EncodeEvent(event, &writer);
  return writer.Take();
}

std::string WholeRecord() {
  ByteWriter scratch;
  std::string record;
  AppendEvent(41, kStamp, LargeEvent(), &scratch, &record);
  return record;
}

engine::WrittenAhead AheadOf(std::string_view bytes) {
  return {3, bytes.size(), Crc32c(bytes)};
}

class SegmentReaderTest : public ::testing::Test {
 protected:
  void SetUp() override {
    file_ = folder_.Create(name_).value();
    Append(EncodeHeader(SegmentHeader{3, 41, false}));
  }

  void Append(const std::string& bytes) { ASSERT_TRUE(file_->Append(bytes).ok()); }
  void AppendOnePiece(uint64_t offset, std::string_view bytes) {
    std::string record;
    AppendPiece(offset, bytes, &record);
    Append(record);
  }
  // A group before each piece, and an event of a robot before the second.
  void AppendPieces(std::string_view bytes, size_t each) {
    for (size_t at = 0; at < bytes.size(); at += each) {
      std::string between;
      AppendGroup(40, &between);
      Append(between);
      AppendOnePiece(at, bytes.substr(at, each));
    }
  }
  void AppendLast(const engine::WrittenAhead& ahead) {
    std::string record;
    AppendEventInPieces(41, kStamp, ahead, &record);
    Append(record);
  }

  // The first record that is no group; kBad with why().
  Found NextEvent(SegmentReader* reader, Record* record) {
    Found found{};
    while ((found = reader->Next(record)) == Found::kRecord && record->kind == RecordKind::kGroup) {
    }
    return found;
  }

  const std::string name_ = SegmentName(3);
  testing::CrashFolder folder_{1};
  std::unique_ptr<AppendFile> file_;
};

TEST_F(SegmentReaderTest, AnEventInPiecesIsTheEventThatItIs) {
  const std::string bytes = BytesOf(LargeEvent());
  for (const size_t each : {size_t{1}, size_t{200}, bytes.size()}) {
    AppendPieces(bytes, each);
    AppendLast(AheadOf(bytes));
  }
  SegmentReader reader(folder_, name_);
  Record record;
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(NextEvent(&reader, &record), Found::kRecord) << reader.why();
    EXPECT_EQ(record.kind, RecordKind::kEvent);
    EXPECT_EQ(record.sequence, 41u);
    EXPECT_EQ(record.stamp.field_time_ms, 1'000u);
    EXPECT_EQ(record.stamp.utc_ms, -5);
    EXPECT_EQ(record.event, bytes);
    EXPECT_EQ(record.bytes, WholeRecord()) << "as if it had been written at once";
  }
  EXPECT_EQ(NextEvent(&reader, &record), Found::kEnd);
  EXPECT_EQ(reader.at(), reader.size());
}

TEST_F(SegmentReaderTest, PiecesAloneCountForNothingAndMayBeginAnew) {
  const std::string bytes = BytesOf(LargeEvent());
  AppendPieces(bytes, 300);
  AppendPieces(bytes.substr(0, 500), 100);
  AppendPieces(bytes, 200);
  AppendLast(AheadOf(bytes));
  AppendPieces(bytes.substr(0, 900), 300);
  SegmentReader reader(folder_, name_);
  Record record;
  ASSERT_EQ(NextEvent(&reader, &record), Found::kRecord) << reader.why();
  EXPECT_EQ(record.bytes, WholeRecord());
  EXPECT_EQ(NextEvent(&reader, &record), Found::kEnd) << reader.why();
}

TEST_F(SegmentReaderTest, APieceOutOfPlaceIsNamed) {
  const std::string bytes = BytesOf(LargeEvent());
  AppendOnePiece(0, bytes.substr(0, 100));
  const uint64_t at = folder_.Size(name_).value();
  AppendOnePiece(101, bytes.substr(101, 100));
  SegmentReader reader(folder_, name_);
  Record record;
  EXPECT_EQ(NextEvent(&reader, &record), Found::kBad);
  EXPECT_EQ(reader.why(), "fragment of an event out of order");
  EXPECT_EQ(reader.at(), at);
}

TEST_F(SegmentReaderTest, APieceWithoutItsBeginningIsNamed) {
  AppendOnePiece(100, "x");
  SegmentReader reader(folder_, name_);
  Record record;
  EXPECT_EQ(NextEvent(&reader, &record), Found::kBad);
  EXPECT_EQ(reader.why(), "fragment of an event out of order");
}

// Each alone: none, too few, others, and those that were an event's already.
class WrongPiecesTest : public SegmentReaderTest, public ::testing::WithParamInterface<int> {};

TEST_P(WrongPiecesTest, AreNamed) {
  const std::string bytes = BytesOf(LargeEvent());
  engine::WrittenAhead ahead = AheadOf(bytes);
  int good = 0;
  switch (GetParam()) {
    case 0:
      break;
    case 1:
      AppendPieces(bytes.substr(0, bytes.size() - 1), 100);
      break;
    case 2:
      AppendPieces(bytes, 100);
      ahead.checksum ^= 1;
      break;
    default:
      AppendPieces(bytes, 100);
      AppendLast(ahead);
      good = 1;
  }
  const uint64_t at = folder_.Size(name_).value();
  AppendLast(ahead);
  SegmentReader reader(folder_, name_);
  Record record;
  for (; good > 0; --good) {
    ASSERT_EQ(NextEvent(&reader, &record), Found::kRecord);
  }
  EXPECT_EQ(NextEvent(&reader, &record), Found::kBad);
  EXPECT_EQ(reader.why(), "fragments of an event do not match");
  EXPECT_EQ(reader.at(), at);
}

INSTANTIATE_TEST_SUITE_P(All, WrongPiecesTest, ::testing::Range(0, 4));

}  // namespace
}  // namespace pheromone::journal
