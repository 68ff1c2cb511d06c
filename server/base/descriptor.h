// A file descriptor with an owner, and the words for what the system refuses.
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

/// An open descriptor, closed with its owner.
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
  /// False if the system reports an error, such as of writing what was written before.
  bool Close() { return !valid() || close(release()) == 0; }

 private:
  int value_ = -1;
};

/// All of them, again after a signal. False if that failed, errno says why.
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

/// `what: the system's words for errno`
inline Error SystemError(const std::string& what) {
  return Error{what + ": " + std::generic_category().message(errno)};
}

}  // namespace pheromone
