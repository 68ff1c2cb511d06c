// Finds serial ports by the identity of their USB adapter, wherever it is plugged in.
//
//   const Result<std::string> path = ChooseUsbPort({0x0403, 0x6001, "A50285BI"}, ListUsbPorts());
//
// Thread-safe.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "server/base/result.h"

namespace pheromone::links {

struct UsbIdentity {
  uint16_t vendor = 0;
  uint16_t product = 0;
  std::string serial;  ///< empty: any, or unknown
};

/// "0403:6001:A50285BI", or without the serial number "0403:6001"
std::string ToText(const UsbIdentity& identity);

struct UsbPort {
  std::string path;
  UsbIdentity identity;
};

/// The serial ports of all connected USB adapters, sorted by path; through libserialport.
std::vector<UsbPort> ListUsbPorts();

/// The path of the matching port. Errors: none matches (listing the existing ones), or several do.
Result<std::string> ChooseUsbPort(const UsbIdentity& wanted, std::span<const UsbPort> ports);

}  // namespace pheromone::links
