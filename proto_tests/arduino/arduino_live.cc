// An image of an Arduino Uno in real time: its radio is a terminal, and on its pins are wheels, as
// the examples of client_fw/boards/arduino have them.
//
//   arduino_live IMAGE MODEM encoders|steppers
//
// Prints a line every half second of the machine, "x_m y_m degrees" and the depth of the stack,
// until SIGTERM, and ends with status 0 then. SIGUSR1 is the reset button, SIGUSR2 switches the
// supply off and on. Another status, and a reason, if the image or the terminal fails.
#include <fcntl.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include "client_fw/sim/avr/avr_bridge.h"
#include "client_fw/sim/avr/avr_machine.h"
#include "client_fw/sim/differential_drive.h"

namespace pheromone::firmware {
namespace {

using Clock = std::chrono::steady_clock;
using sim::AvrPin;

constexpr int64_t kLineNs = 500'000'000;
constexpr int64_t kLongestNs = 20'000'000;
constexpr double kTrackM = 0.15;
constexpr double kTurnM = 0.065 * std::numbers::pi;  // of a wheel

volatile std::sig_atomic_t stop_signal = 0;
volatile std::sig_atomic_t reset_signal = 0;

void OnSignal(int signal) {
  (signal == SIGTERM ? stop_signal : reset_signal) = signal;
}

int OpenTerminal(const char* path) {
  const int fd = open(path, O_RDWR | O_NOCTTY | O_NONBLOCK);
  termios settings{};
  if (fd < 0 || tcgetattr(fd, &settings) != 0) {
    throw std::runtime_error(std::string(path) + ": " + std::strerror(errno));
  }
  cfmakeraw(&settings);
  cfsetspeed(&settings, B9600);
  tcsetattr(fd, TCSANOW, &settings);
  return fd;
}

class Wheels {
 public:
  virtual ~Wheels() = default;
  // How far each wheel has rolled within a tenth of a millisecond.
  virtual std::array<double, 2> Roll() = 0;
};

// UnoSteppers: pins 2 to 5 are PD2 to PD5; the right motor is the other way round.
class SteppedWheels final : public Wheels {
 public:
  explicit SteppedWheels(sim::AvrMachine* machine) {
    for (const size_t wheel : {0u, 1u}) {
      const int step = wheel == 0 ? 2 : 4;
      machine->OnPin({'D', step + 1}, [this, wheel](bool high, int64_t /*time_ns*/) {
        direction_[wheel] = high == (wheel == 1) ? 1 : -1;
      });
      machine->OnPin({'D', step}, [this, wheel](bool high, int64_t /*time_ns*/) {
        rolled_m_[wheel] += high ? direction_[wheel] * kTurnM / 1600 : 0;
      });
    }
  }

  std::array<double, 2> Roll() override { return std::exchange(rolled_m_, {}); }

 private:
  std::array<int, 2> direction_ = {1, -1};
  std::array<double, 2> rolled_m_ = {};
};

// UnoRadio: 5 is PD5 and OC0B, 6 is PD6 and OC0A; directions are 8 and 9, PB0 and PB1. A full turn
// of a wheel has 360 periods of its encoder, whose channels are 2 and 4, and 3 and 7.
class EncodedWheels final : public Wheels {
 public:
  explicit EncodedWheels(sim::AvrMachine* machine) : machine_(machine) {
    for (const size_t wheel : {0u, 1u}) {
      machine->OnPin({'B', static_cast<int>(wheel)},
                     [this, wheel](bool high, int64_t /*time_ns*/) { backwards_[wheel] = high; });
      Show(wheel);
    }
  }

  std::array<double, 2> Roll() override {
    constexpr double kFullSpeed = 0.6;  // m/s; the sketch believes 0.5
    constexpr double kLag = 800;        // tenths of a millisecond
    std::array<double, 2> rolled_m{};
    for (const size_t wheel : {0u, 1u}) {
      const double goal = Duty(wheel) * kFullSpeed * (backwards_[wheel] ? -1 : 1);
      speed_[wheel] += (goal - speed_[wheel]) / kLag;
      rolled_m[wheel] = speed_[wheel] / 10'000;
      way_m_[wheel] += rolled_m[wheel];
      Show(wheel);
    }
    return rolled_m;
  }

 private:
  // Of analogWrite: the timer's if it drives the pin, else the pin's.
  double Duty(size_t wheel) const {
    constexpr uint16_t kControl = 0x44;  // TCCR0A
    constexpr uint16_t kCompareA = 0x47;
    constexpr uint16_t kPortD = 0x2B;
    const bool b = wheel == 0;
    if ((machine_->data(kControl) & (b ? 0x20 : 0x80)) != 0) {
      return machine_->data(b ? kCompareA + 1 : kCompareA) / 255.0;
    }
    return (machine_->data(kPortD) >> (b ? 5 : 6) & 1) != 0 ? 1 : 0;
  }

  // Quadrature: a quarter of a period after the other.
  void Show(size_t wheel) {
    const auto quarter = static_cast<int64_t>(std::floor(way_m_[wheel] / (kTurnM / 1440)));
    const auto phase = static_cast<int>((quarter % 4 + 4) % 4);
    const AvrPin a = {'D', wheel == 0 ? 2 : 3};
    const AvrPin b = {'D', wheel == 0 ? 4 : 7};
    const bool a_high = phase == 1 || phase == 2;
    const bool b_high = phase >= 2;
    if (a_high != shown_[wheel][0] || first_) {
      machine_->SetPin(a, a_high);
    }
    if (b_high != shown_[wheel][1] || first_) {
      machine_->SetPin(b, b_high);
    }
    shown_[wheel] = {a_high, b_high};
    first_ = first_ && wheel == 0;
  }

  sim::AvrMachine* machine_;
  std::array<bool, 2> backwards_ = {};
  std::array<double, 2> speed_ = {};
  std::array<double, 2> way_m_ = {};
  std::array<std::array<bool, 2>, 2> shown_ = {};
  bool first_ = true;
};

void Run(const char* image, const char* modem, bool stepped) {
  sim::AvrMachineConfig config;
  config.image = image;
  config.mcu = "atmega328p";
  sim::AvrMachine machine(config);
  std::unique_ptr<Wheels> wheels;
  if (stepped) {
    wheels = std::make_unique<SteppedWheels>(&machine);
  } else {
    wheels = std::make_unique<EncodedWheels>(&machine);
  }
  sim::AvrBridge bridge(&machine, OpenTerminal(modem));
  sim::PlanePose pose;
  int64_t done_ns = 0;
  int64_t line_ns = kLineNs;
  auto last = Clock::now();
  while (stop_signal == 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (reset_signal != 0) {
      machine.Reset(reset_signal == SIGUSR1 ? sim::AvrMachine::Cause::kExternal
                                            : sim::AvrMachine::Cause::kPowerOn);
      reset_signal = 0;
    }
    // Where the host is too slow, so is this machine.
    const auto now = Clock::now();
    const int64_t until_ns =
        done_ns + std::min<int64_t>(std::chrono::nanoseconds(now - last).count(), kLongestNs);
    last = now;
    while (done_ns < until_ns) {
      for (int i = 0; i < 10; ++i) {
        done_ns += 100'000;
        machine.RunTo(done_ns);
        const auto [left_m, right_m] = wheels->Roll();
        pose = sim::MoveOnArc(pose, left_m, right_m, kTrackM);
      }
      if (!bridge.Step(done_ns)) {
        throw std::runtime_error(std::string(modem) + " is gone");
      }
    }
    if (done_ns >= line_ns) {
      line_ns += kLineNs;
      std::printf("%.3f %.3f %.0f stack %d\n", pose.x_m, pose.y_m,
                  pose.heading_rad * 180 / std::numbers::pi, machine.stack_bytes());
      std::fflush(stdout);
    }
  }
}

}  // namespace
}  // namespace pheromone::firmware

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "Usage: %s IMAGE MODEM encoders|steppers\n", argv[0]);
    return 2;
  }
  for (const int signal : {SIGTERM, SIGUSR1, SIGUSR2}) {
    std::signal(signal, &pheromone::firmware::OnSignal);
  }
  try {
    pheromone::firmware::Run(argv[1], argv[2], std::string(argv[3]) == "steppers");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
