#include "client_fw/attach/connection.h"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include "client_fw/attach/adapter.h"
#include "server/base/terminal.h"

namespace pheromone::attach {
namespace {

constexpr std::array<uint32_t, 13> kBauds = {
    300, 600, 1200, 2400, 4800, 9600, 19'200, 38'400, 57'600, 115'200, 230'400, 460'800, 921'600};

bool WouldBlock() {
  return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
}

bool IsPseudoTerminal(const std::string& path) {
  std::error_code error;
  return std::filesystem::canonical(path, error).string().starts_with("/dev/pts/");
}

// The system would take a small number for its own code of a rate.
bool SetSpeed(uint32_t rate, termios* mode) {
  return std::find(kBauds.begin(), kBauds.end(), rate) != kBauds.end() &&
         cfsetspeed(mode, rate) == 0;
}

std::string SystemMessage(int error) {
  return std::generic_category().message(error);
}

}  // namespace

std::span<const uint32_t> SerialRates() {
  return kBauds;
}

Connection::Connection(Address address) : address_(std::move(address)) {}

short Connection::poll_events() const {
  return connecting_ ? POLLOUT : POLLIN;
}

void Connection::Advance(int64_t now_ms) {
  if (!descriptor_.valid()) {
    if (now_ms >= next_try_ms_) {
      Open(now_ms);
    }
  } else if (connecting_) {
    FinishConnect(now_ms);
  } else if (address_.kind != Address::Kind::kSerial && now_ms - since_ms_ >= kSilentMs) {
    Lose("nothing received for " + std::to_string(kSilentMs / 1000) + " s", now_ms);
    doubtful_ = true;
  }
}

void Connection::Open(int64_t now_ms) {
  since_ms_ = now_ms;
  const Status opened = address_.kind == Address::Kind::kSerial ? OpenSerial() : OpenSocket();
  if (!opened.ok()) {
    Refuse(opened.error(), now_ms);
  }
}

void Connection::MoveTo(const Address& address, int64_t now_ms) {
  Close();
  address_ = address;
  trouble_.clear();
  doubtful_ = false;
  next_try_ms_ = now_ms;
}

Status Connection::OpenSerial() {
  OpenedTerminal opened = OpenTerminal(address_.text);
  in_use_ = opened.in_use;
  PHEROMONE_TRY_STATUS(opened.status);
  descriptor_ = std::move(opened.descriptor);
  termios mode = {};
  tcgetattr(descriptor_.get(), &mode);
  cfmakeraw(&mode);
  mode.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
  mode.c_cflag |= CLOCAL | CREAD;
  mode.c_cc[VMIN] = 1;  // with 0, an idle line would look like a lost one
  mode.c_cc[VTIME] = 0;
  if (!SetSpeed(address_.baud, &mode) || tcsetattr(descriptor_.get(), TCSANOW, &mode) != 0) {
    return Error{"cannot be set to " + std::to_string(address_.baud) + " baud"};
  }
  tcflush(descriptor_.get(), TCIOFLUSH);
  AskForLowLatency(descriptor_.get());  // an adapter that was unplugged has forgotten it
  paced_ = address_.paced || !IsPseudoTerminal(address_.text);
  ++openings_;
  return Ok();
}

bool Connection::SetBaud(uint32_t baud) {
  termios mode = {};
  address_.baud = baud;
  return tcgetattr(descriptor_.get(), &mode) == 0 && SetSpeed(baud, &mode) &&
         tcsetattr(descriptor_.get(), TCSAFLUSH, &mode) == 0;
}

Status Connection::OpenSocket() {
  const bool tcp = address_.kind == Address::Kind::kTcp;
  paced_ = tcp && address_.paced;
  const int family = address_.socket.ss_family;
  descriptor_ = Descriptor(
      socket(family, (tcp ? SOCK_STREAM : SOCK_DGRAM) | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!descriptor_.valid()) {
    return Error{SystemMessage(errno)};
  }
  if (tcp) {
    const int yes = 1;
    setsockopt(descriptor_.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  }
  if (connect(descriptor_.get(), reinterpret_cast<const sockaddr*>(&address_.socket),
              address_.socket_size) != 0) {
    if (errno != EINPROGRESS) {
      return Error{SystemMessage(errno)};
    }
    connecting_ = true;
  } else {
    ++openings_;
  }
  return Ok();
}

void Connection::FinishConnect(int64_t now_ms) {
  pollfd ready = {descriptor_.get(), POLLOUT, 0};
  int error = 0;
  socklen_t size = sizeof error;
  if (poll(&ready, 1, 0) == 1) {
    getsockopt(descriptor_.get(), SOL_SOCKET, SO_ERROR, &error, &size);
    connecting_ = false;
    since_ms_ = now_ms;
  } else if (now_ms - since_ms_ >= kConnectMs) {
    error = ETIMEDOUT;
  }
  if (error != 0) {
    Refuse(SystemMessage(error), now_ms);
  } else if (!connecting_) {
    ++openings_;
  }
}

std::span<const uint8_t> Connection::Read(int64_t now_ms) {
  if (!descriptor_.valid() || connecting_) {
    return {};
  }
  const ssize_t size = read(descriptor_.get(), buffer_.data(), buffer_.size());
  if (size > 0) {
    since_ms_ = now_ms;
    doubtful_ = false;
    return {buffer_.data(), static_cast<size_t>(size)};
  }
  if (address_.kind == Address::Kind::kUdp) {
    refusals_ += size < 0 && !WouldBlock() ? 1u : 0u;
  } else if (size == 0 || !WouldBlock()) {
    Lose(size == 0 ? "closed by the other side" : SystemMessage(errno), now_ms);
  }
  return {};
}

void Connection::Write(std::span<const uint8_t> bytes, int64_t now_ms) {
  if (!descriptor_.valid() || connecting_ || bytes.empty()) {
    return;
  }
  const bool serial = address_.kind == Address::Kind::kSerial;
  const ssize_t size = serial ? write(descriptor_.get(), bytes.data(), bytes.size())
                              : send(descriptor_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
  if (size < 0 && !WouldBlock()) {
    if (address_.kind == Address::Kind::kUdp) {
      ++refusals_;
    } else {
      Lose(SystemMessage(errno), now_ms);
    }
  } else if (paced_) {
    const auto airtime_ms = static_cast<int64_t>(10'000 * bytes.size() / address_.baud + 1);
    drained_ms_ = std::max(drained_ms_, now_ms) + airtime_ms;
  }
}

bool Connection::drained(int64_t now_ms) const {
  int unsent = 0;
  return !paced_ || !descriptor_.valid() ||
         (now_ms >= drained_ms_ &&
          (address_.kind != Address::Kind::kSerial ||
           ioctl(descriptor_.get(), TIOCOUTQ, &unsent) != 0 || unsent == 0));
}

void Connection::Lose(const std::string& why, int64_t now_ms) {
  Refuse(why, now_ms);
  losses_ += doubtful_ ? 0 : 1;
  doubtful_ = false;
}

void Connection::Refuse(const std::string& why, int64_t now_ms) {
  Close();
  trouble_ = why;
  ++refusals_;
  next_try_ms_ = now_ms + kRetryMs;
}

void Connection::Close() {
  if (address_.kind == Address::Kind::kTcp && descriptor_.valid()) {
    // What was not sent yet is forgotten: old speeds must not reach the robot later.
    const linger forget = {1, 0};
    setsockopt(descriptor_.get(), SOL_SOCKET, SO_LINGER, &forget, sizeof forget);
  }
  if (address_.kind == Address::Kind::kSerial && descriptor_.valid()) {
    tcflush(descriptor_.get(), TCOFLUSH);  // otherwise closing may wait for a dead device
  }
  descriptor_ = Descriptor();
  connecting_ = false;
}

}  // namespace pheromone::attach
