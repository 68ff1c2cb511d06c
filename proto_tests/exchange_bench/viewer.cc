#include "proto_tests/exchange_bench/viewer.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstring>
#include <string_view>
#include <thread>

namespace pheromone::bench {
namespace {

constexpr std::string_view kRequest =
    "GET /api/v1/field?pheromone=1&nodes_per_cell=16 HTTP/1.1\r\nHost: localhost\r\n"
    "Connection: close\r\n\r\n";
constexpr std::chrono::milliseconds kPeriod{100};

// Whether a whole picture came.
bool Look(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    return false;
  }
  std::memcpy(address.sun_path, path.data(), path.size());
  const int handle = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  std::string answer;
  if (connect(handle, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
      write(handle, kRequest.data(), kRequest.size()) == static_cast<ssize_t>(kRequest.size())) {
    std::array<char, 65536> some{};
    for (ssize_t size = 0; (size = read(handle, some.data(), some.size())) > 0;) {
      answer.append(some.data(), static_cast<size_t>(size));
    }
  }
  close(handle);
  return answer.rfind("HTTP/1.1 200", 0) == 0;
}

}  // namespace

Viewer::Viewer(const std::string& folder) {
  void* const shared =
      mmap(nullptr, sizeof(int), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  pictures_ = static_cast<volatile int*>(shared);
  process_ = fork();
  if (process_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    for (auto next = std::chrono::steady_clock::now();; next += kPeriod) {
      std::this_thread::sleep_until(next);
      *pictures_ = *pictures_ + (Look(folder + "/pheromoned.sock") ? 1 : 0);
    }
  }
}

Viewer::~Viewer() {
  kill(process_, SIGTERM);
  waitpid(process_, nullptr, 0);
  munmap(const_cast<int*>(pictures_), sizeof(int));
}

}  // namespace pheromone::bench
