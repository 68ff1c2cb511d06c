#include "server/base/terminal.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <string>

#include "server/base/holders.h"

namespace pheromone {
namespace {

class TerminalTest : public ::testing::Test {
 protected:
  TerminalTest() {
    EXPECT_EQ(0, grantpt(master_.get()));
    EXPECT_EQ(0, unlockpt(master_.get()));
    std::array<char, 64> name{};
    EXPECT_EQ(0, ptsname_r(master_.get(), name.data(), name.size()));
    path_ = name.data();
  }

  const Descriptor master_{posix_openpt(O_RDWR | O_NOCTTY)};
  std::string path_;
};

// Of all that have it open, such as the server that made it, the one with the lock is named.
TEST_F(TerminalTest, IsForOneProgramWhichTheSecondNames) {
  std::array<int, 2> ready{};
  std::array<int, 2> over{};
  ASSERT_EQ(0, pipe(ready.data()));
  ASSERT_EQ(0, pipe(over.data()));
  const pid_t first = fork();
  if (first == 0) {
    close(over[1]);
    const OpenedTerminal opened = OpenTerminal(path_);
    char byte = opened.status.ok() ? 1 : 0;
    (void)!write(ready[1], &byte, 1);
    _exit(read(over[0], &byte, 1) == 0 ? 0 : 1);
  }
  char opened = 0;
  ASSERT_EQ(1, read(ready[0], &opened, 1));
  EXPECT_EQ(1, opened);

  const OpenedTerminal second = OpenTerminal(path_);
  EXPECT_FALSE(second.descriptor.valid());
  EXPECT_TRUE(second.in_use);
  ASSERT_FALSE(second.status.ok());
  EXPECT_EQ(second.status.error(), "in use by " + DescribeProcess(first));

  close(over[1]);
  waitpid(first, nullptr, 0);
  EXPECT_TRUE(OpenTerminal(path_).status.ok());
  for (const int end : {ready[0], ready[1], over[0]}) {
    close(end);
  }
}

TEST_F(TerminalTest, OtherFailuresAreTheSystems) {
  const OpenedTerminal absent = OpenTerminal("/nonexistent/port");
  ASSERT_FALSE(absent.status.ok());
  EXPECT_EQ(absent.status.error(), "No such file or directory");
  EXPECT_FALSE(absent.in_use);
  const OpenedTerminal file = OpenTerminal("/dev/null");
  ASSERT_FALSE(file.status.ok());
  EXPECT_EQ(file.status.error(), "not a terminal device (Inappropriate ioctl for device)");
}

TEST(WhyNotOpenedTest, WhoMayNotOpenAPortIsToldOfTheGroup) {
  EXPECT_EQ(WhyNotOpened(EACCES),
            "Permission denied; serial ports are for members of the group dialout: sudo adduser "
            "$USER dialout, then log in again");
  EXPECT_EQ(WhyNotOpened(ENOENT), "No such file or directory");
}

}  // namespace
}  // namespace pheromone
