// The interface of a serial line, real or virtual: a descriptor to read and write.
//
// Not thread-safe; it has one owner, which closes what it opened. A call may block for as long as
// the driver does: port_calls.h makes the calls on threads where this does not delay others.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/base/descriptor.h"
#include "server/base/result.h"
#include "server/robots/links/line_errors.h"
#include "server/robots/links/link_config.h"

namespace pheromone::links {

class Port {
 public:
  Port() = default;
  Port(const Port&) = delete;
  Port& operator=(const Port&) = delete;
  virtual ~Port() = default;

  /// A descriptor of the caller's own, non-blocking and closed on exec. After an error, or after
  /// Close, it may be opened again.
  virtual Result<Descriptor> Open() = 0;

  /// Unkeys the transceiver and releases what Open acquired apart from the descriptor.
  virtual void Close() = 0;

  /// Whether the port has a carrier-sense input; an output that keys the transceiver. Constant, and
  /// without a call to the driver.
  virtual bool senses_carrier() const { return false; }
  virtual bool is_keyed() const { return false; }

  /// While it is open: whether a carrier is present.
  virtual bool carrier() const { return false; }
  /// While it is open: keys or unkeys the transceiver.
  virtual void Key(bool /*sending*/) {}
  /// While it is open: waits until the last bit that was written to the descriptor has left the
  /// port, as far as its driver tells. Blocks for as long as that takes, at most a second longer
  /// than the bytes need. Some drivers tell too early, and a pty knows nothing: so a caller that
  /// unkeys does not do it before the bytes must have left either, a byte's time each after the
  /// write.
  virtual void WaitUntilSent() {}
  /// While it is open: the errors on the line since it was opened, if the driver counts them.
  virtual std::optional<LineErrors> errors() const { return std::nullopt; }

  /// Text for a log, without a call to the driver: "pty radio-a.pty -> /dev/pts/3".
  virtual std::string Describe() const = 0;
};

/// The master side of a pseudo-terminal. `path` becomes a symbolic link to the slave side, which
/// clients open like a modem's port; it replaces a symbolic link to a pseudo-terminal that no
/// running server holds, and nothing else. The port holds the slave open, so that the absence of a
/// client is not the end of the line.
std::unique_ptr<Port> MakePtyPort(std::string path);

struct SerialPortOptions {
  std::string name;                                ///< for messages
  std::function<Result<std::string>()> find_path;  ///< where it is now; asked at each Open
  uint32_t baud = 9600;
  ModemLines lines;
};

/// A real serial port, through libserialport: 8N1 without flow control, opened exclusively. The
/// path may be a symbolic link (/dev/serial/by-id/...). Errors of Open: it does not exist, is not a
/// serial port, is busy (and held by whom, port_holder.h), or does not support the settings.
std::unique_ptr<Port> MakeSerialPort(SerialPortOptions options);

}  // namespace pheromone::links
