// A file descriptor with an owner, and messages for system errors.
#pragma once

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "server/base/result.h"

namespace pheromone {

/// An open descriptor; its destructor closes it.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int value) : value_(value) {}
  Descriptor(Descriptor&& other) noexcept : value_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    if (this != &other) {
      Close();
      value_ = other.release();
    }
    return *this;
  }
  ~Descriptor() { Close(); }

  int get() const { return value_; }
  bool valid() const { return value_ >= 0; }
  int release() { return std::exchange(value_, -1); }
  /// False if the system reports an error, such as of an earlier write.
  bool Close() { return !valid() || close(release()) == 0; }

 private:
  int value_ = -1;
};

/// Writes all bytes, retrying after signals. False on an error, with errno.
inline bool WriteAll(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = write(descriptor, bytes.data(), bytes.size());
    if (count < 0 && errno != EINTR) {
      return false;
    }
    bytes.remove_prefix(static_cast<size_t>(std::max<ssize_t>(count, 0)));
  }
  return true;
}

/// `what: the system's message for errno`
inline Error SystemError(const std::string& what) {
  return Error{what + ": " + std::generic_category().message(errno)};
}

}  // namespace pheromone
