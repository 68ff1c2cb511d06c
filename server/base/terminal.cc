#include "server/base/terminal.h"

#include <fcntl.h>
#include <sys/file.h>
#include <termios.h>

#include <cerrno>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "server/base/holders.h"

namespace pheromone {
namespace {

std::string Message(int error) {
  return std::generic_category().message(error);
}

OpenedTerminal NotOpened(const std::string& why) {
  OpenedTerminal opened;
  opened.status = Error{why};
  return opened;
}

// Of a port that is open exclusively: one of those who have it open.
std::optional<int> HolderOfDevice(const std::string& path) {
  const std::vector<int> holders = HoldersOf(path);
  return holders.empty() ? std::nullopt : std::optional(holders.front());
}

OpenedTerminal InUse(const std::optional<int>& holder) {
  OpenedTerminal opened =
      NotOpened("in use by " + (holder ? DescribeProcess(*holder) : "another program"));
  opened.in_use = true;
  return opened;
}

}  // namespace

std::string WhyNotOpened(int error) {
  return Message(error) +
         (error == EACCES ? "; serial ports are for members of the group dialout: sudo adduser "
                            "$USER dialout, then log in again"
                          : "");
}

OpenedTerminal OpenTerminal(const std::string& path) {
  Descriptor descriptor(open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  termios mode{};
  if (!descriptor.valid()) {
    return errno == EBUSY ? InUse(HolderOfDevice(path)) : NotOpened(WhyNotOpened(errno));
  }
  if (tcgetattr(descriptor.get(), &mode) != 0) {
    return NotOpened("not a terminal device (" + Message(errno) + ")");
  }
  if (flock(descriptor.get(), LOCK_EX | LOCK_NB) != 0) {
    return InUse(HolderOfLock(descriptor.get()));
  }
  OpenedTerminal opened;
  opened.descriptor = std::move(descriptor);
  return opened;
}

}  // namespace pheromone
