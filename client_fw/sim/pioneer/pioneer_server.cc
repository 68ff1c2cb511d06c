#include "client_fw/sim/pioneer/pioneer_server.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <system_error>

namespace pheromone::sim {
namespace {

constexpr std::string_view kPtyFolder = "/dev/pts/";
constexpr size_t kMaxUnsent = 4096;
constexpr int kMaxReads = 16;  // a client that never pauses must not stop the robot's time

std::string SystemError(const std::string& what) {
  return what + ": " + std::strerror(errno);
}

// The target of a symbolic link; empty if it is not one.
std::string TargetOf(const std::string& path) {
  std::error_code error;
  return std::filesystem::read_symlink(path, error).string();
}

std::string MakeRaw(const char* terminal) {
  const int slave = open(terminal, O_RDWR | O_NOCTTY | O_CLOEXEC);
  termios mode{};
  if (slave < 0 || tcgetattr(slave, &mode) != 0) {
    return SystemError(std::string("cannot open ") + terminal);
  }
  cfmakeraw(&mode);
  const bool done = tcsetattr(slave, TCSANOW, &mode) == 0;
  std::string error = done ? "" : SystemError(std::string("cannot set up ") + terminal);
  close(slave);
  return error;
}

// Discards bytes that were written to the terminal and not read. This is done on the slave:
// flushing the master would leave bytes that the kernel has not yet passed on.
void DiscardUnread(const char* terminal) {
  const int slave = open(terminal, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (slave >= 0) {
    tcflush(slave, TCIFLUSH);
    close(slave);
  }
}

std::string MakeLink(const std::string& link, const std::string& target) {
  struct stat found = {};
  if (lstat(link.c_str(), &found) == 0) {
    if (!TargetOf(link).starts_with(kPtyFolder)) {
      return link +
             " exists and is not a link to a pseudo-terminal; remove it or choose another name";
    }
    unlink(link.c_str());
  }
  return symlink(target.c_str(), link.c_str()) == 0 ? "" : SystemError("cannot make " + link);
}

bool WouldBlock() {
  return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
}

}  // namespace

PioneerServer::~PioneerServer() {
  if (!target_.empty() && TargetOf(link_) == target_) {
    unlink(link_.c_str());
  }
  for (const int descriptor : {line_, listener_}) {
    if (descriptor >= 0) {
      close(descriptor);
    }
  }
}

std::string PioneerServer::ServePty(const std::string& link) {
  line_ = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  std::array<char, 64> name{};
  if (line_ < 0 || grantpt(line_) != 0 || unlockpt(line_) != 0 ||
      ptsname_r(line_, name.data(), name.size()) != 0) {
    return SystemError("cannot make a pseudo-terminal");
  }
  // The slave is not kept open, so that we can detect whether there is a client.
  std::string error = MakeRaw(name.data());
  if (error.empty()) {
    error = MakeLink(link, name.data());
  }
  if (error.empty()) {
    link_ = address_ = link;
    target_ = name.data();
  }
  return error;
}

std::string PioneerServer::ServeTcp(uint16_t port) {
  listener_ = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  auto* any_address = reinterpret_cast<sockaddr*>(&address);
  const int yes = 1;
  if (listener_ < 0 || setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) != 0 ||
      bind(listener_, any_address, size) != 0 || listen(listener_, 1) != 0 ||
      getsockname(listener_, any_address, &size) != 0) {
    return SystemError("cannot listen on 127.0.0.1 port " + std::to_string(port));
  }
  address_ = "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  return "";
}

void PioneerServer::Step(int64_t now_ns) {
  Read(now_ns);  // first who has gone, then who comes
  Accept();
  Read(now_ns);
  robot_->AdvanceTo(now_ns);
  Write();
}

void PioneerServer::Accept() {
  if (listener_ < 0) {
    return;
  }
  const int connection = accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (connection < 0) {
    return;
  }
  if (connected_) {
    close(connection);
    return;
  }
  const int yes = 1;
  setsockopt(connection, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  line_ = connection;
  connected_ = true;
}

void PioneerServer::Read(int64_t now_ns) {
  std::array<uint8_t, 512> buffer{};
  for (int i = 0; i < kMaxReads && line_ >= 0; ++i) {
    const ssize_t size = read(line_, buffer.data(), buffer.size());
    if (size > 0) {
      connected_ = true;
      const uint64_t closes = robot_->counters().closes;
      robot_->OnBytes({buffer.data(), static_cast<size_t>(size)}, now_ns);
      if (listener_ >= 0 && robot_->counters().closes != closes) {
        Disconnect();
      }
    } else if (size < 0 && WouldBlock()) {
      connected_ = true;  // of a pty: opened, and nothing to read
      return;
    } else {
      Disconnect();
      return;
    }
  }
}

void PioneerServer::Write() {
  const std::vector<uint8_t> output = robot_->TakeOutput();
  if (!connected_) {
    return;
  }
  if (unsent_.size() + output.size() <= kMaxUnsent) {
    unsent_.insert(unsent_.end(), output.begin(), output.end());
  }
  // Not write: a connection that the client has closed would end the process.
  const ssize_t size = listener_ >= 0 ? send(line_, unsent_.data(), unsent_.size(), MSG_NOSIGNAL)
                                      : write(line_, unsent_.data(), unsent_.size());
  if (size >= 0) {
    unsent_.erase(unsent_.begin(), unsent_.begin() + size);
  } else if (!WouldBlock()) {
    Disconnect();
  }
}

// The pty remains for the next client, without the bytes that this one has not read.
void PioneerServer::Disconnect() {
  if (listener_ >= 0) {
    close(line_);
    line_ = -1;
  } else if (connected_) {
    DiscardUnread(target_.c_str());
  }
  unsent_.clear();
  if (connected_) {
    robot_->HangUp();
  }
  connected_ = false;
}

void PioneerServer::Wait(int timeout_ms) const {
  // A pty without a client is always "ready" to report just that.
  std::array<pollfd, 2> descriptors = {pollfd{listener_, POLLIN, 0},
                                       pollfd{connected_ ? line_ : -1, POLLIN, 0}};
  poll(descriptors.data(), descriptors.size(), timeout_ms);
}

}  // namespace pheromone::sim
