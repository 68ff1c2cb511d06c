#include "server/store/journal/event_reader.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "server/store/journal/durable_note.h"
#include "server/store/journal/event_text.h"
#include "server/store/journal/segment_reader.h"
#include "server/store/journal/testing/crash_folder.h"
#include "server/store/journal/testing/life.h"

namespace pheromone::journal {
namespace {

using testing::CrashFolder;
using testing::Lives;
using testing::SmallJournal;

std::vector<uint64_t> SequencesIn(const Folder& folder) {
  std::vector<uint64_t> sequences;
  const auto walked =
      WalkEvents(folder, [&](const Record& record) { sequences.push_back(record.sequence); });
  EXPECT_TRUE(walked.ok());
  EXPECT_FALSE(walked.value().is_damaged) << walked.value().cut_short;
  return sequences;
}

TEST(Walk, EachEventComesOnceAndInOrderThoughTailsWereWrittenAgain) {
  CrashFolder folder(1);
  Lives lives(&folder, SmallJournal(), 1);
  for (int life = 0; life < 5; ++life) {
    ASSERT_EQ(lives.Begin(), "");
    for (int i = 0; i < 30; ++i) {
      lives.Step();
    }
    folder.CutAt(1);
    while (!folder.is_off()) {
      lives.Step();
    }
    folder.PowerOn();
  }
  ASSERT_EQ(lives.Begin(), "");
  const std::vector<uint64_t> sequences = SequencesIn(folder);
  ASSERT_GT(sequences.size(), 20u);
  for (size_t i = 0; i < sequences.size(); ++i) {
    ASSERT_EQ(sequences[i], sequences[0] + i);
  }
  EXPECT_EQ(sequences.back(), lives.submitted());
}

TEST(Walk, DamageIsWhereItEnds) {
  CrashFolder folder(2);
  Lives lives(&folder, SmallJournal(), 2);
  ASSERT_EQ(lives.Begin(), "");
  for (int i = 0; i < 9; ++i) {
    lives.Submit();
  }
  lives.Write();
  std::string& bytes = folder.Contents(SegmentName(1));
  bytes.back() = static_cast<char>(bytes.back() ^ 1);
  const auto walked = WalkEvents(folder, [](const Record&) {});
  EXPECT_EQ(walked.value().events, 8u);
  EXPECT_NE(walked.value().cut_short.find("record checksum mismatch"), std::string::npos);
}

// Two segments, of the events 1 to 3 and 4 to 6; a mark is before each event.
class WalkTest : public ::testing::Test {
 protected:
  WalkTest() {
    Put(SegmentName(1), SegmentOf(1, 1, 3));
    Put(SegmentName(2), SegmentOf(2, 4, 6));
  }

  static std::string SegmentOf(uint64_t ordinal, uint64_t first, uint64_t last) {
    std::string bytes = EncodeHeader(SegmentHeader{ordinal, first, false});
    ByteWriter scratch;
    for (uint64_t sequence = first; sequence <= last; ++sequence) {
      AppendGroup(sequence - 1, &bytes);
      AppendEvent(sequence, {}, engine::PoseObserved{0, 2, {{-3, 4}, 5}, 1'000}, &scratch, &bytes);
    }
    return bytes;
  }
  void Put(const std::string& name, const std::string& bytes) {
    (void)folder_.Remove(name);
    ASSERT_TRUE(folder_.Create(name).value()->Append(bytes).ok());
  }
  // Of the event's record.
  size_t PlaceOf(uint64_t ordinal, uint64_t sequence) {
    SegmentReader reader(folder_, SegmentName(ordinal));
    Record record;
    while (reader.Next(&record) == RecordReader::Found::kRecord) {
      if (record.kind == RecordKind::kEvent && record.sequence == sequence) {
        return record.at;
      }
    }
    ADD_FAILURE() << sequence;
    return 0;
  }
  void Damage(uint64_t ordinal, size_t byte) {
    char& it = folder_.Contents(SegmentName(ordinal))[byte];
    it = static_cast<char>(it ^ 1);
  }

  void ExpectWalked(uint64_t first, uint64_t last, const std::string& cut_short, bool is_damaged) {
    std::vector<uint64_t> sequences;
    const auto walked =
        WalkEvents(folder_, [&](const Record& record) { sequences.push_back(record.sequence); });
    std::vector<uint64_t> expected;
    for (uint64_t sequence = first; sequence <= last; ++sequence) {
      expected.push_back(sequence);
    }
    ASSERT_TRUE(walked.ok()) << walked.error();
    EXPECT_EQ(sequences, expected);
    EXPECT_EQ(walked.value().cut_short, cut_short);
    EXPECT_EQ(walked.value().is_damaged, is_damaged);
  }

  CrashFolder folder_{1};
};

TEST_F(WalkTest, ADamagedHeaderIsDamage) {
  ExpectWalked(1, 6, "", false);
  Damage(1, 0);
  ExpectWalked(1, 0, "00000001.segment: byte 0: is not a segment", true);
  // Nor does a snapshot tell what happened.
  Put(SnapshotName(3), "");
  ExpectWalked(1, 0, "00000001.segment: byte 0: is not a segment", true);
  Damage(1, 0);
  Damage(2, 0);
  ExpectWalked(1, 3, "00000002.segment: byte 0: is not a segment", true);
}

TEST_F(WalkTest, ASegmentUnderAnotherNameIsDamage) {
  Put(SegmentName(2), SegmentOf(7, 4, 6));
  ExpectWalked(1, 3, "00000002.segment: byte 0: its header is that of segment 7", true);
}

TEST_F(WalkTest, AMissingSegmentIsDamageUnlessASnapshotHasIt) {
  const std::string ends = "00000001.segment: byte " +
                           std::to_string(folder_.Contents(SegmentName(1)).size()) +
                           ": it ends before the next segment begins";
  Put(SegmentName(3), SegmentOf(3, 7, 9));
  ASSERT_TRUE(folder_.Remove(SegmentName(2)).ok());
  ExpectWalked(1, 3, ends, true);
  Put(SnapshotName(5), "");
  ExpectWalked(1, 3, ends, true);
  Put(SnapshotName(8), "");
  EXPECT_EQ(SequencesIn(folder_), (std::vector<uint64_t>{1, 2, 3, 7, 8, 9}));
  ASSERT_TRUE(folder_.Remove(SegmentName(1)).ok());
  ExpectWalked(7, 9, "", false);
  ASSERT_TRUE(folder_.Remove(SnapshotName(8)).ok());
  ExpectWalked(1, 0, "00000003.segment: byte 0: the sequence jumps from 0 to 7", true);
}

TEST_F(WalkTest, AMissingEndIsDamageIfItWasDurable) {
  const DurableNote note{1, 6, 5};
  Put(std::string(kDurableName), std::string(NotePlace(note), '\0') + EncodeNote(note));
  ExpectWalked(1, 6, "", false);
  Put(SegmentName(2), SegmentOf(2, 4, 5));
  ExpectWalked(1, 5, "durable: the log ends at sequence 5, but 6 was durable", true);
}

TEST_F(WalkTest, ADamagedRecordIsDamageButNotAnUnfinishedOne) {
  const size_t fifth = PlaceOf(2, 5);
  const size_t sixth = PlaceOf(2, 6);
  const std::string whole = folder_.Contents(SegmentName(2));
  const std::string end = "00000002.segment: byte " + std::to_string(sixth);
  Damage(2, fifth + 20);
  ExpectWalked(
      1, 4, "00000002.segment: byte " + std::to_string(fifth) + ": record checksum mismatch", true);
  Put(SegmentName(2), whole);
  Damage(2, sixth + 20);
  ExpectWalked(1, 5, end + ": record checksum mismatch", false);
  Put(SegmentName(2), whole.substr(0, sixth + 20));
  ExpectWalked(1, 5, end + ": a record extends beyond the end of the file", false);
  // The server went on from there.
  Put(SegmentName(3), SegmentOf(3, 6, 7));
  ExpectWalked(1, 7, "", false);
}

TEST_F(WalkTest, ASegmentThatWasNotBegunIsNoDamage) {
  Put(SegmentName(3), "");
  ExpectWalked(1, 6, "00000003.segment: byte 0: header truncated after 0 bytes", false);
  Put(SegmentName(4), SegmentOf(4, 7, 8));
  ExpectWalked(1, 8, "", false);
  // All before it was removed since.
  Put(SnapshotName(8), "");
  ASSERT_TRUE(folder_.Remove(SegmentName(1)).ok());
  ASSERT_TRUE(folder_.Remove(SegmentName(2)).ok());
  ExpectWalked(7, 8, "", false);
}

TEST(Words, AnEventIsALineOfATableAndOfJson) {
  std::string file = EncodeHeader(SegmentHeader{});
  ByteWriter scratch;
  AppendEvent(7, {1'000, -5},
              engine::RequestReceived{1, engine::testing::Deposit(3, 9, -20, 30, 2, 4)}, &scratch,
              &file);
  AppendEvent(8, {1'001, 6}, engine::PoseObserved{0, 2, {{-3, 4}, 5}, 1'000}, &scratch, &file);
  RecordReader reader(file);
  Record record;
  ASSERT_EQ(reader.Next(&record), RecordReader::Found::kRecord);
  EXPECT_EQ(InCsv(record), "7,1000,-5,deposit,1,3,4,9,-20,30,,,,2,");
  EXPECT_EQ(InJson(record),
            R"({"sequence":7,"field_time_ms":1000,"utc_ms":-5,"event":"deposit","pheromone":4,)"
            R"("seq":9,"x":-20,"y":30,"value":2,"link":1,"robot":3})");
  ASSERT_EQ(reader.Next(&record), RecordReader::Found::kRecord);
  EXPECT_EQ(InCsv(record), "8,1001,6,observed,0,2,,,,,5,-3,4,1000,");
  EXPECT_EQ(InWords(record),
            "observed sequence=8 field_time_ms=1001 utc_ms=6 link=0 robot=2 heading=5 x_um=-3 "
            "y_um=4 value=1000");
  file = EncodeHeader(SegmentHeader{});
  AppendEvent(9, {1'002, 7}, engine::GoalSet{0, 2, {{{1, 2}, {-3, 4}}, 100'000}}, &scratch, &file);
  AppendEvent(10, {1'003, 8}, engine::GoalEnded{0, 2, true, {-2, 4}}, &scratch, &file);
  AppendEvent(11, {1'004, 9}, engine::GoalEnded{0, 2, false, {}}, &scratch, &file);
  RecordReader goals(file);
  ASSERT_EQ(goals.Next(&record), RecordReader::Found::kRecord);
  EXPECT_EQ(InCsv(record), "9,1002,7,goal,0,2,,,,,,-3,4,100000,");
  ASSERT_EQ(goals.Next(&record), RecordReader::Found::kRecord);
  EXPECT_EQ(InCsv(record), "10,1003,8,goal_reached,0,2,,,,,,-2,4,,");
  ASSERT_EQ(goals.Next(&record), RecordReader::Found::kRecord);
  EXPECT_EQ(InCsv(record), "11,1004,9,goal_cancelled,0,2,,,,,,,,,");
}

}  // namespace
}  // namespace pheromone::journal
