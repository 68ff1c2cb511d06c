#include "server/base/say_line.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdio>

#include "server/base/descriptor.h"
#include "server/base/escape.h"

namespace pheromone {
namespace {

// A terminal or pipe, opened once more so that it does not block. That is a property of what is
// open, which standard output shares with the shell; and a terminal that poll() calls writable may
// still have no room for a whole line.
Descriptor OwnOutput() {
  struct stat output {};
  const bool may_block =
      fstat(STDOUT_FILENO, &output) == 0 && (S_ISCHR(output.st_mode) || S_ISFIFO(output.st_mode));
  return Descriptor(
      may_block ? open("/proc/self/fd/1", O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC) : -1);
}

}  // namespace

void SayLine(int64_t now_ms, const std::string& text) {
  const Descriptor own = OwnOutput();
  pollfd ready = {own.valid() ? own.get() : STDOUT_FILENO, POLLOUT, 0};
  if (poll(&ready, 1, 0) != 1 || (ready.revents & POLLOUT) == 0) {
    return;
  }
  std::array<char, 40> time{};
  std::snprintf(time.data(), time.size(), "%8.1f s  ", static_cast<double>(now_ms) / 1000);
  // Not through stdout, whose owner may block: it escapes what a robot or an address says itself.
  const std::string line = time.data() + EscapeControls(text, "") + '\n';
  [[maybe_unused]] const ssize_t size = write(ready.fd, line.data(), line.size());
}

}  // namespace pheromone
