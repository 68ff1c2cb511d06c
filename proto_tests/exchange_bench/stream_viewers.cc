#include "proto_tests/exchange_bench/stream_viewers.h"

#include <fmt/format.h>
#include <poll.h>
#include <sched.h>
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
#include <new>
#include <string_view>
#include <thread>
#include <vector>

namespace pheromone::bench {
namespace {

constexpr int kMaxChannels = 60;  // at least as many as there are
constexpr std::string_view kHandshake =
    "GET / HTTP/1.1\r\nHost: localhost\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
    "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
    "Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n\r\n";

// A WebSocket frame with a text of 126 to 65535 bytes, with the mask 0.
std::string Subscription() {
  std::string list;
  for (int channel = 1; channel <= kMaxChannels; ++channel) {
    list +=
        fmt::format("{}{{\"id\":{},\"channelId\":{}}}", list.empty() ? "" : ",", channel, channel);
  }
  const std::string text = "{\"op\":\"subscribe\",\"subscriptions\":[" + list + "]}";
  std::string frame = "\x81\xfe";
  frame += static_cast<char>(text.size() >> 8);
  frame += static_cast<char>(text.size());
  return frame + std::string(4, '\0') + text;
}

int Connect(const std::string& path) {
  const int descriptor = socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  if (connect(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      write(descriptor, kHandshake.data(), kHandshake.size()) < 0) {
    close(descriptor);
    return -1;
  }
  // The answer's header; what follows it is thrown away too.
  std::array<char, 4096> answer{};
  if (read(descriptor, answer.data(), answer.size()) <= 0) {
    close(descriptor);
    return -1;
  }
  const std::string subscription = Subscription();
  if (write(descriptor, subscription.data(), subscription.size()) < 0) {
    close(descriptor);
    return -1;
  }
  return descriptor;
}

[[noreturn]] void Watch(const std::string& path, int count, int deaf,
                        StreamViewers::Counts* counts) {
  constexpr int kPatienceMs = 100;
  static std::array<char, 1 << 18> bytes;
  std::vector<pollfd> sockets(static_cast<size_t>(count), pollfd{-1, 0, 0});
  while (true) {
    for (size_t i = 0; i < sockets.size(); ++i) {
      if (sockets[i].fd < 0) {
        const short events = i < static_cast<size_t>(deaf) ? short{0} : short{POLLIN};
        sockets[i] = {Connect(path), events, 0};
        counts->connections += sockets[i].fd >= 0 ? 1 : 0;
      }
    }
    poll(sockets.data(), sockets.size(), kPatienceMs);
    for (pollfd& it : sockets) {
      const bool is_readable = (it.revents & POLLIN) != 0;
      const ssize_t size = is_readable ? read(it.fd, bytes.data(), bytes.size()) : 0;
      if (size > 0) {
        counts->bytes += static_cast<uint64_t>(size);
      } else if (it.fd >= 0 && (is_readable || (it.revents & (POLLHUP | POLLERR)) != 0)) {
        close(it.fd);
        it.fd = -1;
      }
    }
  }
}

}  // namespace

StreamViewers::StreamViewers(const std::string& folder, int count, int deaf) : count_(count) {
  void* const shared =
      mmap(nullptr, sizeof(Counts), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  counts_ = new (shared) Counts;
  process_ = fork();
  if (process_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    const sched_param none{};
    sched_setscheduler(0, SCHED_IDLE, &none);
    Watch(folder + "/pheromoned.sock", count, deaf, counts_);
  }
}

void StreamViewers::AwaitFirst() const {
  constexpr std::chrono::milliseconds kLook{10};
  constexpr std::chrono::seconds kFirst{1};
  while (counts_->connections < static_cast<uint64_t>(count_) || counts_->bytes == 0) {
    std::this_thread::sleep_for(kLook);
  }
  std::this_thread::sleep_for(kFirst);
}

StreamViewers::~StreamViewers() {
  kill(process_, SIGTERM);
  waitpid(process_, nullptr, 0);
  munmap(counts_, sizeof(Counts));
}

}  // namespace pheromone::bench
