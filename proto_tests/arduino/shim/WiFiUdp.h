// ESPs' header of this name: Arduino.h.
#pragma once

// NOLINTBEGIN: the names are Arduino's

#include <stddef.h>
#include <stdint.h>

namespace shim {

class IPAddress;

class WiFiUDP {
 public:
  void begin(uint16_t port);
  int beginPacket(IPAddress to, uint16_t port);
  size_t write(uint8_t byte);
  int endPacket();
  int parsePacket();
  int available();
  int read();
  IPAddress remoteIP();
  uint16_t remotePort();
};

}  // namespace shim

using namespace shim;

// NOLINTEND
