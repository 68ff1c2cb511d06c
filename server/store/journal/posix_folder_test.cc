#include "server/store/journal/posix_folder.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "server/base/testing/temporary_folder.h"

namespace pheromone::journal {
namespace {

using Mode = PosixFolder::Mode;

class PosixFolderTest : public ::testing::Test {
 protected:
  const TemporaryFolder folder_;
  const std::string root_ = folder_.string();
};

TEST_F(PosixFolderTest, FilesAreWrittenReadRenamedAndRemoved) {
  auto folder = PosixFolder::Open(root_ + "/journal", Mode::kOwner);
  ASSERT_TRUE(folder.ok()) << folder.error();
  auto file = folder.value()->Create("a");
  ASSERT_TRUE(file.ok());
  EXPECT_EQ(file.value()->Reserve(1 << 20), AppendFile::Reserved::kYes);
  EXPECT_TRUE(file.value()->Append("hello ").ok());
  EXPECT_TRUE(file.value()->Append("world").ok());
  EXPECT_TRUE(file.value()->Sync().ok());
  EXPECT_TRUE(folder.value()->Sync().ok());
  file.value()->ReleaseReserve();
  EXPECT_EQ(folder.value()->Read("a", 0, 100).value(), "hello world");
  EXPECT_EQ(folder.value()->Read("a", 6, 3).value(), "wor");
  EXPECT_EQ(folder.value()->Read("a", 60, 3).value(), "");
  EXPECT_FALSE(folder.value()->Create("a").ok());
  EXPECT_TRUE(folder.value()->Rename("a", "b").ok());
  EXPECT_EQ(folder.value()->List().value(), std::vector<std::string>{"b"});
  EXPECT_TRUE(folder.value()->Remove("b").ok());
  EXPECT_TRUE(folder.value()->List().value().empty());
  EXPECT_NE(folder.value()->Read("b", 0, 1).error().find("/journal/b: cannot be opened"),
            std::string::npos);
}

// It is shortened on the way, but not if it lives on under another name.
TEST_F(PosixFolderTest, AFileThatIsRemovedStaysWholeWhereItIsLinked) {
  auto folder = PosixFolder::Open(root_, Mode::kOwner);
  ASSERT_TRUE(folder.ok()) << folder.error();
  const std::string large(size_t{9} << 20, 'x');
  for (const char* name : {"a", "b"}) {
    ASSERT_TRUE(folder.value()->Create(name).value()->Append(large).ok());
  }
  std::filesystem::create_hard_link(root_ + "/b", root_ + "/backup");
  EXPECT_TRUE(folder.value()->Remove("a").ok());
  EXPECT_TRUE(folder.value()->Remove("b").ok());
  EXPECT_EQ(folder.value()->List().value(), std::vector<std::string>{"backup"});
  EXPECT_EQ(folder.value()->Read("backup", 0, large.size()).value(), large);
  EXPECT_EQ(folder.value()->Remove("a").error(),
            root_ + "/a: cannot be removed: No such file or directory");
}

TEST_F(PosixFolderTest, TwoServersCannotHaveOneFolder) {
  {
    auto first = PosixFolder::Open(root_, Mode::kOwner);
    ASSERT_TRUE(first.ok());
    const auto second = PosixFolder::Open(root_, Mode::kOwner);
    ASSERT_FALSE(second.ok());
    EXPECT_EQ(second.error(),
              root_ + ": in use by another server; each server needs a folder of its own");
    EXPECT_TRUE(PosixFolder::Open(root_, Mode::kReader).ok());
  }
  EXPECT_TRUE(PosixFolder::Open(root_, Mode::kOwner).ok());
}

TEST_F(PosixFolderTest, WhatIsNoFolderIsSaid) {
  EXPECT_EQ(PosixFolder::Open(root_ + "/missing", Mode::kReader).error(),
            root_ + "/missing: cannot be opened: No such file or directory");
  EXPECT_EQ(PosixFolder::Open(root_ + "/missing/deeper", Mode::kOwner).error(),
            root_ + "/missing/deeper: cannot be created: No such file or directory");
}

}  // namespace
}  // namespace pheromone::journal
