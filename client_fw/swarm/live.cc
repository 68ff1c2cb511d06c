#include "client_fw/swarm/live.h"

#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <deque>
#include <utility>

namespace pheromone::swarm {
namespace {

constexpr int64_t kNsPerMs = 1'000'000;
constexpr int64_t kReopenNs = 500 * kNsPerMs;
constexpr int64_t kShowMs = 200;

int64_t MonotonicNs() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

}  // namespace

PortModem::PortModem(std::string device, sim::RadioMedium* medium)
    : device_(std::move(device)), medium_(medium), number_(medium->AddStation(this)) {}

PortModem::~PortModem() {
  Close();
}

Status PortModem::Open() {
  const int descriptor = open(device_.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) {
    return Error{device_ + ": " + std::strerror(errno)};
  }
  termios settings{};
  if (tcgetattr(descriptor, &settings) != 0) {
    const int error = errno;
    close(descriptor);
    return Error{device_ + ": not a terminal device (" + std::strerror(error) + ")"};
  }
  cfmakeraw(&settings);
  settings.c_cc[VMIN] = 1;
  settings.c_cc[VTIME] = 0;
  tcsetattr(descriptor, TCSANOW, &settings);
  tcflush(descriptor, TCIFLUSH);
  descriptor_ = descriptor;
  return Ok();
}

void PortModem::Close() {
  if (descriptor_ >= 0) {
    close(descriptor_);
    descriptor_ = -1;
  }
}

void PortModem::Step(int64_t now_ns) {
  if (descriptor_ < 0) {
    if (now_ns < next_try_ns_) {
      return;
    }
    next_try_ns_ = now_ns + kReopenNs;
    if (!Open().ok()) {
      return;
    }
    ++reconnects_;
  }
  std::array<uint8_t, 512> buffer{};
  const ssize_t size = read(descriptor_, buffer.data(), buffer.size());
  if (size > 0) {
    medium_->Transmit(number_, {buffer.data(), static_cast<size_t>(size)});
  } else if (size == 0 || (errno != EAGAIN && errno != EINTR)) {
    Close();  // the other side has hung up
    next_try_ns_ = now_ns + kReopenNs;
  }
}

// A byte that cannot be written is lost, as on the air; the conversation recovers.
void PortModem::OnByte(uint8_t byte, int64_t /*time_ns*/) {
  if (descriptor_ >= 0 && write(descriptor_, &byte, 1) < 0 && errno != EAGAIN && errno != EINTR) {
    Close();
  }
}

Result<LiveResult> RunLive(const LiveConfig& config, double seconds,
                           const volatile std::sig_atomic_t* stop,
                           const std::function<void(const LiveStatus&)>& show) {
  sim::RadioMedium medium(config.radio);
  PortModem modem(config.device, &medium);
  if (const Status opened = modem.Open(); !opened.ok()) {
    return Error{opened.error()};
  }
  sim::SimulatedRobot robot(config.robot, &medium);
  LiveResult result;
  std::deque<std::pair<int64_t, uint32_t>> answers;  // (time, answers so far) of the last second

  const int64_t start_ns = MonotonicNs();
  int64_t now_ms = 0;
  const auto end_ms = static_cast<int64_t>(seconds * 1000);
  while (*stop == 0 && (end_ms == 0 || now_ms < end_ms)) {
    // Every millisecond of the robot's time is lived through, late if need be, never skipped.
    const int64_t target_ms = (MonotonicNs() - start_ns) / kNsPerMs;
    for (; now_ms < target_ms && (end_ms == 0 || now_ms < end_ms);) {
      ++now_ms;
      medium.AdvanceTo(now_ms * kNsPerMs);
      modem.Step(now_ms * kNsPerMs);
      robot.Step();
      if (now_ms % config.sample_ms == 0 || now_ms == 1) {
        result.track.push_back(Observe(robot, config.path, now_ms));
      }
      if (now_ms % kShowMs == 0) {
        const client::Counters& counters = robot.conversation().counters();
        answers.emplace_back(now_ms, counters.answers);
        while (answers.size() > 2 && answers.front().first < now_ms - 1000) {
          answers.pop_front();
        }
        const auto& [then_ms, then] = answers.front();
        const double span_s = static_cast<double>(std::max<int64_t>(now_ms - then_ms, 1)) / 1000;
        result.last = {Observe(robot, config.path, now_ms),
                       counters,
                       robot.conversation().flags(),
                       static_cast<double>(now_ms) / 1000,
                       static_cast<double>(counters.answers - then) / span_s,
                       medium.Utilisation(),
                       modem.connected()};
        show(result.last);
      }
    }
    // Until the next millisecond, or until a byte comes.
    pollfd wait{modem.descriptor(), POLLIN, 0};
    poll(&wait, modem.connected() ? 1 : 0, 1);
  }
  result.reconnects = modem.reconnects();
  return result;
}

}  // namespace pheromone::swarm
