#include "server/store/journal/event_reader.h"

#include <gtest/gtest.h>

#include <vector>

#include "server/store/journal/event_text.h"
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
