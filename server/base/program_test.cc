#include "server/base/program.h"

#include <gtest/gtest.h>

#include <csignal>
#include <stdexcept>

namespace pheromone {
namespace {

using ::testing::ExitedWithCode;
using ::testing::KilledBySignal;

// In a separate process, with standard output redirected.
void RunInto(const char* path, int status, size_t bytes, bool with_cout) {
  if (std::freopen(path, "w", stdout) == nullptr) {
    std::_Exit(99);
  }
  std::_Exit(RunProgram("tool", [&] {
    for (size_t i = 0; i < bytes; ++i) {
      with_cout ? static_cast<void>(std::cout << 'x') : static_cast<void>(std::putchar('x'));
    }
    return status;
  }));
}

constexpr const char* kFull =
    "^tool: standard output cannot be written: No space left on device\n$";

TEST(ProgramDeathTest, OutputThatIsTakenLeavesTheStatusAlone) {
  EXPECT_EXIT(RunInto("/dev/null", 0, 10, true), ExitedWithCode(0), "^$");
  EXPECT_EXIT(RunInto("/dev/null", 4, 10, false), ExitedWithCode(4), "^$");
}

TEST(ProgramDeathTest, OutputThatIsNotTakenIsToldAndNoSuccess) {
  for (const bool with_cout : {false, true}) {
    EXPECT_EXIT(RunInto("/dev/full", 0, 1, with_cout), ExitedWithCode(1), kFull);
    EXPECT_EXIT(RunInto("/dev/full", 0, 1 << 20, with_cout), ExitedWithCode(1), kFull);
  }
}

TEST(ProgramDeathTest, WhatFailedAtAnEarlierFlushIsToldAtTheEnd) {
  EXPECT_EXIT(
      {
        if (std::freopen("/dev/full", "w", stdout) == nullptr) {
          std::_Exit(99);
        }
        std::_Exit(RunProgram("tool", [] {
          std::cout << "1.0" << std::endl;
          return 0;
        }));
      },
      ExitedWithCode(1), kFull);
}

TEST(ProgramDeathTest, AFailureKeepsItsOwnStatus) {
  EXPECT_EXIT(RunInto("/dev/full", 4, 1, false), ExitedWithCode(4), kFull);
}

TEST(ProgramDeathTest, WhoPrintsNothingNeedsNoOutput) {
  EXPECT_EXIT(RunInto("/dev/full", 0, 0, true), ExitedWithCode(0), "^$");
  EXPECT_EXIT(
      {
        close(STDOUT_FILENO);
        std::_Exit(RunProgram("tool", [] { return 0; }));
      },
      ExitedWithCode(0), "^$");
}

TEST(ProgramDeathTest, AnExceptionIsToldAndEndsWith1) {
  EXPECT_EXIT(
      std::_Exit(RunProgram("tool", []() -> int { throw std::runtime_error("out of luck"); })),
      ExitedWithCode(1), "^tool: out of luck\n$");
}

TEST(ProgramDeathTest, AReaderThatWentAwayEndsItQuietly) {
  EXPECT_EXIT(
      {
        int ends[2];
        std::signal(SIGPIPE, SIG_DFL);
        if (pipe(ends) != 0 || dup2(ends[1], STDOUT_FILENO) < 0 || close(ends[0]) != 0) {
          std::_Exit(99);
        }
        RunProgram("tool", [] { return std::putchar('x') == 'x' ? 0 : 1; });
      },
      KilledBySignal(SIGPIPE), "^$");
}

}  // namespace
}  // namespace pheromone
