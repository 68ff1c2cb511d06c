// Real serial ports. libserialport finds, opens and configures them; bytes are read and written
// through a duplicate of its descriptor, owned by the event loop.
#include <fcntl.h>
#include <libserialport.h>
#include <linux/serial.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <climits>
#include <cstdlib>
#include <memory>
#include <utility>

#include "server/base/counters.h"
#include "server/base/terminal.h"
#include "server/robots/links/drain.h"
#include "server/robots/links/port.h"
#include "server/robots/links/port_holder.h"

namespace pheromone::links {
namespace {

struct Closer {
  void operator()(sp_port* port) const {
    sp_close(port);
    sp_free_port(port);
  }
};

// The driver's counters since it was loaded; empty if it has none.
std::optional<LineErrors> ReadCounts(int handle) {
  serial_icounter_struct counts = {};
  if (ioctl(handle, TIOCGICOUNT, &counts) != 0) {
    return std::nullopt;
  }
  const auto number = [](int count) { return uint64_t{static_cast<uint32_t>(count)}; };
  return LineErrors{number(counts.frame), number(counts.parity), number(counts.overrun),
                    number(counts.buf_overrun), number(counts.brk)};
}

// The driver's counters wrap at 32 bits.
LineErrors Since(const LineErrors& before, const LineErrors& now) {
  LineErrors since = DifferenceOf(now, before);
  for (uint64_t* count :
       {&since.framing, &since.parity, &since.overruns, &since.buffer_overruns, &since.breaks}) {
    *count &= UINT32_MAX;
  }
  return since;
}

class SerialPort final : public Port {
 public:
  explicit SerialPort(SerialPortOptions options) : options_(std::move(options)) {}

  Result<Descriptor> Open() override {
    Close();
    PHEROMONE_TRY(const std::string path, options_.find_path());
    std::array<char, PATH_MAX> real{};
    if (realpath(path.c_str(), real.data()) == nullptr) {
      return SystemError(path);
    }
    sp_port* found = nullptr;
    if (sp_get_port_by_name(real.data(), &found) != SP_OK) {
      return Error{path + ": not a serial port"};
    }
    std::unique_ptr<sp_port, Closer> port(found);
    // Opening it with libserialport already changes its settings, and another program may be using
    // it: so it is first locked through a separate descriptor.
    OpenedTerminal lock = OpenTerminal(real.data());
    if (lock.in_use) {
      return Busy(path, real.data());
    }
    if (!lock.status.ok()) {
      return Error{path + ": cannot be opened: " + lock.status.error()};
    }
    if (sp_open(port.get(), SP_MODE_READ_WRITE) != SP_OK) {
      return errno == EBUSY ? Busy(path, real.data()) : SystemError(path + ": cannot be opened");
    }
    int handle = -1;
    if (sp_get_port_handle(port.get(), &handle) != SP_OK) {
      return Error{path + ": cannot be opened"};
    }
    PHEROMONE_TRY_STATUS(Configure(port.get(), handle, path));
    Descriptor own(fcntl(handle, F_DUPFD_CLOEXEC, 0));
    if (!own.valid()) {
      return SystemError(path + ": cannot be opened");
    }
    lock_ = std::move(lock.descriptor);
    port_ = std::move(port);
    handle_ = handle;
    counts_at_first_ = ReadCounts(handle);
    return own;
  }

  void Close() override {
    if (port_ != nullptr) {
      Key(false);
      sp_flush(port_.get(), SP_BUF_OUTPUT);  // otherwise closing may wait for a dead modem
    }
    port_.reset();
    lock_ = Descriptor();
    handle_ = -1;
  }

  bool senses_carrier() const override {
    return options_.lines.carrier_sense != CarrierSense::kNone;
  }
  bool is_keyed() const override {
    return options_.lines.ptt == Ptt::kRts || options_.lines.ptt == Ptt::kDtr;
  }

  bool carrier() const override {
    int lines = 0;
    const int line = options_.lines.carrier_sense == CarrierSense::kDcd ? TIOCM_CAR : TIOCM_CTS;
    return senses_carrier() && ioctl(handle_, TIOCMGET, &lines) == 0 && (lines & line) != 0;
  }

  void Key(bool sending) override { Switch(handle_, sending); }

  void WaitUntilSent() override { Drain(handle_, options_.baud); }

  std::optional<LineErrors> errors() const override {
    const auto now = counts_at_first_ ? ReadCounts(handle_) : std::nullopt;
    return now ? std::optional(Since(*counts_at_first_, *now)) : std::nullopt;
  }

  std::string Describe() const override {
    return "serial " + options_.name + " at " + std::to_string(options_.baud) + " baud";
  }

 private:
  static Error Busy(const std::string& path, const char* device) {
    return Error{path + ": busy, " + DescribeHolders(device)};
  }

  Status Configure(sp_port* port, int handle, const std::string& path) const {
    if (ioctl(handle, TIOCEXCL) != 0) {
      return SystemError(path + ": cannot be configured");
    }
    if (sp_set_baudrate(port, static_cast<int>(options_.baud)) != SP_OK) {
      return SystemError(path + ": cannot be set to " + std::to_string(options_.baud) + " baud");
    }
    if (sp_set_bits(port, 8) != SP_OK || sp_set_parity(port, SP_PARITY_NONE) != SP_OK ||
        sp_set_stopbits(port, 1) != SP_OK ||
        sp_set_flowcontrol(port, SP_FLOWCONTROL_NONE) != SP_OK ||
        sp_flush(port, SP_BUF_BOTH) != SP_OK) {
      return SystemError(path + ": cannot be configured");
    }
    // libserialport leaves VMIN = 0, with which an idle line looks like the end of the line.
    termios mode{};
    if (tcgetattr(handle, &mode) != 0) {
      return SystemError(path + ": cannot be configured");
    }
    mode.c_cc[VMIN] = 1;
    mode.c_cc[VTIME] = 0;
    if (tcsetattr(handle, TCSANOW, &mode) != 0) {
      return SystemError(path + ": cannot be configured");
    }
    return SetUpLines(handle, path);
  }

  Status SetUpLines(int handle, const std::string& path) const {
    int lines = 0;
    if ((senses_carrier() || is_keyed()) && ioctl(handle, TIOCMGET, &lines) != 0) {
      return SystemError(path + ": has no modem lines for carrier_sense and ptt");
    }
    if (options_.lines.ptt == Ptt::kRs485) {
      serial_rs485 settings = {};
      settings.flags = SER_RS485_ENABLED | SER_RS485_RTS_ON_SEND;
      settings.delay_rts_before_send = options_.lines.ptt_lead_ms;
      settings.delay_rts_after_send = options_.lines.ptt_tail_ms;
      if (ioctl(handle, TIOCSRS485, &settings) != 0) {
        return SystemError(path +
                           ": its driver cannot switch the direction of an RS-485 line (ptt = "
                           "\"rs485\"); an adapter that switches by itself needs no ptt, and "
                           "others often use \"rts\"");
      }
    }
    Switch(handle, false);  // opening a port raises both lines
    return Ok();
  }

  void Switch(int handle, bool sending) const {
    const int line = options_.lines.ptt == Ptt::kRts   ? TIOCM_RTS
                     : options_.lines.ptt == Ptt::kDtr ? TIOCM_DTR
                                                       : 0;
    if (line != 0) {
      ioctl(handle, sending ? TIOCMBIS : TIOCMBIC, &line);
    }
  }

  const SerialPortOptions options_;
  Descriptor lock_;
  std::unique_ptr<sp_port, Closer> port_;
  int handle_ = -1;  // the port's own
  std::optional<LineErrors> counts_at_first_;
};

}  // namespace

std::unique_ptr<Port> MakeSerialPort(SerialPortOptions options) {
  return std::make_unique<SerialPort>(std::move(options));
}

}  // namespace pheromone::links
