// The client's AVR image in real time: its radio is a terminal, a modem's or a pty of pheromoned,
// and a simulated Pioneer is on its other UART.
//
//   avr_live IMAGE MODEM
//
// Prints a line every half second, "x_m y_m degrees" and how many bytes the radio has sent and
// received, until SIGTERM or SIGINT, and ends with status 0 then. Another status, and a reason, if
// the image or the terminal fails.
#include <fcntl.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <numbers>
#include <stdexcept>
#include <string>
#include <thread>

#include "client_fw/sim/avr/avr_bridge.h"
#include "client_fw/sim/avr/avr_settings.h"
#include "client_fw/sim/pioneer/pioneer_robot.h"

namespace pheromone::firmware {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int64_t kLineNs = 500'000'000;

volatile std::sig_atomic_t stop_requested = 0;

void OnStopSignal(int /*signal*/) {
  stop_requested = 1;
}

std::runtime_error Failure(const std::string& what) {
  return std::runtime_error(what + ": " + std::strerror(errno));
}

int OpenModem(const char* path) {
  const int fd = open(path, O_RDWR | O_NOCTTY | O_NONBLOCK);
  termios settings{};
  if (fd < 0 || tcgetattr(fd, &settings) != 0) {
    throw Failure(path);
  }
  cfmakeraw(&settings);
  cfsetspeed(&settings, B9600);
  if (tcsetattr(fd, TCSANOW, &settings) != 0) {
    throw Failure(path);
  }
  return fd;
}

// The Pioneer at the other end of the cable.
void Serve(int fd, int64_t now_ns, sim::PioneerRobot* pioneer) {
  std::array<uint8_t, 256> bytes{};
  const ssize_t size = read(fd, bytes.data(), bytes.size());
  if (size > 0) {
    pioneer->OnBytes({bytes.data(), static_cast<size_t>(size)}, now_ns);
  }
  pioneer->AdvanceTo(now_ns);
  const auto output = pioneer->TakeOutput();
  if (!output.empty() && write(fd, output.data(), output.size()) < 0) {
    throw Failure("the cable to the Pioneer");
  }
}

void Run(const char* image, const char* modem) {
  sim::AvrMachineConfig config;
  config.image = image;
  client::Settings settings;
  settings.start_released = true;  // nobody is there to release it
  config.eeprom = sim::AvrEepromWith(settings, 1);
  sim::AvrMachine machine(config);
  sim::PioneerRobot pioneer({}, {});
  std::array<int, 2> cable{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, cable.data()) != 0) {
    throw Failure("socketpair");
  }
  sim::AvrBridge bridge(&machine, OpenModem(modem), cable[0]);
  const auto start = Clock::now();
  for (int64_t line_ns = kLineNs; stop_requested == 0;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const int64_t now_ns =
        std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now() - start).count();
    if (!bridge.Step(now_ns)) {
      throw std::runtime_error(std::string(modem) + " is gone");
    }
    Serve(cable[1], now_ns, &pioneer);
    if (now_ns >= line_ns) {
      line_ns += kLineNs;
      const sim::PlanePose& pose = pioneer.drive().true_pose();
      const sim::AvrUartCounters& radio = machine.uart(sim::AvrMachine::kRadio);
      std::printf("%.3f %.3f %.0f sent %llu received %llu overruns %llu\n", pose.x_m, pose.y_m,
                  pose.heading_rad * 180 / std::numbers::pi,
                  static_cast<unsigned long long>(radio.sent),
                  static_cast<unsigned long long>(radio.received),
                  static_cast<unsigned long long>(radio.overruns));
      std::fflush(stdout);
    }
  }
}

}  // namespace
}  // namespace pheromone::firmware

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "Usage: %s IMAGE MODEM\n", argv[0]);
    return 2;
  }
  std::signal(SIGTERM, &pheromone::firmware::OnStopSignal);
  std::signal(SIGINT, &pheromone::firmware::OnStopSignal);
  try {
    pheromone::firmware::Run(argv[1], argv[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
