// Where journal and recordings go, and what speaks against it.

#include "server/config/folders.h"

#include <gmock/gmock.h>

#include "server/config/testing/folder_test.h"

namespace pheromone::config {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(JournalFolderTest, IsTheConfiguredOneElseThatOfTheStateDirectoryElseNone) {
  JournalConfig config;
  EXPECT_EQ(JournalFolder(config, nullptr), "");
  EXPECT_EQ(JournalFolder(config, ""), "");
  EXPECT_EQ(JournalFolder(config, "/var/lib/a"), "/var/lib/a/journal");
  EXPECT_EQ(JournalFolder(config, "/var/lib/a:/var/lib/b"), "/var/lib/a/journal");
  config.folder = "state";
  EXPECT_EQ(JournalFolder(config, "/var/lib/a"), "/var/lib/a/state");
  config.folder = "/srv/state";
  EXPECT_EQ(JournalFolder(config, "/var/lib/a"), "/srv/state");
  config.durability = JournalConfig::Durability::kNone;
  EXPECT_EQ(JournalFolder(config, "/var/lib/a"), "");
}

TEST(KeptPathTest, BeginsAtTheStateDirectoryOrWhereTheServerWasStartedUnlessItIsAbsolute) {
  const std::string here = std::filesystem::current_path().string();
  EXPECT_EQ(KeptPath("lab.field", nullptr), here + "/lab.field");
  EXPECT_EQ(KeptPath("./lab.field", ""), here + "/lab.field");
  EXPECT_EQ(KeptPath("a/../lab.field", "/var/lib/a:/var/lib/b"), "/var/lib/a/lab.field");
  EXPECT_EQ(KeptPath("/mnt/large/", "/var/lib/a"), "/mnt/large");
  EXPECT_EQ(KeptPath("/", "/var/lib/a"), "/");
  EXPECT_EQ(KeptPath("", "/var/lib/a"), "");
}

TEST(KeptPathTest, IsWhereRecordingsGo) {
  CaptureSettings config;
  config.folder = "captures";
  EXPECT_EQ(CaptureFolder(config, "/var/lib/a"), "/var/lib/a/captures");
}

TEST(WhyNotKeptTest, WhatSystemdEmptiesIsToldAndNothingElse) {
  EXPECT_THAT(WhyNotKept("/run/a/journal", "/run/a:/run/b"),
              HasSubstr("/run/a/journal: is in /run/a, which systemd removes"));
  EXPECT_THAT(WhyNotKept("/run/a/../a", "/run/a/"), HasSubstr("systemd removes"));
  EXPECT_EQ(WhyNotKept("/run/ab", "/run/a"), "");
  EXPECT_EQ(WhyNotKept("/run", "/run/a"), "");
  EXPECT_EQ(WhyNotKept("/run/a/../b", "/run/a"), "");
  EXPECT_EQ(WhyNotKept("/run/a", nullptr), "");
  EXPECT_EQ(WhyNotKept("", "/run/a"), "");
}

class FoldersTest : public FolderTest {
 protected:
  FolderReport Look() const { return LookAtFolders(config_, folder_.c_str()); }
  std::string In(const std::string& name) const { return folder_.string() + '/' + name; }

  Config config_ = Parse("").value();
};

TEST_F(FoldersTest, WhatIsNotThereYetIsGoodIfItCanBeMadeAndIsNotMade) {
  const FolderReport report = Look();
  EXPECT_THAT(report.warnings, IsEmpty());
  EXPECT_THAT(report.lines, ElementsAre("journal: " + In("journal") + ", to be created",
                                        "recordings: " + In("captures") + ", to be created"));
  EXPECT_FALSE(std::filesystem::exists(In("journal")));
  EXPECT_FALSE(std::filesystem::exists(In("captures")));
}

TEST_F(FoldersTest, WhatIsThereIsLeftAsItIs) {
  std::filesystem::create_directory(In("journal"));
  Write("journal/lock", "");
  const FolderReport report = Look();
  EXPECT_THAT(report.warnings, IsEmpty());
  EXPECT_EQ(report.lines.front(), "journal: " + In("journal"));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(In("journal")), {}), 1);
}

TEST_F(FoldersTest, AFileInItsPlaceOrAMissingFolderAboveIsWarnedOf) {
  Write("journal", "");
  config_.capture.folder = "none/captures";
  const FolderReport report = Look();
  EXPECT_THAT(report.errors, ElementsAre("journal.folder: " + In("journal") + ": is not a folder"));
  EXPECT_THAT(report.warnings,
              ElementsAre("capture.folder: " + In("none") +
                          ": No such file or directory, expected a writable folder"));
  config_.journal.folder = "none/journal";
  EXPECT_THAT(Look().errors,
              ElementsAre("journal.folder: " + In("none") +
                          ": No such file or directory, expected a writable folder"));
}

TEST_F(FoldersTest, WithoutAJournalThatIsSaid) {
  EXPECT_THAT(LookAtFolders(config_, nullptr).lines.front(), HasSubstr("journal: none"));
  config_.journal.durability = JournalConfig::Durability::kNone;
  EXPECT_EQ(Look().lines.front(), "journal: none");
}

}  // namespace
}  // namespace pheromone::config
