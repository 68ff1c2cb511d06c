// The client's AVR image in real time: its radio is a terminal, a modem's or a pty of pheromoned,
// and a simulated Pioneer is on its other UART.
//
//   avr_live IMAGE MODEM [ID [PTT [SETTING=VALUE...]]]
//
// ID: of the straps. PTT: a FIFO, into which a '1' goes when the line rises, a '0' when it falls;
// "-": none. SETTING: a number of client_fw/README.md; or key, whose value is the robot's in hex.
//
// Prints a line every half second, "x_m y_m degrees" and how many bytes the radio has sent and
// received, until SIGTERM or SIGINT, and ends with status 0 then. SIGUSR1 is the reset pin, SIGUSR2
// a loss of power. Another status, and a reason, if the image or the terminal fails.
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
#include <vector>

#include "client_fw/sim/avr/avr_bridge.h"
#include "client_fw/sim/avr/avr_robot.h"
#include "client_fw/sim/avr/avr_settings.h"
#include "client_fw/sim/pioneer/pioneer_robot.h"

namespace pheromone::firmware {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int64_t kLineNs = 500'000'000;

volatile std::sig_atomic_t stop_requested = 0;
volatile std::sig_atomic_t reset_requested = 0;
volatile std::sig_atomic_t power_loss_requested = 0;

void OnStopSignal(int /*signal*/) {
  stop_requested = 1;
}

void OnResetSignal(int /*signal*/) {
  reset_requested = 1;
}

void OnPowerLossSignal(int /*signal*/) {
  power_loss_requested = 1;
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

void Set(const std::string& assignment, client::Settings* settings) {
  const size_t equals = assignment.find('=');
  if (equals == std::string::npos ||
      !client::WriteSetting(static_cast<uint8_t>(std::stoi(assignment)),
                            static_cast<uint32_t>(std::stoi(assignment.substr(equals + 1))),
                            settings)) {
    throw std::runtime_error(assignment + ": expected the number of a setting, and its value");
  }
}

std::vector<uint8_t> KeyOf(const std::string& hex) {
  std::vector<uint8_t> key;
  for (size_t i = 0; i + 1 < hex.size(); i += 2) {
    key.push_back(static_cast<uint8_t>(std::stoi(hex.substr(i, 2), nullptr, 16)));
  }
  if (key.size() != protocol::kAesBlock) {
    throw std::runtime_error(hex + ": expected a key, 32 hexadecimal digits");
  }
  return key;
}

// PTT on FIFO. The reader may be late, or gone.
void TellPtt(const std::string& path, sim::AvrMachine* machine) {
  const int fd = open(path.c_str(), O_RDWR | O_NONBLOCK);
  if (fd < 0) {
    throw Failure(path);
  }
  machine->OnPin(sim::AvrBoardPins{}.ptt, [fd](bool high, int64_t /*time_ns*/) {
    [[maybe_unused]] const ssize_t size = write(fd, high ? "1" : "0", 1);
  });
}

void Run(const std::vector<std::string>& words) {
  const char* const modem = words[1].c_str();
  sim::AvrMachineConfig config;
  config.image = words[0];
  const int id = words.size() > 2 ? std::stoi(words[2]) : 0;
  for (int bit = 0; bit < 8; ++bit) {
    if ((id >> bit & 1) != 0) {
      config.grounded.push_back({sim::AvrBoardPins{}.id_port, bit});
    }
  }
  client::Settings settings;
  settings.start_released = true;  // nobody is there to release it
  std::vector<uint8_t> key;
  for (size_t i = 4; i < words.size(); ++i) {
    if (words[i].starts_with("key=")) {
      key = KeyOf(words[i].substr(4));
    } else {
      Set(words[i], &settings);
    }
  }
  config.eeprom = sim::AvrEepromWith(settings, static_cast<uint16_t>(1 + id));
  if (!key.empty()) {
    sim::GiveAvrKey(key.data(), &config.eeprom);
  }
  sim::AvrMachine machine(config);
  machine.SetPin(sim::AvrBoardPins{}.carrier, true);
  if (words.size() > 3 && words[3] != "-") {
    TellPtt(words[3], &machine);
  }
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
    if (reset_requested != 0) {
      reset_requested = 0;
      machine.Reset(sim::AvrMachine::Cause::kExternal);
    }
    if (power_loss_requested != 0) {
      power_loss_requested = 0;
      machine.Reset(sim::AvrMachine::Cause::kPowerOn);
    }
    if (!bridge.Step(now_ns)) {
      throw std::runtime_error(words[1] + " is gone");
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
  if (argc < 3) {
    std::fprintf(stderr, "Usage: %s IMAGE MODEM [ID [PTT [SETTING=VALUE...]]]\n", argv[0]);
    return 2;
  }
  std::signal(SIGTERM, &pheromone::firmware::OnStopSignal);
  std::signal(SIGINT, &pheromone::firmware::OnStopSignal);
  std::signal(SIGUSR1, &pheromone::firmware::OnResetSignal);
  std::signal(SIGUSR2, &pheromone::firmware::OnPowerLossSignal);
  try {
    pheromone::firmware::Run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
