#include "server/daemon/membership_keeper.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <optional>
#include <string>

#include "server/store/journal/testing/crash_folder.h"

namespace pheromone::daemon {
namespace {

using journal::Membership;
using journal::testing::CrashFolder;

class MembershipKeeperTest : public ::testing::Test {
 protected:
  // As of a server that starts with this file; nullopt: without one.
  MembershipKeeper& Start(bool is_member, const std::optional<Membership>& file) {
    if (file) {
      EXPECT_TRUE(journal::WriteMembership(*file, &folder_).ok());
    }
    keeper_.emplace(is_member);
    EXPECT_TRUE(keeper_->Read(&folder_).ok());
    return *keeper_;
  }

  std::optional<Membership> File() const { return journal::ReadMembership(folder_).value(); }

  CrashFolder folder_{1};
  std::optional<MembershipKeeper> keeper_;
};

TEST_F(MembershipKeeperTest, AFileThatCannotBeReadIsAnError) {
  ASSERT_TRUE(journal::WriteMembership({.cluster = "lab"}, &folder_).ok());
  folder_.Contents("cluster") = "something else";
  MembershipKeeper keeper(true);
  EXPECT_FALSE(keeper.Read(&folder_).ok());
}

TEST_F(MembershipKeeperTest, AJournalOfNoClusterIsContinuedAloneOrJoinsWhileItIsNew) {
  const MembershipKeeper& keeper = Start(false, std::nullopt);
  EXPECT_EQ(keeper.WhyNotFor("", true), "");
  EXPECT_EQ(keeper.WhyNotFor("", false), "");
  EXPECT_EQ(keeper.WhyNotFor("lab", true), "");
  EXPECT_EQ(keeper.WhyNotFor("lab", false),
            "journal has a map that is of no cluster, expected one of cluster \"lab\" or an empty "
            "folder; to join it, move the folder away; to begin the cluster anew with this map, "
            "pheromonectl cluster reset --name lab journal");
}

TEST_F(MembershipKeeperTest, AJournalOfAClusterIsForNoOtherServer) {
  const MembershipKeeper& keeper = Start(true, Membership{.cluster = "lab"});
  EXPECT_EQ(keeper.WhyNotFor("lab", true), "");
  EXPECT_EQ(keeper.WhyNotFor("lab", false), "");
  for (const bool is_new : {false, true}) {
    EXPECT_EQ(
        keeper.WhyNotFor("", is_new),
        "journal is the journal of a server of cluster \"lab\", expected a configuration with "
        "[cluster]; to go on alone with this map, in a new epoch: pheromonectl cluster leave "
        "--new-epoch journal");
    EXPECT_EQ(keeper.WhyNotFor("field", is_new),
              "journal has a map that is of cluster \"lab\", expected one of cluster \"field\" or "
              "an empty folder; to join it, move the folder away; to begin the cluster anew with "
              "this map, pheromonectl cluster reset --name field journal");
  }
}

// The last event: after 5 s of field time, 1'000 s after 1970 by the clock of who stamped it.
constexpr engine::Stamp kLast{5'000, 1'000'000};

TEST_F(MembershipKeeperTest, AServerThatIsAloneResumesByTheLastEvent) {
  const MembershipKeeper& keeper = Start(false, std::nullopt);
  EXPECT_EQ(keeper.StartMs(kLast, 1'003'000, true), 8'000u);
  EXPECT_EQ(keeper.StartMs(kLast, 1'003'000, false), 5'000u);
}

// The other machine's clock is ten minutes ahead.
TEST_F(MembershipKeeperTest, AMemberResumesByItsOwnClockIfThatIsNoted) {
  EXPECT_EQ(Start(true, std::nullopt).StartMs(kLast, 1'003'000, true), 5'000u);
  EXPECT_EQ(Start(true, Membership{.cluster = "lab"}).StartMs(kLast, 1'003'000, true), 5'000u);
  const Membership noted{.cluster = "lab", .field_less_utc_ms = 5'000 - 400'000};
  EXPECT_EQ(Start(true, noted).StartMs(kLast, 402'500, true), 7'500u);
  EXPECT_EQ(Start(true, noted).StartMs(kLast, 402'500, false), 5'000u);
}

TEST_F(MembershipKeeperTest, ANotedClusterIsInTheFileAndNoLongerToBeFounded) {
  MembershipKeeper& keeper = Start(
      true,
      Membership{.cluster = "old", .founds = true, .new_epoch = true, .field_less_utc_ms = 3});
  ASSERT_TRUE(keeper.Note("lab", "8f2c").ok());
  const Membership expected{
      .cluster = "lab", .id = "8f2c", .new_epoch = true, .field_less_utc_ms = 3};
  EXPECT_EQ(File(), expected);
  EXPECT_EQ(keeper.Get(), expected);
}

TEST_F(MembershipKeeperTest, WhatIsNotOnTheDiskIsNotNoted) {
  MembershipKeeper& keeper = Start(true, Membership{.cluster = "old"});
  folder_.FailSyncs(1);
  EXPECT_FALSE(keeper.Note("lab", "8f2c").ok());
  EXPECT_EQ(keeper.Get().cluster, "old");
}

TEST_F(MembershipKeeperTest, AnEpochIsBegunOnce) {
  const Membership before{.cluster = "lab", .id = "1", .new_epoch = true, .field_less_utc_ms = 3};
  Membership after = before;
  after.new_epoch = false;
  MembershipKeeper& member = Start(true, before);
  member.EndNewEpoch();
  EXPECT_EQ(File(), after);
  EXPECT_EQ(member.Get(), after);
}

TEST_F(MembershipKeeperTest, AServerThatHasLeftItsClusterNeedsTheFileUntilItsEpochIsBegun) {
  MembershipKeeper& alone = Start(false, Membership{.new_epoch = true, .field_less_utc_ms = 3});
  alone.EndNewEpoch();
  EXPECT_EQ(File(), std::nullopt);
  EXPECT_EQ(alone.Get(), Membership());
}

TEST_F(MembershipKeeperTest, TheClockIsNotedWhenItIsASecondOff) {
  MembershipKeeper& keeper = Start(true, Membership{.cluster = "lab", .id = "1"});
  EXPECT_FALSE(keeper.IsClockNoted(10'000, 50'000));
  keeper.NoteClock(10'000, 50'000);
  EXPECT_EQ(File(), (Membership{.cluster = "lab", .id = "1", .field_less_utc_ms = -40'000}));
  for (const int64_t off_ms : {0, 999, -999}) {
    EXPECT_TRUE(keeper.IsClockNoted(20'000, 60'000 + off_ms)) << off_ms;
  }
  for (const int64_t off_ms : {1'000, -1'000}) {
    EXPECT_FALSE(keeper.IsClockNoted(20'000, 60'000 + off_ms)) << off_ms;
  }
}

TEST_F(MembershipKeeperTest, AClockThatIsNotOnTheDiskIsToBeNotedAgain) {
  MembershipKeeper& keeper = Start(true, Membership{.cluster = "lab"});
  folder_.FailSyncs(1);
  keeper.NoteClock(10'000, 50'000);
  EXPECT_FALSE(keeper.IsClockNoted(10'000, 50'000));
  keeper.NoteClock(10'000, 50'000);
  EXPECT_TRUE(keeper.IsClockNoted(10'000, 50'000));
}

TEST_F(MembershipKeeperTest, WithoutAFileThereIsNothingToAddAClockTo) {
  EXPECT_TRUE(Start(true, std::nullopt).IsClockNoted(10'000, 50'000));
  EXPECT_EQ(File(), std::nullopt);
}

}  // namespace
}  // namespace pheromone::daemon
