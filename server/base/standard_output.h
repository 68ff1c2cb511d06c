// Standard output and standard error with the control characters of what is printed escaped:
// whatever a program prints, and whether by printf, fmt or streams, comes out of one place.
// RunProgram (program.h) does it for all programs.
//
//   EscapeStandardOutput();
//   fmt::print("tag {}\n", name);                          // a name with "\x1b[2J" clears nothing
//   fmt::print(Unescaped(stderr), "\r{} of {}", i, all);    // but the program's own sequences work
//
// For the main thread, before others; printing is then as thread-safe as before.
#pragma once

#include <cstdio>

namespace pheromone {

/// From now on all that is printed to `stdout`, `stderr`, std::cout, std::cerr and std::clog goes
/// through EscapeControls (escape.h), except for newlines. A second call does nothing. What is
/// written to the descriptors directly, or by a process that is started, does not.
void EscapeStandardOutput();

/// `stream`, which is `stdout` or `stderr`, without that, not buffered; what was printed to
/// `stream` before is flushed. Only for control sequences of the program and text that is known.
std::FILE* Unescaped(std::FILE* stream);

}  // namespace pheromone
