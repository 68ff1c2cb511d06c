// The AVR's EEPROM as the Storage of client_fw/boards/nonvolatile.h, and its layout. Reading waits
// for a write to end (3.4 ms).
#pragma once

#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdint.h>

namespace pheromone {
namespace client {

/// The robot's ID if no strap is set; 0xFF, as erased, is ID 1. Below it: Nonvolatile.
constexpr uint8_t kIdAddress = 255;
/// The robot's key for signed frames, and its Check (protocol/crc16.h), low byte first, as
/// pheromonectl keys export --eeprom writes them.
constexpr uint16_t kKeyAddress = 0x200;

/// For the main loop, with interrupts enabled. Of its 4 KiB the first 256 bytes are used, and those
/// of the key. Address and mode bits are undefined after a reset (datasheet, section 8.6), so both
/// are written every time.
struct Eeprom {
  static bool Ready() { return (EECR & 1u << EEPE) == 0; }

  static uint8_t Read(uint8_t at) {
    while (!Ready()) {
    }
    EEAR = at;
    EECR |= 1u << EERE;
    return EEDR;
  }
  /// The same for all of it.
  static uint8_t ReadFar(uint16_t at) {
    while (!Ready()) {
    }
    EEAR = at;
    EECR |= 1u << EERE;
    return EEDR;
  }

  static void Write(uint8_t at, uint8_t value) {
    EEAR = at;
    EEDR = value;
    cli();
    EECR = 1u << EEMPE;  // and mode 0: erase and write
    EECR |= 1u << EEPE;  // within four cycles
    sei();
  }
};

}  // namespace client
}  // namespace pheromone
