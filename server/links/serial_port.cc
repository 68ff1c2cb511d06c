// Real serial ports. libserialport finds, opens and configures; reading and writing go through a
// duplicate of its descriptor, which the event loop owns.
#include <fcntl.h>
#include <libserialport.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <climits>
#include <cstdlib>
#include <memory>

#include "server/links/port.h"

namespace pheromone::links {
namespace {

struct Closer {
  void operator()(sp_port* port) const {
    sp_close(port);
    sp_free_port(port);
  }
};

class SerialPort final : public Port {
 public:
  SerialPort(std::string path, uint32_t baud) : path_(std::move(path)), baud_(baud) {}

  Result<Descriptor> Open() override {
    Close();
    std::array<char, PATH_MAX> real{};
    if (realpath(path_.c_str(), real.data()) == nullptr) {
      return SystemError(path_);
    }
    sp_port* found = nullptr;
    if (sp_get_port_by_name(real.data(), &found) != SP_OK) {
      return Error{path_ + ": not a serial port"};
    }
    std::unique_ptr<sp_port, Closer> port(found);
    if (sp_open(port.get(), SP_MODE_READ_WRITE) != SP_OK) {
      return SystemError(path_ + ": cannot be opened");
    }
    int handle = -1;
    if (sp_set_baudrate(port.get(), static_cast<int>(baud_)) != SP_OK) {
      return SystemError(path_ + ": cannot be set to " + std::to_string(baud_) + " baud");
    }
    if (sp_set_bits(port.get(), 8) != SP_OK || sp_set_parity(port.get(), SP_PARITY_NONE) != SP_OK ||
        sp_set_stopbits(port.get(), 1) != SP_OK ||
        sp_set_flowcontrol(port.get(), SP_FLOWCONTROL_NONE) != SP_OK ||
        sp_flush(port.get(), SP_BUF_BOTH) != SP_OK ||
        sp_get_port_handle(port.get(), &handle) != SP_OK) {
      return SystemError(path_ + ": cannot be configured");
    }
    Descriptor own(fcntl(handle, F_DUPFD_CLOEXEC, 0));
    // libserialport leaves VMIN = 0, with which an idle line looks like its end.
    termios mode{};
    if (!own.valid() || tcgetattr(own.get(), &mode) != 0) {
      return SystemError(path_ + ": cannot be configured");
    }
    mode.c_cc[VMIN] = 1;
    mode.c_cc[VTIME] = 0;
    if (tcsetattr(own.get(), TCSANOW, &mode) != 0 || ioctl(own.get(), TIOCEXCL) != 0) {
      return SystemError(path_ + ": cannot be configured");
    }
    port_ = std::move(port);
    return own;
  }

  void Close() override { port_.reset(); }

  std::string Describe() const override {
    return "serial " + path_ + " at " + std::to_string(baud_) + " baud";
  }

 private:
  const std::string path_;
  const uint32_t baud_;
  std::unique_ptr<sp_port, Closer> port_;
};

}  // namespace

std::unique_ptr<Port> MakeSerialPort(std::string path, uint32_t baud) {
  return std::make_unique<SerialPort>(std::move(path), baud);
}

}  // namespace pheromone::links
