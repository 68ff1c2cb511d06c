#include "server/base/say_line.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <string>

#include "server/base/descriptor.h"

namespace pheromone {
namespace {

// While it exists, it is standard output.
class Output {
 public:
  explicit Output(const Descriptor& output) : saved_(dup(STDOUT_FILENO)) {
    std::fflush(stdout);
    EXPECT_NE(-1, dup2(output.get(), STDOUT_FILENO));
  }
  ~Output() { dup2(saved_.get(), STDOUT_FILENO); }

 private:
  Descriptor saved_;
};

// Many more lines than fit.
void SayALot() {
  for (size_t i = 0; i < 10'000; ++i) {
    SayLine(1500, "something happened, and then something else" + std::string(i % 64, '.'));
  }
}

// The first characters.
std::string Said(const Descriptor& reader) {
  std::array<char, 51> buffer{};
  const ssize_t size = read(reader.get(), buffer.data(), buffer.size());
  return {buffer.data(), static_cast<size_t>(size)};
}

std::string SaidWithoutAReader(const Descriptor& reader, const Descriptor& writer) {
  const Output output(writer);
  SayALot();
  EXPECT_EQ(0, fcntl(STDOUT_FILENO, F_GETFL) & O_NONBLOCK);  // which it shares with others
  return Said(reader);
}

constexpr char kSaid[] = "     1.5 s  something happened, and then something ";

TEST(SayLine, APipeThatNobodyReadsHoldsNothingUp) {
  std::array<int, 2> ends{};
  ASSERT_EQ(0, pipe(ends.data()));
  const Descriptor reader(ends[0]);
  const Descriptor writer(ends[1]);
  EXPECT_EQ(kSaid, SaidWithoutAReader(reader, writer));
}

// A terminal whose connection hangs has room for a part of a line at last.
TEST(SayLine, ATerminalThatNobodyReadsHoldsNothingUp) {
  int master = -1;
  int slave = -1;
  ASSERT_EQ(0, openpty(&master, &slave, nullptr, nullptr, nullptr));
  const Descriptor reader(master);
  const Descriptor writer(slave);
  EXPECT_EQ(kSaid, SaidWithoutAReader(reader, writer));
}

TEST(SayLine, ASocketThatNobodyReadsHoldsNothingUp) {
  std::array<int, 2> ends{};
  ASSERT_EQ(0, socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()));
  const Descriptor reader(ends[0]);
  const Descriptor writer(ends[1]);
  EXPECT_EQ(kSaid, SaidWithoutAReader(reader, writer));
}

// Of a process whose standard output this user may not open, as after sudo -u.
template <typename Fork>
int ExitOfOneWhoMayNotOpenItsOutput(Fork&& fork_it) {
  const pid_t child = fork_it();
  if (child == 0) {
    constexpr uid_t kNobody = 65534;
    alarm(20);  // ends it where it is held up
    const bool may_not = fchmod(STDOUT_FILENO, 0) == 0 &&
                         (geteuid() != 0 || seteuid(kNobody) == 0) &&
                         open("/proc/self/fd/1", O_WRONLY | O_NOCTTY) == -1;
    SayALot();
    _exit(may_not ? 0 : 1);
  }
  int status = -1;
  EXPECT_EQ(child, waitpid(child, &status, 0));
  return status;
}

TEST(SayLine, AnotherUsersTerminalHoldsNothingUp) {
  int master = -1;
  EXPECT_EQ(0, ExitOfOneWhoMayNotOpenItsOutput(
                   [&] { return forkpty(&master, nullptr, nullptr, nullptr); }));
  const Descriptor reader(master);
  EXPECT_EQ(kSaid, Said(reader));
}

// With no way to write to it without blocking, nothing is said.
TEST(SayLine, AnotherUsersTerminalThatIsNotOnesOwnHoldsNothingUp) {
  int master = -1;
  int slave = -1;
  ASSERT_EQ(0, openpty(&master, &slave, nullptr, nullptr, nullptr));
  const Descriptor reader(master);
  const Descriptor writer(slave);
  const Output output(writer);
  EXPECT_EQ(0, ExitOfOneWhoMayNotOpenItsOutput(fork));
}

TEST(SayLine, AnotherUsersPipeHoldsNothingUp) {
  std::array<int, 2> ends{};
  ASSERT_EQ(0, pipe(ends.data()));
  const Descriptor reader(ends[0]);
  const Descriptor writer(ends[1]);
  const Output output(writer);
  EXPECT_EQ(0, ExitOfOneWhoMayNotOpenItsOutput(fork));
  EXPECT_EQ(kSaid, Said(reader));
}

}  // namespace
}  // namespace pheromone
