// What a link needs of a serial line, real or virtual: a descriptor to read and write.
//
// Not thread-safe; one owner, which closes what it opened. A call may take as long as a driver
// likes: port_calls.h makes them where that holds up nobody.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/base/result.h"
#include "server/links/modem_lines.h"

namespace pheromone::links {

/// An open descriptor, closed with its owner.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int value) : value_(value) {}
  Descriptor(Descriptor&& other) noexcept : value_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept;
  ~Descriptor();

  int get() const { return value_; }
  bool valid() const { return value_ >= 0; }
  int release() {
    const int value = value_;
    value_ = -1;
    return value;
  }

 private:
  int value_ = -1;
};

class Port {
 public:
  Port() = default;
  Port(const Port&) = delete;
  Port& operator=(const Port&) = delete;
  virtual ~Port() = default;

  /// A descriptor of the caller's own, non-blocking and closed on exec. After an error, or after
  /// Close, it may be opened again.
  virtual Result<Descriptor> Open() = 0;

  /// Switches the transceiver back, and gives back what Open took besides the descriptor.
  virtual void Close() = 0;

  /// Whether it was made with a line that tells of a carrier; with one that switches the
  /// transceiver. Always the same, and asks no driver.
  virtual bool senses_carrier() const { return false; }
  virtual bool is_keyed() const { return false; }

  /// While it is open: whether a carrier is heard.
  virtual bool carrier() const { return false; }
  /// While it is open: switches the transceiver to sending, or back.
  virtual void Key(bool /*sending*/) {}
  /// While it is open: what went wrong on the line since it was opened, where the driver counts.
  virtual std::optional<LineErrors> errors() const { return std::nullopt; }

  /// In words, for a log; asks no driver: "pty radio-a.pty -> /dev/pts/3".
  virtual std::string Describe() const = 0;
};

/// The master side of a pseudo-terminal. `path` becomes a symbolic link to the slave side, which
/// clients open like a modem's port; it replaces a symbolic link to a pseudo-terminal that no
/// running server holds, and nothing else. The port holds the slave open, so that the absence of a
/// client is not the end of the line.
std::unique_ptr<Port> MakePtyPort(std::string path);

struct SerialPortOptions {
  std::string name;                                ///< for people
  std::function<Result<std::string>()> find_path;  ///< where it is now; asked at each Open
  uint32_t baud = 9600;
  MediumLines lines;
};

/// A real serial port, through libserialport: 8N1 without flow control, for this process alone. The
/// path may be a symbolic link (/dev/serial/by-id/...). Errors of Open: it is not there, is none,
/// is busy (and who holds it, port_holder.h), or cannot do what is asked.
std::unique_ptr<Port> MakeSerialPort(SerialPortOptions options);

/// `what: the system's words for errno`
Error SystemError(const std::string& what);

}  // namespace pheromone::links
