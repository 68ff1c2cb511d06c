// A file of whoever runs the machine as the EEPROM, the Storage of client_fw/boards/nonvolatile.h
// for images that sign: "eeprom.bin" in the directory where QEMU was started with
// -semihosting-config enable=on. It has the layout of the ATmega's (client_fw/boards/avr/eeprom.h):
// settings and boot counter from 0, and from kKeyAddress the robot's key. Without semihosting the
// first call is a fault, and the image is reset again and again.
//
// Arm, "Semihosting for AArch32 and AArch64", sections 3.1 and 5. Main loop only.
#pragma once

#include <stdint.h>

#include "protocol/aes.h"

namespace pheromone {
namespace client {

class SemihostedEeprom {
 public:
  /// Before anything else, once: reads the file; what it does not have is erased, 0xFF.
  static void Begin();

  static bool Ready() { return true; }
  static uint8_t Read(uint8_t at) { return bytes_[at]; }
  static void Write(uint8_t at, uint8_t value);

  /// The key, if its check is right. False also after a write that has failed: the boot counter
  /// may come a second time then.
  static bool LoadKey(uint8_t* to);

 private:
  enum : uint16_t { kKeyAddress = 0x200, kSize = kKeyAddress + protocol::kAesBlock + 2 };

  static void Store(uint16_t at, uint16_t size);

  static uint8_t bytes_[kSize];
  static int32_t file_;
  static bool failed_;
};

}  // namespace client
}  // namespace pheromone
