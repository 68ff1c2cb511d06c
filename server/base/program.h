// The common part of every main(): control characters in what it prints are escaped
// (standard_output.h), an exception ends the program with a message, and it returns 0 only if all
// of its output was written.
//
//   int main(int argc, char** argv) {
//     return pheromone::RunProgram("pheromonectl", [&] { return Main(argc, argv); });
//   }
//
// Programs return kFailed or kWrongInput by Fail(name, message, status), unless they have more
// kinds of failure.
//
// A full disk is often noticed when the last bytes are flushed, after a command has done its work;
// hence this is checked once, here, and not by each command. If the reader of a pipe exits, such as
// `| head`, SIGPIPE ends the program, as usual. For the main thread, at the end.
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
#include "server/base/standard_output.h"

namespace pheromone {

constexpr int kFailed = 1;      ///< exit status: it could not be done
constexpr int kWrongInput = 2;  ///< exit status: the command line or a file is wrong

/// Prints "NAME: MESSAGE" to standard error, and returns `status`.
inline int Fail(std::string_view name, const std::string& message, int status) {
  std::cerr << name << ": " << message << '\n';
  return status;
}

/// Flushes standard output, of C and of C++. Error: why some output, now or before, could not be
/// written.
inline Status FinishStandardOutput() {
  const bool failed_before = std::ferror(stdout) != 0;
  errno = 0;
  bool taken = std::fflush(stdout) == 0 && std::cout.flush() && !failed_before &&
               std::ferror(Unescaped(stdout)) == 0;
  // A network disk may report only on close that it is full. A copy is closed, since exit handlers
  // still expect the original; there is none if standard output was closed before.
  const int copy = taken ? dup(STDOUT_FILENO) : -1;
  if (copy >= 0) {
    taken = close(copy) == 0;
  }
  if (taken) {
    return Ok();
  }
  // The errno of an earlier failure is lost: one more byte, after output that is truncated anyway,
  // finds it again.
  if (errno == 0 && write(STDOUT_FILENO, "\n", 1) == 1) {
    return Error{"standard output cannot be written: an earlier write failed"};
  }
  return Error{std::string("standard output cannot be written: ") + std::strerror(errno)};
}

/// Runs `main` and returns its exit status; 1 instead of 0, with a message on standard error, if it
/// threw or if its output could not be written.
template <typename Main>
int RunProgram(std::string_view name, const Main& main) {
  EscapeStandardOutput();
  int status = 1;
  try {
    status = main();
  } catch (const std::exception& error) {
    // Printing with fmt throws if it fails: that is reported below, the same for all.
    if (std::ferror(stdout) == 0 && std::ferror(Unescaped(stdout)) == 0) {
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
