#include "server/journal/retention.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "server/journal/format.h"
#include "server/journal/recovery.h"
#include "server/journal/snapshot.h"
#include "server/journal/testing/crash_folder.h"
#include "server/journal/testing/life.h"

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
  EXPECT_EQ(ReadSnapshot(folder_, name, &byte).error(), "goes on after its end");
}

TEST_F(RetentionTest, AFollowerThatComesToAnotherStateWritesNothing) {
  while (lives_.journal().status().segment_ordinal < 2) {
    lives_.Submit();
    lives_.Write();
    ASSERT_LT(lives_.submitted(), 2'000u);
  }
  // The note at the end of the first segment, made to speak of another state.
  std::string& bytes = folder_.Contents(SegmentName(1));
  bytes.resize(bytes.size() - 25);
  const uint64_t last = Recover(folder_, 2).value().sequence;
  AppendHash(last, 4711, &bytes);
  const auto made = MakeSnapshot(2, 2, &folder_);
  ASSERT_FALSE(made.ok());
  EXPECT_TRUE(Names(".snapshot").empty());
}

TEST_F(RetentionTest, ADiskWithoutRoomForASnapshotKeepsTheLog) {
  RunUntilSnapshots(1);
  const auto before = folder_.List().value();
  lives_.journal().AskForSnapshot();
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
