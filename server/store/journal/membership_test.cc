#include "server/store/journal/membership.h"

#include <gtest/gtest.h>

#include "server/store/journal/testing/crash_folder.h"

namespace pheromone::journal {
namespace {

using testing::CrashFolder;

constexpr char kWhole[] =
    "pheromone journal of a cluster, version 1\n"
    "cluster lab\n"
    "id 8f2c60aa91d2b7e3\n"
    "founds 1\n"
    "new_epoch 1\n"
    "field_less_utc_ms -1700000000000\n"
    "end\n";

TEST(MembershipTest, TheFileIsTextThatTheHeaderDescribes) {
  const Membership all{.cluster = "lab",
                       .id = "8f2c60aa91d2b7e3",
                       .founds = true,
                       .new_epoch = true,
                       .field_less_utc_ms = -1'700'000'000'000};
  EXPECT_EQ(EncodeMembership(all), kWhole);
  EXPECT_EQ(DecodeMembership(kWhole).value(), all);
  EXPECT_EQ(DecodeMembership(EncodeMembership({})).value(), Membership{});
}

// A marker that cannot be read must not count as none: the journal would start alone.
TEST(MembershipTest, ATextThatIsCutOffAnywhereIsNoOther) {
  const std::string whole = kWhole;
  for (size_t length = 0; length < whole.size(); ++length) {
    ASSERT_FALSE(DecodeMembership(whole.substr(0, length)).ok()) << length;
  }
  EXPECT_FALSE(DecodeMembership(whole + "\n").ok());
  for (const char* line : {"cluster \n", "founds 0\n", "field_less_utc_ms 12x\n", "other 1\n", "\n",
                           "field_less_utc_ms 9999999999999999999\n"}) {
    EXPECT_FALSE(DecodeMembership("pheromone journal of a cluster, version 1\n" +
                                  std::string(line) + "end\n")
                     .ok())
        << line;
  }
  EXPECT_FALSE(DecodeMembership("pheromone journal of a cluster, version 2\nend\n").ok());
}

TEST(MembershipTest, APowerFailureLeavesTheOldOneOrTheNewOne) {
  const Membership before{.cluster = "lab", .id = "1"};
  const Membership after{.cluster = "lab", .id = "1", .field_less_utc_ms = 5};
  bool was_cut = true;
  for (uint64_t cut = 1; was_cut; ++cut) {
    CrashFolder folder(cut);
    ASSERT_TRUE(WriteMembership(before, &folder).ok());
    folder.CutAt(cut);
    const Status written = WriteMembership(after, &folder);
    was_cut = folder.is_off();
    ASSERT_EQ(written.ok(), !was_cut);
    folder.PowerOn();
    const auto found = ReadMembership(folder);
    ASSERT_TRUE(found.ok()) << found.error();
    ASSERT_TRUE(found.value().has_value());
    EXPECT_TRUE(*found.value() == before || *found.value() == after);
    EXPECT_TRUE(was_cut || *found.value() == after);
  }
}

TEST(MembershipTest, WithoutTheFileAJournalIsInNoCluster) {
  CrashFolder folder(1);
  EXPECT_EQ(ReadMembership(folder).value(), std::nullopt);
  ASSERT_TRUE(WriteMembership({.cluster = "lab", .id = "1"}, &folder).ok());
  ASSERT_TRUE(RemoveMembership(&folder).ok());
  EXPECT_EQ(ReadMembership(folder).value(), std::nullopt);
  ASSERT_TRUE(WriteMembership({.cluster = "lab", .id = "1"}, &folder).ok());
  folder.Contents("cluster") = "something else";
  EXPECT_EQ(
      ReadMembership(folder).error(),
      "journal/cluster: expected the first line \"pheromone journal of a cluster, version 1\"");
}

TEST(MembershipTest, NothingIsWrittenThatCouldNotBeReadAgain) {
  CrashFolder folder(1);
  const Membership before{.cluster = "lab", .id = "1"};
  ASSERT_TRUE(WriteMembership(before, &folder).ok());
  for (const std::string& id : {std::string("1\n2"), std::string("1\nfounds 1"),
                                std::string("1\nend"), std::string(4096, 'x')}) {
    EXPECT_FALSE(WriteMembership({.cluster = "lab", .id = id}, &folder).ok()) << id;
  }
  EXPECT_EQ(ReadMembership(folder).value(), before);
}

TEST(MembershipTest, ALinkOrFolderOfThatNameIsAnError) {
  CrashFolder folder(1);
  folder.others = {"cluster"};
  EXPECT_EQ(ReadMembership(folder).error(), "journal/cluster: expected a regular file");
}

}  // namespace
}  // namespace pheromone::journal
