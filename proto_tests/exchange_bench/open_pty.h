// A terminal of the server's, as a robot opens it.
#pragma once

#include <fcntl.h>
#include <termios.h>

#include <string>

#include "proto_tests/exchange_bench/fail.h"

namespace pheromone::bench {

/// A descriptor that does not block, with nothing of what was sent before. Ends this process if it
/// cannot be opened.
inline int OpenPty(const std::string& path) {
  const int handle = open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  termios mode{};
  if (handle < 0 || tcgetattr(handle, &mode) != 0) {
    Fail("cannot open " + path);
  }
  cfmakeraw(&mode);
  tcsetattr(handle, TCSANOW, &mode);
  tcflush(handle, TCIFLUSH);
  return handle;
}

}  // namespace pheromone::bench
