// What the main() of every program has in common: an exception ends it with words, and it does not
// end with 0 unless all that it printed was taken.
//
//   int main(int argc, char** argv) {
//     return pheromone::RunProgram("pheromonectl", [&] { return Main(argc, argv); });
//   }
//
// A full disk is often noticed when the last bytes go out, after a command has done its work; hence
// it is looked at once, here, and no command does it for itself. Who goes away at the other end of
// a pipe (`| head`) ends a program by SIGPIPE, as usual. For the main thread, at the end.
#pragma once

#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <iostream>
#include <string>
#include <string_view>

#include "server/base/result.h"

namespace pheromone {

/// Writes out what standard output holds, of C and of C++. Error: something that was printed, now
/// or before, was not taken, and why.
inline Status FinishStandardOutput() {
  const bool failed_before = std::ferror(stdout) != 0;
  errno = 0;
  bool taken = std::fflush(stdout) == 0 && std::cout.flush() && !failed_before;
  // A disk on the network may say only at the closing that it is full. A copy is closed, since what
  // runs at exit still expects the original; there is none if standard output was closed before.
  const int copy = taken ? dup(STDOUT_FILENO) : -1;
  if (copy >= 0) {
    taken = close(copy) == 0;
  }
  if (taken) {
    return Ok();
  }
  // Of a write that failed before, the reason is gone: one more byte behind what is cut off anyway
  // finds it again.
  if (errno == 0 && write(STDOUT_FILENO, "\n", 1) == 1) {
    return Error{"standard output cannot be written: an earlier write failed"};
  }
  return Error{std::string("standard output cannot be written: ") + std::strerror(errno)};
}

/// Runs `main`, which returns an exit status, and returns it; 1 instead of 0, having told why on
/// standard error, if it threw or if what it printed was not taken.
template <typename Main>
int RunProgram(std::string_view name, const Main& main) {
  int status = 1;
  try {
    status = main();
  } catch (const std::exception& error) {
    // Printing with fmt throws if it fails: that is told below, in the same words for all.
    if (std::ferror(stdout) == 0) {
      std::cerr << name << ": " << error.what() << '\n';
    }
  }
  const Status finished = FinishStandardOutput();
  if (!finished.ok()) {
    std::cerr << name << ": " << finished.error() << '\n';
  }
  return finished.ok() || status != 0 ? status : 1;
}

}  // namespace pheromone
