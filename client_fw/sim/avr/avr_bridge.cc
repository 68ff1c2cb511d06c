#include "client_fw/sim/avr/avr_bridge.h"

#include <unistd.h>

#include <array>
#include <cerrno>

namespace pheromone::sim {
namespace {

// The UART spaces what comes in; more than this, some tenths of a second, waits in the terminal.
constexpr size_t kMaxUnderway = 256;

}  // namespace

AvrBridge::AvrBridge(AvrMachine* machine, int radio_fd, int robot_fd)
    : machine_(machine), radio_fd_(radio_fd), robot_fd_(robot_fd) {
  machine_->OnSent(AvrMachine::kRadio,
                   [this](uint8_t byte, int64_t /*time_ns*/) { Write(radio_fd_, byte); });
  if (robot_fd_ >= 0) {
    machine_->OnSent(AvrMachine::kRobot,
                     [this](uint8_t byte, int64_t /*time_ns*/) { Write(robot_fd_, byte); });
  }
}

bool AvrBridge::Step(int64_t now_ns) {
  const bool radio = Read(AvrMachine::kRadio, radio_fd_);
  const bool robot = robot_fd_ < 0 || Read(AvrMachine::kRobot, robot_fd_);
  machine_->RunTo(now_ns);
  return radio && robot;
}

bool AvrBridge::Read(AvrMachine::Port port, int fd) {
  std::array<uint8_t, kMaxUnderway> bytes{};
  if (machine_->underway(port) >= bytes.size()) {
    return true;
  }
  const ssize_t size = read(fd, bytes.data(), bytes.size() - machine_->underway(port));
  for (ssize_t i = 0; i < size; ++i) {
    machine_->Send(port, bytes[static_cast<size_t>(i)], machine_->now_ns());
  }
  return size > 0 || (size < 0 && (errno == EAGAIN || errno == EINTR));
}

void AvrBridge::Write(int fd, uint8_t byte) {
  if (write(fd, &byte, 1) != 1) {
    ++lost_;
  }
}

}  // namespace pheromone::sim
