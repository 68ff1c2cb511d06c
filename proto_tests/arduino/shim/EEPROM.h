// ESPs' header of this name: Arduino.h.
#pragma once

// NOLINTBEGIN: the names are Arduino's

#include <stddef.h>
#include <stdint.h>

namespace shim {

class EEPROMClass {
 public:
  void begin(size_t size);
  uint8_t read(int at);
  void write(int at, uint8_t value);
  bool commit();
};

extern EEPROMClass EEPROM;

}  // namespace shim

using namespace shim;

// NOLINTEND
