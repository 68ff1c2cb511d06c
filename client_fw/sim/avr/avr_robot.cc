#include "client_fw/sim/avr/avr_robot.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace pheromone::sim {
namespace {

constexpr int64_t kTenBitsNs = 10'000'000'000;
// A keyed modem's bytes come at each Step, and are to follow each other.
constexpr int64_t kHandOverNs = 1'000'000;
constexpr uint8_t kMangled = 0xA5;

AvrMachineConfig Strapped(const AvrRobotConfig& config) {
  AvrMachineConfig machine = config.machine;
  for (int bit = 0; bit < 8; ++bit) {
    if ((config.id & 1u << bit) != 0) {
      machine.grounded.push_back({config.pins.id_port, bit});
    }
  }
  return machine;
}

}  // namespace

AvrRobot::AvrRobot(const AvrRobotConfig& config, RadioMedium* medium)
    : medium_(medium),
      carrier_pin_(config.pins.carrier),
      led_pin_(config.pins.led),
      cable_byte_ns_(kTenBitsNs / config.machine.robot_baud),
      machine_(Strapped(config)),
      pioneer_(config.pioneer, config.start),
      tally_(config.id, config.is_signed),
      modem_(config.keyed),
      byte_ns_(kTenBitsNs / config.machine.radio_baud),
      station_(medium->AddStation(this, modem_ ? std::optional(kHandOverNs) : std::nullopt)) {
  machine_.OnSent(AvrMachine::kRadio,
                  [this](uint8_t byte, int64_t time_ns) { Send(byte, time_ns); });
  machine_.OnPin(config.pins.ptt, [this](bool high, int64_t time_ns) { Key(high, time_ns); });
  machine_.OnSent(AvrMachine::kRobot,
                  [this](uint8_t byte, int64_t time_ns) { ToPioneer(byte, time_ns); });
  machine_.OnPin(config.pins.load, [this](bool high, int64_t /*time_ns*/) { load_ = high; });
  machine_.SetPin(carrier_pin_, true);
}

void AvrRobot::Step() {
  ShowCarrier();
  RunTo(medium_->now_ns());
  HandOver(medium_->now_ns());
  medium_->Transmit(station_, outgoing_);
  outgoing_.clear();
  if (modem_) {
    medium_->Key(station_, ptt_);
  }
}

void AvrRobot::set_robot_baud(int64_t baud) {
  machine_.set_robot_baud(baud);
  cable_byte_ns_ = kTenBitsNs / baud;
}

void AvrRobot::RestartPioneer() {
  pioneer_.HangUp();
  set_robot_baud(9600);
}

void AvrRobot::Send(uint8_t byte, int64_t time_ns) {
  tally_.OnSent(byte, time_ns);
  if (!modem_) {
    outgoing_.push_back(byte);
    return;
  }
  const bool early = !ptt_ || time_ns - byte_ns_ < keyed_at_ns_ + modem_->rise_ns;
  held_.push_back({byte, time_ns, early});
}

void AvrRobot::Key(bool high, int64_t time_ns) {
  HandOver(time_ns);
  for (Held& held : held_) {  // a part of it has not left
    held.damaged = true;
  }
  ptt_ = high;
  keyed_at_ns_ = time_ns;
}

// What has left a keyed modem.
void AvrRobot::HandOver(int64_t time_ns) {
  for (; !held_.empty() && held_.front().time_ns + modem_->hold_ns <= time_ns; held_.pop_front()) {
    const Held& held = held_.front();
    outgoing_.push_back(held.damaged ? static_cast<uint8_t>(held.byte ^ kMangled) : held.byte);
  }
}

void AvrRobot::RunAhead(int64_t ns) {
  RunTo(medium_->now_ns() + ns);
}

void AvrRobot::RunTo(int64_t end_ns) {
  for (int64_t now_ns = machine_.now_ns(); now_ns < end_ns;) {
    now_ns = std::min(end_ns, std::max(pioneer_.NextSipTime(), now_ns + 1));
    machine_.RunTo(now_ns);
    pioneer_.AdvanceTo(now_ns);
    FromPioneer(now_ns);
  }
  bumps_.Look(pioneer_.drive().stalled(), pioneer_.drive().true_pose());
}

void AvrRobot::OnByte(uint8_t byte, int64_t time_ns) {
  machine_.Send(AvrMachine::kRadio, byte, time_ns);
  tally_.OnHeard(byte, time_ns);
}

void AvrRobot::OnTransmitted(int64_t /*time_ns*/) {}

client::WheelSpeeds AvrRobot::wheels() const {
  const PioneerDrive& drive = pioneer_.drive();
  return {static_cast<int16_t>(std::lround(drive.left_m_s() * 1000)),
          static_cast<int16_t>(std::lround(drive.right_m_s() * 1000))};
}

void AvrRobot::ToPioneer(uint8_t byte, int64_t time_ns) {
  if (tap_) {
    tap_(byte, time_ns);
  }
  if (cable_) {
    pioneer_.OnBytes({&byte, 1}, time_ns);
    FromPioneer(time_ns);
  }
}

void AvrRobot::FromPioneer(int64_t time_ns) {
  for (const uint8_t byte : pioneer_.TakeOutput()) {
    if (cable_) {
      machine_.Send(AvrMachine::kRobot, byte, time_ns + cable_byte_ns_);
    }
  }
}

void AvrRobot::ShowCarrier() {
  const bool carrier = medium_->Busy(station_);
  if (carrier != carrier_) {
    carrier_ = carrier;
    machine_.SetPin(carrier_pin_, !carrier);
  }
}

}  // namespace pheromone::sim
