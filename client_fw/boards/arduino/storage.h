// Where the Arduino library keeps the boot counter and the settings: bytes 0 to 159 of the EEPROM,
// as the Storage of client_fw/boards/nonvolatile.h. On ESPs the EEPROM is a copy of a piece of
// flash, which Commit writes back as a whole: a loss of power just then may lose it. So that the
// boot counter does not use its numbers again then, it begins with a random one there.
#pragma once

#include <stdint.h>

#ifdef __AVR__
#include "client_fw/boards/avr/eeprom.h"
#else
#include <Arduino.h>
#include <EEPROM.h>
#endif

namespace pheromone {
namespace arduino {

#ifdef __AVR__

struct Storage : client::Eeprom {
  static void Begin() {}
  static void Commit() {}
  /// False: what was written may not be there at the next start.
  static constexpr bool Committed() { return true; }
  /// What the boot counter begins behind, if nothing is stored.
  static uint16_t FirstVersion() { return 0; }
};

#else

struct Storage {
  static constexpr uint16_t kSize = 256;

  static void Begin() { EEPROM.begin(kSize); }
  /// By the chip's generator, as long as the sketch has not called randomSeed.
  static uint16_t FirstVersion() { return static_cast<uint16_t>(::random(0x10000)); }
  static bool Ready() { return true; }
  static uint8_t Read(uint8_t at) { return EEPROM.read(at); }
  static void Write(uint8_t at, uint8_t value) { EEPROM.write(at, value); }
  static void Commit() { Last() = EEPROM.commit(); }
  static bool Committed() { return Last(); }

 private:
  static bool& Last() {
    static bool committed = false;
    return committed;
  }
};

#endif

}  // namespace arduino
}  // namespace pheromone
