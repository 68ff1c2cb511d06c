#include "client_fw/attach/adapter.h"

#include <fcntl.h>
#include <linux/serial.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "server/base/descriptor.h"

namespace pheromone::attach {

// What setserial(8) calls low_latency: FTDI's driver sets the latency timer to 1 ms.
void AskForLowLatency(int descriptor) {
  serial_struct serial = {};
  if (ioctl(descriptor, TIOCGSERIAL, &serial) == 0) {
    serial.flags = static_cast<int>(static_cast<unsigned>(serial.flags) | ASYNC_LOW_LATENCY);
    static_cast<void>(ioctl(descriptor, TIOCSSERIAL, &serial));  // it may not be able to
  }
}

uint8_t AdapterLatencyMs(const std::string& port, const std::string& sys) {
  const Descriptor descriptor(open(port.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (descriptor.valid()) {
    AskForLowLatency(descriptor.get());
  }
  std::error_code error;
  const std::string name = std::filesystem::canonical(port, error).filename().string();
  std::ifstream timer(sys + "/class/tty/" + name + "/device/latency_timer");
  int ms = 0;
  if (timer >> ms) {
    return static_cast<uint8_t>(std::clamp(ms, 1, 255));
  }
  const bool usb = name.starts_with("ttyUSB") || name.starts_with("ttyACM");
  return usb || name.empty() ? kUsualLatencyMs : uint8_t{0};
}

}  // namespace pheromone::attach
