#include "server/base/standard_output.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <iostream>

namespace pheromone {
namespace {

using ::testing::ExitedWithCode;

// In a separate process; standard error is what a death test sees.
[[noreturn]] void End() {
  std::fflush(stdout);
  std::cout.flush();
  std::_Exit(0);
}

TEST(StandardOutputDeathTest, WhateverPrintsIsEscaped) {
  EXPECT_EXIT(
      {
        EscapeStandardOutput();
        std::fprintf(stderr, "%s\n", "\x1b[2J");
        std::fputs(
            "\x1b"
            "1\n",
            stderr);
        std::cerr << "\x1b" << '\x07' << 2 << '\n';
        std::clog << "\xc2\x9b"
                     "3"
                  << std::endl;
        End();
      },
      ExitedWithCode(0), R"(^\\u001b\[2J
\\u001b1
\\u001b\\u00072
\\u009b3
$)");
}

TEST(StandardOutputDeathTest, StandardOutputTooInItsOrder) {
  EXPECT_EXIT(
      {
        dup2(STDERR_FILENO, STDOUT_FILENO);
        EscapeStandardOutput();
        std::printf(
            "\x1b"
            "1 ");
        std::cout << "\x1b"
                     "2 ";
        std::putchar('\x1b');
        std::puts("3");
        End();
      },
      ExitedWithCode(0), R"(^\\u001b1 \\u001b2 \\u001b3
$)");
}

TEST(StandardOutputDeathTest, TheProgramsOwnSequencesPassInTheirOrder) {
  EXPECT_EXIT(
      {
        dup2(STDERR_FILENO, STDOUT_FILENO);
        EscapeStandardOutput();
        EscapeStandardOutput();
        std::printf("\ra ");
        std::fputs("\rb ", Unescaped(stdout));
        std::cout << "\rc ";
        std::fputs("\rd\n", Unescaped(stdout));
        std::fputs("\re\n", Unescaped(stderr));
        End();
      },
      ExitedWithCode(0), "^\\\\u000da \rb \\\\u000dc \rd\n\re\n$");
}

TEST(StandardOutputDeathTest, ACharacterThatComesInPartsIsOne) {
  EXPECT_EXIT(
      {
        EscapeStandardOutput();
        for (const char byte : {'\xc3', '\xbc', '\xe2', '\x80', '\xae', '\xe2', '\x80', '\n'}) {
          std::cerr << byte;
        }
        End();
      },
      ExitedWithCode(0), "^\xc3\xbc\\\\u202e\\\\ufffd\n$");
}

TEST(StandardOutputTest, WithoutEscapingAStreamIsItself) {
  EXPECT_EQ(Unescaped(stderr), stderr);
}

}  // namespace
}  // namespace pheromone
