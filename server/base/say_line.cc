#include "server/base/say_line.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdio>

#include "server/base/descriptor.h"
#include "server/base/escape.h"

namespace pheromone {
namespace {

Descriptor OpenWithoutBlocking(const char* path) {
  return Descriptor(open(path, O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
}

bool IsOwnTerminal() {
  return tcgetpgrp(STDOUT_FILENO) != -1;  // fails on any other
}

// What does not block is opened once more: that is a property of what is open, which standard
// output shares with the shell. Another user's, as after sudo -u, cannot be, but for one's own
// terminal. Then a pipe that poll() calls writable has room for a line; a terminal may not.
void WriteWithoutBlocking(const std::string& line) {
  struct stat output {};
  if (fstat(STDOUT_FILENO, &output) != 0) {
    return;
  }
  if (S_ISSOCK(output.st_mode)) {
    (void)send(STDOUT_FILENO, line.data(), line.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    return;
  }
  Descriptor own;
  if (S_ISCHR(output.st_mode) || S_ISFIFO(output.st_mode)) {
    own = OpenWithoutBlocking("/proc/self/fd/1");
    if (!own.valid() && S_ISCHR(output.st_mode)) {
      if (IsOwnTerminal()) {
        own = OpenWithoutBlocking("/dev/tty");
      }
      if (!own.valid()) {
        return;
      }
    }
  }
  pollfd ready = {own.valid() ? own.get() : STDOUT_FILENO, POLLOUT, 0};
  if (poll(&ready, 1, 0) == 1 && (ready.revents & POLLOUT) != 0) {
    [[maybe_unused]] const ssize_t size = write(ready.fd, line.data(), line.size());
  }
}

}  // namespace

void SayLine(int64_t now_ms, const std::string& text) {
  std::array<char, 40> time{};
  std::snprintf(time.data(), time.size(), "%8.1f s  ", static_cast<double>(now_ms) / 1000);
  // Not through stdout, whose owner may block: it escapes what a robot or an address says itself.
  WriteWithoutBlocking(time.data() + EscapeControls(text, "") + '\n');
}

}  // namespace pheromone
