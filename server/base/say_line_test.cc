#include "server/base/say_line.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <pty.h>
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

// The first characters of many more lines than fit.
std::string SaidWithoutAReader(const Descriptor& reader, const Descriptor& writer) {
  const Output output(writer);
  for (size_t i = 0; i < 10'000; ++i) {
    SayLine(1500, "something happened, and then something else" + std::string(i % 64, '.'));
  }
  EXPECT_EQ(0, fcntl(STDOUT_FILENO, F_GETFL) & O_NONBLOCK);  // which it shares with others
  std::array<char, 51> buffer{};
  const ssize_t size = read(reader.get(), buffer.data(), buffer.size());
  return {buffer.data(), static_cast<size_t>(size)};
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

}  // namespace
}  // namespace pheromone
