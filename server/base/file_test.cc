#include "server/base/file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "server/base/testing/temporary_folder.h"

namespace pheromone {
namespace {

class FileTest : public ::testing::Test {
 protected:
  std::string In(const std::string& name) const { return (folder_ / name).string(); }
  size_t Entries() const {
    return static_cast<size_t>(
        std::distance(std::filesystem::directory_iterator(folder_.path()), {}));
  }

  TemporaryFolder folder_;
};

TEST_F(FileTest, ComesBackAsItWasWritten) {
  std::string bytes("\0\r\n\xFF", 4);
  bytes.append(200'000, 'x');
  ASSERT_TRUE(WriteFile(In("a"), bytes).ok());
  EXPECT_EQ(ReadFile(In("a")).value(), bytes);
}

TEST_F(FileTest, WritingReplacesTheWholeFileAndLeavesNothingBeside) {
  ASSERT_TRUE(WriteFile(In("a"), "long content").ok());
  ASSERT_TRUE(WriteFile(In("a"), "short").ok());
  EXPECT_EQ(ReadFile(In("a")).value(), "short");
  EXPECT_EQ(Entries(), 1U);
}

TEST_F(FileTest, WritingStepsOverWhatACrashLeftBehind) {
  std::ofstream(In("a.new0")) << "half";
  ASSERT_TRUE(WriteFile(In("a"), "whole").ok());
  EXPECT_EQ(ReadFile(In("a")).value(), "whole");
  EXPECT_EQ(ReadFile(In("a.new0")).value(), "half");
}

TEST_F(FileTest, AFailedWriteSaysWhyAndLeavesNothing) {
  EXPECT_EQ(WriteFile(In("none/a"), "x").error(),
            In("none/a.new0") + ": cannot be created: No such file or directory");
  std::filesystem::create_directory(In("folder"));
  EXPECT_EQ(WriteFile(In("folder"), "x").error(),
            In("folder") + ": cannot be written: Is a directory");
  EXPECT_EQ(Entries(), 1U);
}

TEST_F(FileTest, ADeviceIsNotReplacedByAFile) {
  ASSERT_EQ(mkfifo(In("pipe").c_str(), 0600), 0);
  std::filesystem::create_symlink("/dev/null", In("null"));
  for (const char* name : {"pipe", "null"}) {
    EXPECT_EQ(WriteFile(In(name), "x").error(),
              In(name) + ": cannot be written: is not a regular file");
  }
  EXPECT_TRUE(std::filesystem::is_fifo(In("pipe")));
  EXPECT_TRUE(std::filesystem::is_symlink(In("null")));
  EXPECT_EQ(Entries(), 2U);
}

TEST_F(FileTest, ASecretIsItsOwnersOnlyUnderAnyUmask) {
  struct stat status {};
  for (const mode_t mask : {0u, 0277u}) {
    const mode_t before = umask(mask);
    const Status written = WriteSecretFile(In("key"), "secret");
    umask(before);
    ASSERT_TRUE(written.ok()) << written.error();
    ASSERT_EQ(stat(In("key").c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 07777u, 0600u);
  }
  EXPECT_EQ(ReadFile(In("key")).value(), "secret");
  EXPECT_EQ(Entries(), 1U);
}

TEST_F(FileTest, ASecretThatRootReplacesKeepsItsOwner) {
  if (geteuid() != 0) {
    GTEST_SKIP() << "only root gives files away";
  }
  ASSERT_TRUE(WriteSecretFile(In("key"), "old").ok());
  ASSERT_EQ(chown(In("key").c_str(), 65534, static_cast<gid_t>(-1)), 0);
  ASSERT_TRUE(WriteSecretFile(In("key"), "new").ok());
  struct stat status {};
  ASSERT_EQ(stat(In("key").c_str(), &status), 0);
  EXPECT_EQ(status.st_uid, 65534U);
  EXPECT_EQ(ReadFile(In("key")).value(), "new");
}

TEST_F(FileTest, WhatIsWrittenInPartsReplacesTheFileAtTheEnd) {
  ASSERT_TRUE(WriteFile(In("a"), "old").ok());
  std::filesystem::create_symlink("a", In("link"));
  {
    FileWriter file(In("link"));
    file.Write("ne");
    file.Write("w");
    ASSERT_TRUE(file.Close().ok());
    EXPECT_EQ(ReadFile(In("a")).value(), "old");
    ASSERT_TRUE(file.Commit().ok());
  }
  EXPECT_EQ(ReadFile(In("a")).value(), "new");
  EXPECT_TRUE(std::filesystem::is_symlink(In("link")));
  EXPECT_EQ(Entries(), 2U);
}

TEST_F(FileTest, WhatIsWrittenInPartsAndGivenUpLeavesTheOldFile) {
  ASSERT_TRUE(WriteFile(In("a"), "old").ok());
  for (const char* name : {"a", "none"}) {
    FileWriter file(In(name));
    file.Write(std::string(200'000, 'x'));
    EXPECT_TRUE(file.status().ok());
  }
  EXPECT_EQ(ReadFile(In("a")).value(), "old");
  EXPECT_EQ(Entries(), 1U);
}

TEST_F(FileTest, ADeviceIsWrittenToInPartsAndStays) {
  std::filesystem::create_symlink("/dev/full", In("full"));
  FileWriter full(In("full"));
  full.Write(std::string(200'000, 'x'));
  full.Write("more");
  EXPECT_EQ(full.Commit().error(), In("full") + ": cannot be written: No space left on device");
  FileWriter null("/dev/null");
  null.Write("x");
  EXPECT_TRUE(null.Commit().ok());
  EXPECT_TRUE(std::filesystem::is_character_file(In("full")));
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
  EXPECT_EQ(Entries(), 1U);
}

TEST_F(FileTest, WhatCannotBeWrittenInPartsSaysWhy) {
  FileWriter nowhere(In("none/a"));
  nowhere.Write("x");
  EXPECT_EQ(nowhere.Commit().error(),
            In("none/a.new0") + ": cannot be created: No such file or directory");
  std::filesystem::create_directory(In("folder"));
  EXPECT_EQ(FileWriter(In("folder")).Commit().error(),
            In("folder") + ": cannot be created: Is a directory");
}

TEST_F(FileTest, AnOutputIsNoneOfTheInputsUnderAnyName) {
  ASSERT_TRUE(WriteFile(In("a"), "x").ok());
  ASSERT_TRUE(WriteFile(In("b"), "x").ok());
  std::filesystem::create_symlink("a", In("link"));
  std::filesystem::create_hard_link(In("a"), In("same"));
  for (const char* input : {"a", "./a", "link", "same"}) {
    EXPECT_EQ(CheckOutput(In("a"), {In("b"), In(input)}).error(),
              In("a") + ": the output is the input " + In(input) + ", expected another name");
  }
  EXPECT_TRUE(CheckOutput(In("a"), {In("b"), In("none"), ""}).ok());
  EXPECT_TRUE(CheckOutput(In("none"), {In("none")}).ok());
  EXPECT_TRUE(CheckOutput("/dev/null", {"/dev/null"}).ok());
}

TEST_F(FileTest, ReadingSaysWhyItFails) {
  EXPECT_EQ(ReadFile(In("a")).error(), In("a") + ": cannot be opened: No such file or directory");
  EXPECT_EQ(ReadFile(In("")).error(), In("") + ": cannot be read: Is a directory");
}

TEST_F(FileTest, ReadingStopsAtTheLimitEvenWhereThereIsNoEnd) {
  ASSERT_TRUE(WriteFile(In("a"), "12345").ok());
  EXPECT_TRUE(ReadFile(In("a"), 5).ok());
  EXPECT_EQ(ReadFile(In("a"), 4).error(), In("a") + ": too long, expected at most 4 bytes");
  // Files in /proc report the size 0.
  EXPECT_EQ(ReadFile("/proc/self/status", 3).error(),
            "/proc/self/status: too long, expected at most 3 bytes");
}

TEST_F(FileTest, WhatMayNeverEndOrNeverBeginIsNotRead) {
  EXPECT_EQ(ReadFile("/dev/zero").error(), "/dev/zero: is not a regular file");
  ASSERT_EQ(mkfifo(In("pipe").c_str(), 0600), 0);
  EXPECT_EQ(ReadFile(In("pipe")).error(), In("pipe") + ": is not a regular file");
}

TEST_F(FileTest, AHugeFileIsRefusedByItsSize) {
  ASSERT_TRUE(WriteFile(In("huge"), "").ok());
  std::filesystem::resize_file(In("huge"), uintmax_t{1} << 40);  // a hole
  EXPECT_EQ(ReadFile(In("huge")).error(),
            In("huge") + ": too long, expected at most 1073741824 bytes");
}

}  // namespace
}  // namespace pheromone
