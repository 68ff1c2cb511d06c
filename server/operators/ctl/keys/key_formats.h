// A robot's key in the formats of the programs that take it to the robot.
//
// Pure; any thread.
#pragma once

#include <cstdint>
#include <string>

#include "server/robots/signing/keys.h"

namespace pheromone::ctl {

/// Where the firmware of our AVR boards (client_fw/boards/avr) reads its key in the EEPROM.
constexpr uint16_t kKeyInEeprom = 0x200;

/// For pheromone-robot --key: 32 hexadecimal digits and a newline.
std::string KeyAsHex(const signing::Key& key);

/// For avrdude, as -U eeprom:w:FILE:i: Intel HEX of the key and its check, the complement of its
/// CRC-16 (protocol::Check), u16, low byte first, at kKeyInEeprom.
std::string KeyAsIntelHex(const signing::Key& key);

/// For sketches: a header in C with `pheromone_key`.
std::string KeyAsHeader(uint8_t id, const signing::Key& key);

}  // namespace pheromone::ctl
