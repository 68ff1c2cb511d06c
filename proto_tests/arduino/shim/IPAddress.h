// Arduino's header of this name: Arduino.h.
#pragma once

// NOLINTBEGIN: the names are Arduino's

#include <stdint.h>

namespace shim {

class IPAddress {
 public:
  constexpr IPAddress(uint8_t a, uint8_t b, uint8_t c, uint8_t d) : bytes{a, b, c, d} {}

  constexpr bool operator==(const IPAddress& other) const {
    return bytes[0] == other.bytes[0] && bytes[1] == other.bytes[1] && bytes[2] == other.bytes[2] &&
           bytes[3] == other.bytes[3];
  }

  uint8_t bytes[4];
};

}  // namespace shim

using namespace shim;

// NOLINTEND
