#include "server/store/journal/recovery.h"

#include <gtest/gtest.h>

#include <memory>

#include "server/store/journal/crc32c.h"
#include "server/store/journal/durable_note.h"
#include "server/store/journal/format.h"
#include "server/store/journal/open.h"
#include "server/store/journal/snapshot.h"
#include "server/store/journal/testing/borders.h"
#include "server/store/journal/testing/crash_folder.h"
#include "server/store/journal/testing/life.h"

namespace pheromone::journal {
namespace {

using testing::Border;
using testing::BordersOf;
using testing::CrashFolder;
using testing::DurableByMarks;
using testing::LastBefore;
using testing::Lives;
using testing::SmallJournal;

class RecoveryTest : public ::testing::Test {
 protected:
  void SetUp() override {
    JournalSettings settings = SmallJournal();
    settings.segment_bytes = 1 << 20;
    settings.queue_bytes = 1 << 20;
    lives_ = std::make_unique<Lives>(&folder_, settings, 7);
    ASSERT_EQ(lives_->Begin(), "");
    for (int group = 0; group < 12; ++group) {
      for (int i = 0; i < 5; ++i) {
        ASSERT_TRUE(lives_->Submit());
      }
      lives_->Write();
    }
  }

  std::string& Segment() { return folder_.Contents(SegmentName(1)); }

  CrashFolder folder_{5};
  std::unique_ptr<Lives> lives_;
};

TEST_F(RecoveryTest, EveryTruncationGivesTheStateOfTheLastWholeRecord) {
  const std::string whole = Segment();
  const std::vector<Border> borders = BordersOf(whole);
  const size_t closely = whole.size() - 600;
  for (size_t length = 36; length<whole.size(); length += length> closely ? 1u : 41u) {
    Segment() = whole.substr(0, length);
    const auto recovered = Recover(folder_);
    ASSERT_TRUE(recovered.ok()) << recovered.error();
    const Border last = LastBefore(borders, length);
    ASSERT_EQ(recovered.value().sequence, last.sequence) << length;
    ASSERT_FALSE(recovered.value().lost) << "what is cut off cannot be told from what never was";
    if (length != last.at) {
      ASSERT_EQ(recovered.value().findings.size(), 1u);
      ASSERT_EQ(recovered.value().findings[0].byte, last.at);
    }
    if (recovered.value().sequence > 0) {
      ASSERT_EQ(recovered.value().engine.StateHash(), lives_->hashes()[last.sequence]);
    }
  }
}

TEST_F(RecoveryTest, EveryDamagedByteIsReportedAndEndsThePrefix) {
  const std::string whole = Segment();
  const std::vector<Border> borders = BordersOf(whole);
  const size_t closely = whole.size() - 600;
  for (size_t at = 36; at<whole.size(); at += at> closely ? 1u : 37u) {
    Segment() = whole;
    Segment()[at] = static_cast<char>(Segment()[at] ^ 0x20);
    const auto recovered = Recover(folder_);
    ASSERT_TRUE(recovered.ok());
    const Border last = LastBefore(borders, at);
    ASSERT_EQ(recovered.value().sequence, last.sequence) << at;
    ASSERT_EQ(recovered.value().findings.size(), 1u);
    ASSERT_EQ(recovered.value().findings[0].byte, last.at);
    ASSERT_EQ(recovered.value().findings[0].file, "journal/00000001.segment");
    if (last.sequence > 0) {
      ASSERT_EQ(recovered.value().engine.StateHash(), lives_->hashes()[last.sequence]);
    }
    // What a mark calls durable was damaged afterwards.
    ASSERT_EQ(recovered.value().lost, last.sequence < DurableByMarks(borders, last.at)) << at;
  }
}

// An end that was cut off between two records looks like the end of the log; the note tells.
TEST_F(RecoveryTest, AnEndThatWasCutOffBetweenRecordsIsMissedFromTheLastNoteOn) {
  lives_->PassTime(1'000'000);
  lives_->Write();  // nothing but the note: 60 are on the disk
  ASSERT_TRUE(lives_->Submit());
  lives_->Write();  // not noted yet
  const std::string whole = Segment();
  const std::vector<Border> borders = BordersOf(whole);
  for (const Border& border : borders) {
    Segment() = whole.substr(0, border.at);
    const auto recovered = Recover(folder_);
    ASSERT_TRUE(recovered.ok());
    ASSERT_EQ(recovered.value().sequence, border.sequence);
    ASSERT_EQ(recovered.value().lost, border.sequence < 60) << border.at;
    if (border.sequence < 60) {
      ASSERT_EQ(recovered.value().findings.size(), 1u);
      EXPECT_EQ(recovered.value().findings[0].file, "journal/durable");
      EXPECT_EQ(recovered.value().findings[0].what.find("the log ends at sequence " +
                                                        std::to_string(border.sequence) +
                                                        ", but 60 was durable at "),
                0u);
    }
  }
  // The next life begins an epoch, once.
  Segment() = whole.substr(0, borders[20].at);
  EXPECT_NE(lives_->Begin(), "");
  EXPECT_TRUE(lives_->opened().state_lost);
  EXPECT_EQ(lives_->Begin(), "");
}

TEST_F(RecoveryTest, ANoteOfWhichAPlaceIsTornIsTheOtherOne) {
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(lives_->Submit());
    lives_->PassTime(1'000'000);
    lives_->Write();
  }
  std::string& file = folder_.Contents(std::string(kDurableName));
  const std::string whole = file;
  const DurableNote last = *ReadDurableNote(folder_);
  EXPECT_EQ(last.sequence, 62u);
  file[NotePlace(last) + 25] = 'x';
  const auto other = ReadDurableNote(folder_);
  ASSERT_TRUE(other.has_value());
  EXPECT_EQ(other->count, last.count - 1);
  EXPECT_LT(other->sequence, last.sequence);
  file[NotePlace(*other) + 25] = 'x';
  EXPECT_FALSE(ReadDurableNote(folder_).has_value());
  EXPECT_FALSE(Recover(folder_).value().lost) << "without a note nothing is known";
  file = whole;
}

TEST_F(RecoveryTest, WhatIsNoFileButHasTheNameOfOneIsTold) {
  folder_.others = {"00000007.segment", "lost+found"};
  const auto recovered = Recover(folder_);
  ASSERT_TRUE(recovered.ok());
  EXPECT_EQ(recovered.value().sequence, 60u);
  ASSERT_EQ(recovered.value().findings.size(), 1u);
  EXPECT_EQ(recovered.value().findings[0].file, "journal/00000007.segment");
  EXPECT_EQ(recovered.value().next_ordinal, 8u);
  EXPECT_FALSE(recovered.value().lost);
}

TEST_F(RecoveryTest, ProgressGoesFromNothingToAll) {
  Progress last;
  uint64_t calls = 0;
  const auto recovered = Recover(folder_, UINT64_MAX, [&](const Progress& now) {
    EXPECT_GE(now.bytes_done, last.bytes_done);
    EXPECT_LE(now.bytes_done, now.bytes_total);
    EXPECT_GE(now.events, last.events);
    last = now;
    ++calls;
  });
  ASSERT_TRUE(recovered.ok());
  EXPECT_EQ(last.events, 60u);
  EXPECT_EQ(last.bytes_total, Segment().size());
  EXPECT_GE(last.bytes_done + kSegmentHeaderBytes, last.bytes_total);
  EXPECT_GE(calls, 60u);
}

// Of a file of any size only pieces are in memory; a mark may lie across two of them.
TEST_F(RecoveryTest, AMarkBehindAVeryLongTailIsFound) {
  const uint64_t end = Segment().size();
  std::string mark;
  AppendGroup(61, &mark);
  for (const size_t distance : {(size_t{1} << 20) - 5, size_t{3} << 20}) {
    std::string& bytes = Segment();
    bytes.resize(end);
    bytes.resize(end + distance);
    bytes += mark;
    const auto recovered = Recover(folder_);
    ASSERT_TRUE(recovered.ok());
    EXPECT_EQ(recovered.value().sequence, 60u);
    EXPECT_TRUE(recovered.value().lost);
    ASSERT_EQ(recovered.value().findings.size(), 1u);
    EXPECT_EQ(recovered.value().findings[0].byte, end);
  }
}

TEST_F(RecoveryTest, WhatIsDamagedIsMovedAsideAndANewEpochBegins) {
  const std::string whole = Segment();
  const std::vector<Border> borders = BordersOf(whole);
  const Border& hit = borders[20];
  std::string damaged = whole;
  damaged[hit.at + 9] = static_cast<char>(damaged[hit.at + 9] ^ 1);
  Segment() = damaged;
  EXPECT_NE(lives_->Begin(), "");
  EXPECT_TRUE(lives_->opened().state_lost);
  EXPECT_EQ(lives_->engine().sequence(), hit.sequence);
  EXPECT_EQ(lives_->opened().report.size(), 1u);
  EXPECT_EQ(lives_->opened().report[0].find("damaged: journal/00000001.segment: byte " +
                                            std::to_string(hit.at)),
            0u);
  EXPECT_EQ(folder_.Contents("00000001.segment.damaged"), damaged);
  EXPECT_FALSE(folder_.Has(SegmentName(1)));
  // It goes on from there, and the next life finds nothing wrong.
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(lives_->Submit());
  }
  lives_->Write();
  EXPECT_EQ(lives_->Begin(), "");
  EXPECT_EQ(lives_->engine().sequence(), hit.sequence + 5);
  EXPECT_TRUE(lives_->opened().report.empty());
}

TEST_F(RecoveryTest, AMissingSegmentIsDamage) {
  ASSERT_EQ(lives_->Begin(), "");  // a second segment
  ASSERT_TRUE(lives_->Submit());
  lives_->Write();
  ASSERT_TRUE(folder_.Has(SegmentName(2)));
  ASSERT_TRUE(folder_.Remove(SegmentName(1)).ok());
  const auto recovered = Recover(folder_);
  ASSERT_FALSE(recovered.ok());
  EXPECT_EQ(recovered.error().find("journal: the beginning is missing"), 0u);
}

TEST_F(RecoveryTest, WhatMayNotBeOnTheDiskIsWrittenAgain) {
  ASSERT_TRUE(lives_->Submit());
  ASSERT_TRUE(lives_->Submit());
  lives_->Write();
  const auto recovered = Recover(folder_);
  EXPECT_EQ(recovered.value().sequence, 62u);
  EXPECT_EQ(recovered.value().certain, 60u);
  ASSERT_EQ(lives_->Begin(), "");
  EXPECT_EQ(lives_->journal().DurableSequence(), 62u);
  const auto again = Recover(folder_);
  EXPECT_EQ(again.value().sequence, 62u);
  // The second segment has them itself: the first one's are not needed any more.
  Segment().resize(Segment().size() - 1);
  EXPECT_EQ(Recover(folder_).value().sequence, 62u);
  EXPECT_TRUE(Recover(folder_).value().findings.empty());
}

TEST_F(RecoveryTest, AnotherVersionIsRefusedAndLeftAlone) {
  Segment()[8] = 9;
  ByteWriter checksum;
  checksum.U32(Crc32c(Segment().substr(0, 32)));
  Segment().replace(32, 4, checksum.bytes());
  const std::string before = Segment();
  EXPECT_EQ(Recover(folder_).error(),
            "journal/00000001.segment: has version 9, but this program reads version 2; use the "
            "program that wrote it, or another journal folder");
  EXPECT_NE(lives_->Begin(), "");
  EXPECT_EQ(Segment(), before);
}

TEST_F(RecoveryTest, AnEventThatCannotFollowIsDamageWhereItStands) {
  const size_t size = Segment().size();
  ByteWriter scratch;
  engine::CommandIssued command;
  command.link = 77;
  AppendEvent(61, {999'999'999, 0}, command, &scratch, &Segment());
  const auto recovered = Recover(folder_);
  ASSERT_TRUE(recovered.ok());
  EXPECT_EQ(recovered.value().sequence, 60u);
  EXPECT_TRUE(recovered.value().lost);
  ASSERT_EQ(recovered.value().findings.size(), 1u);
  EXPECT_EQ(recovered.value().findings[0].Text(), "journal/00000001.segment: byte " +
                                                      std::to_string(size) +
                                                      ": event refused: unknown link 77");
}

TEST_F(RecoveryTest, AnotherStateThanWasNotedIsNoticed) {
  AppendHash(60, 12345, &Segment());
  const auto recovered = Recover(folder_);
  EXPECT_TRUE(recovered.value().differs);
  EXPECT_EQ(recovered.value().sequence, 60u);
  EXPECT_NE(lives_->Begin(), "");
  EXPECT_TRUE(folder_.Has(SnapshotName(60)));
  EXPECT_EQ(lives_->Begin(), "") << "from the snapshot on, it is the state";
}

TEST(Recovery, AnEmptyFolderIsANewJournal) {
  CrashFolder folder(1);
  const auto recovered = Recover(folder);
  ASSERT_TRUE(recovered.ok());
  EXPECT_FALSE(recovered.value().engine.configured());
  EXPECT_EQ(recovered.value().next_ordinal, 1u);
}

// A server of a cluster takes the state of another one, which is further: its own events end
// before, or it has none.
class JoinedTest : public ::testing::Test {
 protected:
  void SetUp() override {
    settings_.segment_bytes = 1 << 20;
    Lives ahead(&others_, settings_, 7);
    ASSERT_EQ(ahead.Begin(), "");
    while (ahead.submitted() < 90) {
      ahead.Submit();
      ahead.Write();
    }
    state_hash_ = ahead.hashes().back();
    name_ = SnapshotName(90);
    ASSERT_TRUE(WriteSnapshot(ahead.engine(), {ahead.engine().field_time_ms(), 5}, &others_).ok());
  }

  Opened Open() {
    auto opened = OpenJournal(
        &folder_, settings_, [] { return uint64_t{1}; },
        [](bool /*is_trouble*/, const std::string& /*text*/) {});
    EXPECT_TRUE(opened.ok()) << opened.error();
    return std::move(opened).value();
  }

  void LiveUntil(uint64_t sequence) {
    Lives behind(&folder_, settings_, 7);
    ASSERT_EQ(behind.Begin(), "");
    while (behind.submitted() < sequence) {
      behind.Submit();
      behind.Write();
    }
    // A process that takes a state ends without a hash.
    ASSERT_TRUE(behind.journal().Close(std::nullopt).ok());
  }

  void Join() {
    auto file = folder_.Create(name_);
    ASSERT_TRUE(file.ok());
    ASSERT_TRUE(file.value()->Append(others_.Contents(name_)).ok());
    ASSERT_TRUE(file.value()->Sync().ok());
    ASSERT_TRUE(folder_.Sync().ok());
  }

  void ExpectJoined() {
    for (int life = 0; life < 2; ++life) {
      const Opened opened = Open();
      EXPECT_EQ(opened.engine.sequence(), 90u);
      EXPECT_EQ(opened.engine.StateHash(), state_hash_);
      EXPECT_FALSE(opened.state_lost);
      EXPECT_TRUE(opened.report.empty()) << opened.report.front();
      EXPECT_EQ(opened.journal->DurableSequence(), 90u);
      EXPECT_TRUE(opened.journal->Close(opened.engine.StateHash()).ok());
    }
  }

  JournalSettings settings_ = SmallJournal();
  CrashFolder others_{3};
  CrashFolder folder_{5};
  std::string name_;
  uint64_t state_hash_ = 0;
};

TEST_F(JoinedTest, ASnapshotBeyondTheOwnEventsIsWhereAServerGoesOn) {
  LiveUntil(40);
  Join();
  ExpectJoined();
}

TEST_F(JoinedTest, ASnapshotInANewFolderIsWhereAServerGoesOn) {
  EXPECT_TRUE(Open().journal->Close(std::nullopt).ok());
  Join();
  ExpectJoined();
}

TEST_F(JoinedTest, ASnapshotAtTheOwnLastEventIsWhereAServerGoesOn) {
  LiveUntil(90);
  Join();
  ExpectJoined();
}

// Then the server has less than before, says so, and asks the cluster for what is missing.
TEST_F(JoinedTest, WithoutThatSnapshotTheOwnEventsAreFoundAndTheLossIsTold) {
  LiveUntil(40);
  Join();
  ExpectJoined();
  folder_.Contents(name_)[100] ^= 1;
  const Opened opened = Open();
  EXPECT_EQ(opened.engine.sequence(), 40u);
  EXPECT_TRUE(opened.state_lost);
}

// A relaxed journal cannot tell that it ended in order, since its last mark is before the snapshot.
TEST_F(JoinedTest, ARelaxedJournalGoesOnFromThereToo) {
  settings_.relaxed = true;
  LiveUntil(40);
  Join();
  const Opened opened = Open();
  EXPECT_EQ(opened.engine.StateHash(), state_hash_);
  EXPECT_TRUE(opened.state_lost);
  EXPECT_TRUE(opened.journal->Close(opened.engine.StateHash()).ok());
  ExpectJoined();
}

// The power goes at any time. proto_tests/crash does this a thousand times, and with mutants.
TEST(Recovery, APowerCutLosesNothingThatWasAcknowledged) {
  uint64_t snapshots = 0;
  for (uint64_t seed = 0; seed < 25; ++seed) {
    CrashFolder folder(seed);
    Lives lives(&folder, SmallJournal(), seed);
    for (int life = 0; life < 4; ++life) {
      ASSERT_EQ(lives.Begin(), "") << "seed " << seed << " life " << life;
      folder.CutAt(1 + (seed * 7919 + static_cast<uint64_t>(life) * 104'729) % 150);
      while (!folder.is_off()) {
        lives.Step();
      }
      folder.PowerOn();
    }
    snapshots += lives.snapshots();
  }
  EXPECT_GT(snapshots, 0u);
}

}  // namespace
}  // namespace pheromone::journal
