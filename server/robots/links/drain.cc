#include "server/robots/links/drain.h"

#include <linux/serial.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <time.h>

#include <algorithm>
#include <cerrno>
#include <chrono>

namespace pheromone::links {
namespace {

// Bytes in the driver's buffer; 0 if it does not tell.
int Buffered(int handle) {
  int bytes = 0;
  return ioctl(handle, TIOCOUTQ, &bytes) == 0 ? bytes : 0;
}

// Whether FIFO and shift register are empty; so it seems if the driver does not tell.
bool IsEmpty(int handle) {
  unsigned status = 0;
  return ioctl(handle, TIOCSERGETLSR, &status) != 0 || (status & TIOCSER_TEMT) != 0;
}

// This thread is there to be blocked.
void Sleep(std::chrono::nanoseconds time) {
  constexpr int64_t kNsPerSecond = 1'000'000'000;
  const timespec duration = {time.count() / kNsPerSecond, time.count() % kNsPerSecond};
  nanosleep(&duration, nullptr);
}

}  // namespace

void Drain(int handle, uint32_t baud) {
  const std::chrono::nanoseconds byte_time{10'000'000'000 / int64_t{baud}};
  int left = Buffered(handle);
  const auto deadline =
      std::chrono::steady_clock::now() + left * byte_time + std::chrono::seconds(1);
  for (; left > 0; left = Buffered(handle)) {
    const auto now = std::chrono::steady_clock::now();
    if (now > deadline) {
      return;  // tcdrain would not return either
    }
    Sleep(std::min<std::chrono::nanoseconds>(left * byte_time, deadline - now));
  }
  while (tcdrain(handle) != 0 && errno == EINTR) {
  }
  while (!IsEmpty(handle) && std::chrono::steady_clock::now() <= deadline) {
    Sleep(byte_time);
  }
}

}  // namespace pheromone::links
