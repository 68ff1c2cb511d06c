#include "server/robots/links/link_config.h"

#include <array>
#include <cstdio>

namespace pheromone::links {

std::string ToText(const UsbIdentity& identity) {
  std::array<char, 16> numbers{};
  std::snprintf(numbers.data(), numbers.size(), "%04x:%04x", identity.vendor, identity.product);
  return numbers.data() + (identity.serial.empty() ? "" : ":" + identity.serial);
}

}  // namespace pheromone::links
