// Where journal and recordings go, and what speaks against it.

#include "server/config/folders.h"

#include <gmock/gmock.h>

#include "server/config/testing/temporary_folder.h"

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
  EXPECT_EQ(JournalFolder(config, "/var/lib/a"), "state");
  config.durability = JournalConfig::Durability::kNone;
  EXPECT_EQ(JournalFolder(config, "/var/lib/a"), "");
}

TEST(CaptureFolderTest, BeginsAtTheStateDirectoryUnlessItIsAbsolute) {
  CaptureSettings config;
  config.folder = "captures";
  EXPECT_EQ(CaptureFolder(config, nullptr), "captures");
  EXPECT_EQ(CaptureFolder(config, "/var/lib/a:/var/lib/b"), "/var/lib/a/captures");
  config.folder = "/mnt/large";
  EXPECT_EQ(CaptureFolder(config, "/var/lib/a"), "/mnt/large");
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
  EXPECT_THAT(report.lines,
              ElementsAre("journal: " + In("journal") + ", which is not there yet",
                          "recordings: " + In("captures") + ", which is not there yet"));
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
  EXPECT_THAT(report.warnings,
              ElementsAre("journal.folder: " + In("journal") + ": is not a folder",
                          "capture.folder: " + In("none") +
                              ": No such file or directory, expected a folder that can be written "
                              "to"));
}

TEST_F(FoldersTest, WithoutAJournalThatIsSaid) {
  EXPECT_THAT(LookAtFolders(config_, nullptr).lines.front(), HasSubstr("journal: none"));
  config_.journal.durability = JournalConfig::Durability::kNone;
  EXPECT_EQ(Look().lines.front(), "journal: none");
}

}  // namespace
}  // namespace pheromone::config
