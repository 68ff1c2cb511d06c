// pheromonectl replay FILE --to ...: sends the robots' side of a recording to a server, unchanged.

#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <iostream>
#include <map>
#include <optional>
#include <utility>

#include "server/base/descriptor.h"
#include "server/base/terminal.h"
#include "server/operators/ctl/map_commands.h"
#include "server/operators/ctl/replay_commands.h"
#include "server/store/capture/reader.h"

namespace pheromone::ctl {
namespace {

using Clock = std::chrono::steady_clock;

// How long to wait for the last answers.
constexpr std::chrono::milliseconds kLastAnswers{200};

Result<Descriptor> OpenRaw(const std::string& path) {
  OpenedTerminal opened = OpenTerminal(path);
  if (!opened.status.ok()) {
    return Error{path + ": " + opened.status.error()};
  }
  termios settings{};
  tcgetattr(opened.descriptor.get(), &settings);
  cfmakeraw(&settings);
  if (tcsetattr(opened.descriptor.get(), TCSANOW, &settings) != 0) {
    return SystemError(path);
  }
  return std::move(opened.descriptor);
}

Result<Descriptor> Connect(const std::string& to) {
  const size_t colon = to.rfind(':');
  std::string host = to.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  }
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int failed = getaddrinfo(host.c_str(), to.c_str() + colon + 1, &hints, &found);
  if (failed != 0) {
    return Error{to + ": " + gai_strerror(failed)};
  }
  Error error{to + ": not found"};
  for (const addrinfo* it = found; it != nullptr; it = it->ai_next) {
    Descriptor candidate(socket(it->ai_family, it->ai_socktype | SOCK_CLOEXEC, it->ai_protocol));
    if (candidate.valid() && connect(candidate.get(), it->ai_addr, it->ai_addrlen) == 0) {
      freeaddrinfo(found);
      fcntl(candidate.get(), F_SETFL, O_NONBLOCK);
      return candidate;
    }
    const bool refused = errno == ECONNREFUSED;
    error = SystemError(to);
    if (refused) {
      error += "; HOST:PORT must be a TCP link, UDP is not supported";
    }
  }
  freeaddrinfo(found);
  return error;
}

// The open lines, by recorded link and connection.
class Player {
 public:
  explicit Player(PlayOptions options) : options_(std::move(options)) {
    const size_t slash = options_.to.find('/');
    is_terminal_ = slash != std::string::npos || options_.to.find(':') == std::string::npos;
  }

  Status Send(const capture::Packet& packet) {
    const Key key = is_terminal_ ? Key(0, 0) : Key(packet.link, packet.connection);
    if (!lines_.contains(key)) {
      PHEROMONE_TRY(Descriptor opened, is_terminal_ ? OpenRaw(options_.to) : Connect(options_.to));
      lines_[key] = std::move(opened);
    }
    if (!first_ns_) {
      first_ns_ = packet.utc_ns;
      begin_ = Clock::now();
    }
    if (options_.speed > 0 && packet.utc_ns > *first_ns_) {
      const double wait_ns = static_cast<double>(packet.utc_ns - *first_ns_) / options_.speed;
      ReadUntil(begin_ + std::chrono::nanoseconds(static_cast<int64_t>(wait_ns)));
    }
    sent_ += packet.bytes.size();
    return SendAll(lines_[key].get(), packet.bytes);
  }

  void Finish() { ReadUntil(Clock::now() + kLastAnswers); }

  uint64_t sent() const { return sent_; }
  uint64_t received() const { return received_; }

 private:
  using Key = std::pair<engine::LinkIndex, uint32_t>;

  Status SendAll(int descriptor, std::string_view bytes) {
    while (!bytes.empty()) {
      const ssize_t size = write(descriptor, bytes.data(), bytes.size());
      if (size < 0 && errno != EAGAIN && errno != EINTR) {
        return SystemError(options_.to);
      }
      if (size < 0) {
        ReadUntil(Clock::now() + std::chrono::milliseconds(1));  // what is full may be our own side
        continue;
      }
      bytes.remove_prefix(static_cast<size_t>(size));
    }
    return Ok();
  }

  // Reads the answers, so that no buffer fills up.
  void ReadUntil(Clock::time_point end) {
    std::vector<pollfd> polled;
    polled.reserve(lines_.size());
    for (const auto& [key, descriptor] : lines_) {
      polled.push_back({descriptor.get(), POLLIN, 0});
    }
    while (true) {
      const auto left =
          std::chrono::duration_cast<std::chrono::nanoseconds>(end - Clock::now()).count();
      const timespec wait{std::max<int64_t>(left, 0) / 1'000'000'000,
                          std::max<int64_t>(left, 0) % 1'000'000'000};
      if (ppoll(polled.data(), polled.size(), &wait, nullptr) <= 0 && left <= 0) {
        return;
      }
      for (pollfd& one : polled) {
        std::array<char, 4096> buffer{};
        if (one.revents == 0) {
          continue;
        }
        const ssize_t size = read(one.fd, buffer.data(), buffer.size());
        received_ += size > 0 ? static_cast<uint64_t>(size) : 0;
        if (size == 0 || (size < 0 && errno != EAGAIN && errno != EINTR)) {
          one.fd = -1;  // the other side hung up: poll skips it, and writing will say so
        }
      }
      if (left <= 0) {
        return;
      }
    }
  }

  const PlayOptions options_;
  bool is_terminal_ = false;
  std::map<Key, Descriptor> lines_;
  std::optional<uint64_t> first_ns_;
  Clock::time_point begin_;
  uint64_t sent_ = 0;
  uint64_t received_ = 0;
};

// The requested link, or empty for all of them.
Result<std::optional<engine::LinkIndex>> FindLink(const capture::Start& start,
                                                  const std::string& name) {
  std::string names;
  for (size_t i = 0; i < start.links.size(); ++i) {
    if (start.links[i].name == name) {
      return std::optional(static_cast<engine::LinkIndex>(i));
    }
    names += (names.empty() ? "" : ", ") + start.links[i].name;
  }
  return name.empty() ? Result<std::optional<engine::LinkIndex>>(std::nullopt)
                      : Error{"unknown link " + name + ", expected one of " + names};
}

}  // namespace

int PlayFile(const std::string& file, const PlayOptions& options) {
  std::signal(SIGPIPE, SIG_IGN);  // writing to who hung up is an error value here
  Result<ByteReader::Source> source = capture::OpenFile(file);
  if (!source.ok()) {
    return Fail(kFailed, source.error());
  }
  capture::CaptureReader reader(std::move(source).value(), file);
  Player player(options);
  std::optional<engine::LinkIndex> only;
  while (true) {
    Result<std::optional<capture::Found>> next = reader.Next();
    if (!next.ok()) {
      return Fail(kFailed, next.error());
    }
    if (!next.value()) {
      break;
    }
    const capture::Record& record = next.value()->record;
    if (const auto* start = std::get_if<capture::Start>(&record)) {
      Result<std::optional<engine::LinkIndex>> link = FindLink(*start, options.link);
      if (!link.ok()) {
        return Fail(kUsage, "--link: " + link.error());
      }
      only = link.value();
    }
    const auto* packet = std::get_if<capture::Packet>(&record);
    if (packet == nullptr || packet->direction != capture::Direction::kFromRobots ||
        (only && packet->link != *only)) {
      continue;
    }
    const Status sent = player.Send(*packet);
    if (!sent.ok()) {
      return Fail(kFailed, sent.error());
    }
  }
  player.Finish();
  std::signal(SIGPIPE, SIG_DFL);  // for standard output
  std::cout << file << ": sent " << player.sent() << " bytes, received " << player.received()
            << '\n';
  return 0;
}

}  // namespace pheromone::ctl
