// Finds serial ports by the identity of their USB adapter, wherever it is plugged in.
//
//   const Result<std::string> path = ChooseUsbPort({0x0403, 0x6001, "A50285BI"}, ListUsbPorts());
//
// Thread-safe.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "server/base/result.h"
#include "server/robots/links/link_config.h"

namespace pheromone::links {

struct UsbPort {
  std::string path;
  UsbIdentity identity;
};

/// The serial ports of all connected USB adapters, sorted by path; through libserialport.
std::vector<UsbPort> ListUsbPorts();

/// The path of the matching port. Errors: none matches (listing the existing ones), or several do.
Result<std::string> ChooseUsbPort(const UsbIdentity& wanted, std::span<const UsbPort> ports);

}  // namespace pheromone::links
