#include "proto_tests/qemu/qemu_machine.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace pheromone::conformance {
namespace {

std::runtime_error SystemError(const std::string& what) {
  return std::runtime_error(what + ": " + std::strerror(errno));
}

// In the child, where nothing may allocate: all strings are made before the fork.
[[noreturn]] void Become(const std::string& folder, const std::vector<std::string>& arguments,
                         const std::vector<char*>& pointers) {
  if (!folder.empty() && chdir(folder.c_str()) != 0) {
    _exit(127);
  }
  execv(arguments[0].c_str(), pointers.data());
  _exit(127);
}

}  // namespace

QemuMachine::QemuMachine(const std::string& qemu, const std::string& image,
                         const std::string& folder) {
  std::vector<std::string> arguments = {qemu,       "-M",   "mps2-an385", "-display", "none",
                                        "-monitor", "none", "-kernel",    image};
  if (!folder.empty()) {
    arguments.insert(arguments.end(), {"-semihosting-config", "enable=on,target=native"});
  }
  std::array<int, kUarts> theirs{};
  for (size_t i = 0; i < kUarts; ++i) {
    std::array<int, 2> ends{};
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()) != 0) {
      throw SystemError("socketpair");
    }
    lines_[i].socket = ends[0];
    theirs[i] = ends[1];
    fcntl(ends[0], F_SETFD, FD_CLOEXEC);
    fcntl(ends[0], F_SETFL, O_NONBLOCK);
    const std::string name = "uart" + std::to_string(i);
    arguments.insert(arguments.end(),
                     {"-chardev", "socket,id=" + name + ",fd=" + std::to_string(ends[1]), "-serial",
                      "chardev:" + name});
  }
  std::vector<char*> pointers;
  pointers.reserve(arguments.size() + 1);
  for (std::string& argument : arguments) {
    pointers.push_back(argument.data());
  }
  pointers.push_back(nullptr);
  process_ = fork();
  if (process_ == 0) {
    Become(folder, arguments, pointers);
  }
  for (const int end : theirs) {
    close(end);
  }
  if (process_ < 0) {
    throw SystemError("fork");
  }
}

QemuMachine::~QemuMachine() {
  for (const Line& line : lines_) {
    close(line.socket);
  }
  kill(process_, SIGKILL);
  waitpid(process_, nullptr, 0);
}

void QemuMachine::Send(const size_t uart, const std::vector<uint8_t>& bytes) {
  std::deque<uint8_t>& queue = lines_.at(uart).to_machine;
  queue.insert(queue.end(), bytes.begin(), bytes.end());
}

uint8_t QemuMachine::Receive(const size_t uart) {
  std::deque<uint8_t>& queue = lines_.at(uart).from_machine;
  while (queue.empty()) {
    Move();
  }
  const uint8_t byte = queue.front();
  queue.pop_front();
  return byte;
}

void QemuMachine::Move() {
  std::array<pollfd, kUarts> polled{};
  for (size_t i = 0; i < kUarts; ++i) {
    polled[i].fd = lines_[i].socket;
    polled[i].events = POLLIN;
    if (!lines_[i].to_machine.empty()) {
      polled[i].events |= POLLOUT;
    }
  }
  const int ready = poll(polled.data(), polled.size(), kPatienceMs);
  if (ready < 0 && errno == EINTR) {
    return;
  }
  if (ready < 0) {
    throw SystemError("poll");
  }
  if (ready == 0) {
    throw std::runtime_error("QEMU does not answer");
  }
  for (size_t i = 0; i < kUarts; ++i) {
    Line& line = lines_[i];
    if ((polled[i].revents & POLLOUT) != 0) {
      std::array<uint8_t, 256> bytes{};
      const size_t size = std::min(bytes.size(), line.to_machine.size());
      std::copy_n(line.to_machine.begin(), size, bytes.begin());
      const ssize_t sent = send(line.socket, bytes.data(), size, MSG_NOSIGNAL);
      if (sent > 0) {
        line.to_machine.erase(line.to_machine.begin(), line.to_machine.begin() + sent);
      }
    }
    if ((polled[i].revents & (POLLIN | POLLHUP | POLLERR)) != 0) {
      std::array<uint8_t, 4096> bytes{};
      const ssize_t size = recv(line.socket, bytes.data(), bytes.size(), 0);
      if (size == 0 || (size < 0 && errno != EAGAIN && errno != EINTR)) {
        throw std::runtime_error("QEMU ended; does it know the machine mps2-an385?");
      }
      line.from_machine.insert(line.from_machine.end(), bytes.begin(),
                               bytes.begin() + std::max<ssize_t>(size, 0));
    }
  }
}

}  // namespace pheromone::conformance
