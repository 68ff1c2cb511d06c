#include "client_fw/swarm/port_modem.h"

#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include "server/base/terminal.h"

namespace pheromone::swarm {
namespace {

constexpr int64_t kReopenNs = 500'000'000;
constexpr size_t kAdapterBytes = 62;  // it does not hold back more

struct Rate {
  int64_t baud;
  speed_t speed;
};
constexpr std::array<Rate, 10> kRates = {{{300, B300},
                                          {600, B600},
                                          {1200, B1200},
                                          {2400, B2400},
                                          {4800, B4800},
                                          {9600, B9600},
                                          {19'200, B19200},
                                          {38'400, B38400},
                                          {57'600, B57600},
                                          {115'200, B115200}}};

// Other rates are as already configured on the port.
void SetRate(int64_t byte_ns, termios* settings) {
  for (const Rate& rate : kRates) {
    if (10'000'000'000 / rate.baud == byte_ns) {
      cfsetspeed(settings, rate.speed);
    }
  }
}

}  // namespace

PortModem::PortModem(std::string device, sim::RadioMedium* medium, int64_t adapter_ns)
    : device_(std::move(device)),
      medium_(medium),
      adapter_ns_(adapter_ns),
      number_(medium->AddStation(this)) {}

PortModem::~PortModem() {
  Close();
}

Status PortModem::Open() {
  OpenedTerminal opened = OpenTerminal(device_);
  if (!opened.status.ok()) {
    return Error{device_ + ": " + opened.status.error()};
  }
  const int descriptor = opened.descriptor.release();
  termios settings{};
  tcgetattr(descriptor, &settings);
  cfmakeraw(&settings);
  settings.c_cc[VMIN] = 1;
  settings.c_cc[VTIME] = 0;
  SetRate(medium_->byte_ns(), &settings);
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

void PortModem::AdvanceTo(int64_t time_ns) {
  medium_->AdvanceTo(time_ns);
  if (give_at_ns_ <= time_ns) {
    Give();
  }
  if (descriptor_ < 0) {
    if (time_ns < next_try_ns_) {
      return;
    }
    next_try_ns_ = time_ns + kReopenNs;
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
    next_try_ns_ = time_ns + kReopenNs;
  }
}

void PortModem::OnByte(uint8_t byte, int64_t time_ns) {
  held_.push_back(byte);
  give_at_ns_ = std::min(give_at_ns_, time_ns + adapter_ns_);
  if (give_at_ns_ <= time_ns || held_.size() >= kAdapterBytes) {
    Give();
  }
}

// Bytes that cannot be written are lost, as on the air; the conversation recovers.
void PortModem::Give() {
  if (descriptor_ >= 0 && write(descriptor_, held_.data(), held_.size()) < 0 && errno != EAGAIN &&
      errno != EINTR) {
    Close();
  }
  held_.clear();
  give_at_ns_ = sim::RadioMedium::kNever;
}

}  // namespace pheromone::swarm
