#include "proto_tests/exchange_bench/fed_watchdog.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string_view>

#include "proto_tests/exchange_bench/fail.h"

namespace pheromone::bench {
namespace {

// Of the service 20 s; less is asked for here, to see more.
constexpr std::string_view kWatchdogUsec = "1000000";
constexpr int kTickMs = 50;

}  // namespace

FedWatchdog::FedWatchdog(const std::string& folder) : path_(folder + "/notify") {
  socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path_.data(), std::min(path_.size(), sizeof address.sun_path - 1));
  unlink(path_.c_str());
  if (bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    Fail("cannot bind " + path_);
  }
  thread_ = std::thread([this] { Hear(); });
}

FedWatchdog::~FedWatchdog() {
  stopping_ = true;
  thread_.join();
  close(socket_);
}

Environment FedWatchdog::environment() const {
  return {{"NOTIFY_SOCKET", path_}, {"WATCHDOG_USEC", std::string(kWatchdogUsec)}};
}

std::chrono::milliseconds FedWatchdog::TakeLongest() {
  const Clock::duration since = Clock::now() - last_.load();
  return std::chrono::duration_cast<std::chrono::milliseconds>(
      std::max(longest_.exchange(Clock::duration::zero()), since));
}

void FedWatchdog::Hear() {
  std::array<char, 4096> message{};
  while (!stopping_) {
    pollfd waiting{socket_, POLLIN, 0};
    if (poll(&waiting, 1, kTickMs) != 1) {
      continue;
    }
    const ssize_t size = recv(socket_, message.data(), message.size(), 0);
    const std::string_view text(message.data(), size > 0 ? static_cast<size_t>(size) : 0);
    if (text.find("WATCHDOG=1") != std::string_view::npos) {
      const auto now = Clock::now();
      longest_ = std::max(longest_.load(), now - last_.load());
      last_ = now;
    }
  }
}

}  // namespace pheromone::bench
