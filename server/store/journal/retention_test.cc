#include "server/store/journal/retention.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "server/store/journal/format.h"
#include "server/store/journal/recovery.h"
#include "server/store/journal/snapshot.h"
#include "server/store/journal/snapshot_writer.h"
#include "server/store/journal/testing/crash_folder.h"
#include "server/store/journal/testing/life.h"

namespace pheromone::journal {
namespace {

using testing::CrashFolder;
using testing::Lives;
using testing::SmallJournal;

class RetentionTest : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(lives_.Begin(), ""); }

  void RunUntilSnapshots(uint64_t count) {
    while (lives_.snapshots() < count) {
      lives_.Submit();
      lives_.Write();
      lives_.MakeDueSnapshot();
      lives_.PassTime(1'000);
      ASSERT_LT(lives_.submitted(), 20'000u);
    }
  }
  std::vector<std::string> Names(const std::string& ending) {
    std::vector<std::string> names = folder_.List().value();
    std::erase_if(names, [&](const std::string& name) { return !name.ends_with(ending); });
    return names;
  }

  CrashFolder folder_{9};
  Lives lives_{&folder_, SmallJournal(), 9};
};

TEST_F(RetentionTest, ASnapshotIsTheStateAtItsSequence) {
  RunUntilSnapshots(3);
  for (const std::string& name : Names(".snapshot")) {
    uint64_t byte = 0;
    const auto snapshot = ReadSnapshot(folder_, name, &byte);
    ASSERT_TRUE(snapshot.ok()) << snapshot.error();
    const uint64_t sequence = *SnapshotSequenceOf(name);
    EXPECT_EQ(snapshot.value().engine.sequence(), sequence);
    EXPECT_EQ(snapshot.value().engine.StateHash(), lives_.hashes()[sequence]);
  }
}

TEST_F(RetentionTest, TheNewestTwoSnapshotsAndTheirSegmentsStay) {
  RunUntilSnapshots(6);
  EXPECT_EQ(Names(".snapshot").size(), 2u);
  EXPECT_LT(Names(".segment").size(), 10u);
  EXPECT_FALSE(folder_.Has(SegmentName(1)));
  // The older of the two is enough.
  const std::string newest = Names(".snapshot").back();
  std::string& bytes = folder_.Contents(newest);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 4);
  const auto recovered = Recover(folder_);
  ASSERT_TRUE(recovered.ok()) << recovered.error();
  EXPECT_EQ(recovered.value().sequence, lives_.submitted());
  EXPECT_FALSE(recovered.value().lost);
  EXPECT_EQ(recovered.value().damaged_files, std::vector<std::string>{newest});
  EXPECT_EQ(lives_.Begin(), "");
  EXPECT_TRUE(folder_.Has(newest + ".damaged"));
}

TEST_F(RetentionTest, EveryDamagedByteOfASnapshotIsNoticed) {
  RunUntilSnapshots(1);
  const std::string name = Names(".snapshot")[0];
  std::string& bytes = folder_.Contents(name);
  const std::string whole = bytes;
  uint64_t byte = 0;
  for (size_t at = 0; at < whole.size(); at += 1 + whole.size() / 700) {
    bytes = whole;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x08);
    EXPECT_FALSE(ReadSnapshot(folder_, name, &byte).ok()) << at;
    bytes = whole.substr(0, at);
    EXPECT_FALSE(ReadSnapshot(folder_, name, &byte).ok()) << at;
  }
  bytes = whole + "x";
  EXPECT_EQ(ReadSnapshot(folder_, name, &byte).error(), "has extra bytes at the end");
}

// The log and the snapshot come about on different ways, and must lead to the same state.
TEST_F(RetentionTest, AFollowerOfTheLogComesToTheStateOfTheSnapshot) {
  while (lives_.journal().status().segment_ordinal < 3) {
    lives_.Submit();
    lives_.Write();
    ASSERT_LT(lives_.submitted(), 2'000u);
  }
  ASSERT_TRUE(Names(".snapshot").empty());
  lives_.AskForSnapshot();
  lives_.MakeDueSnapshot();
  const std::string name = SnapshotName(lives_.submitted());
  ASSERT_TRUE(folder_.Has(name));
  uint64_t byte = 0;
  const auto snapshot = ReadSnapshot(folder_, name, &byte);
  ASSERT_TRUE(snapshot.ok()) << snapshot.error();
  ASSERT_TRUE(folder_.Remove(name).ok());
  const auto followed = Recover(folder_);
  ASSERT_TRUE(followed.ok()) << followed.error();
  EXPECT_EQ(followed.value().snapshot_sequence, 0u) << "from the first event on";
  EXPECT_EQ(followed.value().sequence, snapshot.value().engine.sequence());
  EXPECT_EQ(followed.value().engine.StateHash(), snapshot.value().engine.StateHash());
  EXPECT_EQ(followed.value().stamp.field_time_ms, snapshot.value().stamp.field_time_ms);
  EXPECT_EQ(followed.value().stamp.utc_ms, snapshot.value().stamp.utc_ms);
  ByteWriter one;
  ByteWriter other;
  followed.value().engine.Save(&one);
  snapshot.value().engine.Save(&other);
  EXPECT_EQ(one.bytes(), other.bytes());
}

TEST_F(RetentionTest, WithFewerSnapshotsThanAreKeptNothingGoes) {
  RunUntilSnapshots(1);
  EXPECT_EQ(Names(".snapshot").size(), 1u);
  EXPECT_TRUE(folder_.Has(SegmentName(1)));
  EXPECT_EQ(RemoveWhatIsNotNeeded(2, &folder_).value(), 0u);
  EXPECT_GT(RemoveWhatIsNotNeeded(1, &folder_).value(), 0u);
  EXPECT_FALSE(folder_.Has(SegmentName(1)));
  EXPECT_EQ(lives_.Begin(), "");
}

// It says at once that it cannot be given to its end.
class BrokenState final : public StateSource {
 public:
  SnapshotHeader header() const override { return {7, {1, 1}, 0}; }
  Result<std::string> Next() override {
    return ++portions_ < 3 ? Result<std::string>(std::string(100'000, 'x'))
                           : Error{"the copy had no room"};
  }

 private:
  int portions_ = 0;
};

TEST_F(RetentionTest, AStateThatCannotBeGivenToItsEndLeavesNothing) {
  BrokenState state;
  const auto written = SnapshotWriter::Write(&state, &folder_);
  ASSERT_FALSE(written.ok());
  EXPECT_EQ(written.error(), "the copy had no room");
  EXPECT_TRUE(Names(".new").empty());
  EXPECT_TRUE(Names(".snapshot").empty());
}

TEST_F(RetentionTest, ADiskWithoutRoomForASnapshotKeepsTheLog) {
  RunUntilSnapshots(1);
  const auto before = folder_.List().value();
  lives_.AskForSnapshot();
  lives_.Submit();
  lives_.Write();
  folder_.LimitBytes(folder_.bytes());
  lives_.MakeDueSnapshot();
  EXPECT_EQ(lives_.snapshots(), 1u);
  for (const std::string& name : before) {
    EXPECT_TRUE(folder_.Has(name)) << name;
  }
  EXPECT_TRUE(Names(".new").empty());
  folder_.LimitBytes(UINT64_MAX);
  EXPECT_EQ(lives_.Begin(), "");
}

}  // namespace
}  // namespace pheromone::journal
