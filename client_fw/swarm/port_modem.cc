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

// Rates that the system does not know are as already configured on the port.
void SetRate(int64_t byte_ns, termios* settings) {
  cfsetspeed(settings, static_cast<speed_t>(10'000'000'000 / byte_ns));
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
