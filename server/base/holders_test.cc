#include "server/base/holders.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <ctime>
#include <filesystem>

#include "server/base/descriptor.h"
#include "server/base/testing/temporary_folder.h"

namespace pheromone {
namespace {

// A child that holds a listening port until the test ends.
class PortHolderProcess {
 public:
  explicit PortHolderProcess(int type = SOCK_STREAM) {
    const int fd = socket(AF_INET, type, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(bind(fd, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_TRUE(type == SOCK_DGRAM || listen(fd, 1) == 0);
    EXPECT_EQ(getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size), 0);
    port = ntohs(address.sin_port);
    EXPECT_EQ(pipe(ends_.data()), 0);
    pid = fork();
    if (pid == 0) {
      close(ends_[1]);
      char byte = 0;
      _exit(read(ends_[0], &byte, 1) == 0 ? 0 : 1);
    }
    close(fd);
    close(ends_[0]);
  }
  ~PortHolderProcess() {
    close(ends_[1]);
    waitpid(pid, nullptr, 0);
  }

  uint16_t port = 0;
  pid_t pid = 0;

 private:
  std::array<int, 2> ends_{};
};

TEST(HoldersTest, TheProcessThatListensOnAPortIsFound) {
  const PortHolderProcess holder;
  EXPECT_EQ(HolderOfPort(holder.port), holder.pid);
  EXPECT_EQ(HolderOfPort(1), std::nullopt);
}

TEST(HoldersTest, AUdpPortIsAnotherThanTheTcpPortOfThatNumber) {
  const PortHolderProcess holder(SOCK_DGRAM);
  EXPECT_EQ(HolderOfPort(holder.port, Transport::kUdp), holder.pid);
  EXPECT_NE(HolderOfPort(holder.port), holder.pid);
}

TEST(HoldersTest, TheProcessThatHasAFileOpenIsFoundThroughASymbolicLink) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "there");
  std::filesystem::create_directory_symlink("there", folder / "here");
  const std::string file = folder / "there/lock";
  const Descriptor own(open(file.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0600));
  const PortHolderProcess holder;  // its descriptors are copies of this process's
  EXPECT_EQ(HoldersOf(file), std::vector<int>{holder.pid});
  EXPECT_EQ(HoldersOf(folder / "here/lock"), std::vector<int>{holder.pid});
}

TEST(HoldersTest, AProcessIsToldWithItsNameNumberAndStart) {
  const std::time_t now = std::time(nullptr);
  const PortHolderProcess holder;
  const std::string text = DescribeProcess(holder.pid);
  EXPECT_TRUE(text.starts_with("base_test (process " + std::to_string(holder.pid) + ", since "))
      << text;
  std::tm told{};
  ASSERT_NE(strptime(text.substr(text.find("since ") + 6).c_str(), "%Y-%m-%d %H:%M:%S", &told),
            nullptr);
  told.tm_isdst = -1;
  EXPECT_NEAR(static_cast<double>(std::mktime(&told)), static_cast<double>(now), 3);
}

TEST(HoldersTest, OfOneThatIsGoneOnlyTheNumberIsTold) {
  EXPECT_EQ(DescribeProcess(4711, "/nowhere"), "a program (process 4711)");
}

}  // namespace
}  // namespace pheromone
