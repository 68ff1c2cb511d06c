#include "server/links/port.h"

#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace pheromone::links {

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  if (this != &other) {
    if (valid()) {
      close(value_);
    }
    value_ = other.release();
  }
  return *this;
}

Descriptor::~Descriptor() {
  if (valid()) {
    close(value_);
  }
}

Error SystemError(const std::string& what) {
  return Error{what + ": " + std::generic_category().message(errno)};
}

}  // namespace pheromone::links
