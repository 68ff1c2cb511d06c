// Where a robot or a modem is: a serial port, a TCP port, or a UDP port.
//
//   /dev/ttyUSB0            a serial port, or any terminal device
//   192.168.1.7:8101        TCP
//   udp:192.168.1.7:4951    UDP, with whole frames in each datagram
//
//   Result<Address> address = ParseAddress("192.168.1.7:8101", 9600);
#pragma once

#include <sys/socket.h>

#include <cstdint>
#include <string>
#include <vector>

#include "server/base/result.h"

namespace pheromone::attach {

struct Address {
  enum class Kind { kSerial, kTcp, kUdp };

  Kind kind = Kind::kSerial;
  std::string text;              ///< as it was written
  uint32_t baud = 9600;          ///< of a serial port
  bool paced = false;            ///< `baud` is also that of a line behind a network or a pty
  sockaddr_storage socket = {};  ///< of the others
  socklen_t socket_size = 0;
};

/// A text with a slash, or without a colon, is a path. Otherwise the host is a name, an IPv4
/// address, or an IPv6 address in brackets. Names are resolved here, once, since a name server that
/// does not answer would hold up a robot that drives; this may block for seconds. `baud` has to be
/// one of SerialRates(). Errors: a missing or wrong port, a name that is not known.
Result<Address> ParseAddress(const std::string& text, uint32_t baud);

/// The bit rates at which a Pioneer is looked for, in this order: `first`, then those that ARIA
/// tries.
std::vector<uint32_t> PioneerRates(uint32_t first);

}  // namespace pheromone::attach
